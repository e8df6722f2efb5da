"""Collision spheres fitted to meshes."""
