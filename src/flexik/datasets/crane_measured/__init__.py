"""Campaigns on a measured crane, and what is learnt from them."""
