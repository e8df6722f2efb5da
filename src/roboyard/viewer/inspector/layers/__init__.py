"""Overlays that the inspector draws over a robot."""
