"""A robot as spheres: their fit, which pairs of links are checked, the arrays of the kernels."""
