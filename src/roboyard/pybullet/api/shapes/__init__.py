"""Collision and visual shapes, meshes, textures and createMultiBody."""
