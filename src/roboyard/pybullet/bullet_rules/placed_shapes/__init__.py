"""Boxes, hulls and edges of the shapes of bodies, and where they are among MuJoCo's geoms."""
