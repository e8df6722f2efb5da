"""Closest points of bodies and of shapes at poses, in compiled loops and as machine code."""
