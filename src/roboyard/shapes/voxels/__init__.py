"""Meshes as filled voxel grids with distances."""
