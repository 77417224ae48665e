"""Errors of a measured campaign."""
