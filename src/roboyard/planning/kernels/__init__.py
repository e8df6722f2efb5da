"""Collision checking, sampling, shortcuts and timing as compiled loops over plain arrays."""
