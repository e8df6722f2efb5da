"""Stability of robots on a floor: support polygon, zero-moment point, wheels and ground clearance."""
