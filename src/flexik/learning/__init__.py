"""Perceptrons and their trainers: arrays in, a network and its training record out."""
