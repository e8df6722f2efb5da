"""Meshes in; hulls, spheres and inertias out."""

from __future__ import annotations

from roboyard.shapes.load import load_mesh, scaled
from roboyard.shapes.mesh import TriangleMesh

__all__ = ["TriangleMesh", "load_mesh", "scaled"]
