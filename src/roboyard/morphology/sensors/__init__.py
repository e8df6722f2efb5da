"""Cameras, lidars and IMUs that a description implies."""
