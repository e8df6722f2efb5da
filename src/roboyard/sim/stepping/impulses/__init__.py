"""Constraint rows solved one after the other, as an impulse solver does."""
