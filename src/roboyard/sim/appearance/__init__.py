"""Render shapes and textures of the bodies in a world."""
