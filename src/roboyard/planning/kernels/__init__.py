"""Collision checking, sampling, shortcuts and timing as numba functions over plain arrays."""
