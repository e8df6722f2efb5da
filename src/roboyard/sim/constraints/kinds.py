"""Marks of kinds of constraints in arrays that compiled loops read."""

SLIDE = -2
"""In place of the degree of freedom that a gear follows: the equality is a slide."""
