"""Convex hulls and convex decompositions of meshes."""
