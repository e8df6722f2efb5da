"""Rotations, transforms and camera matrices."""
