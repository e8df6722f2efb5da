"""Robots with motors, constraints and contacts solved row by row."""
