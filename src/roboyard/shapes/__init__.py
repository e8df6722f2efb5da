"""Meshes in; hulls, spheres and inertias out. Fitting loads numba on first use only."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from roboyard.shapes.load import load_mesh, scaled
from roboyard.shapes.mesh import TriangleMesh

_HOMES = {
    "Decomposition": "roboyard.shapes.decompose",
    "SphereFit": "roboyard.shapes.spheres",
    "convex_hull": "roboyard.shapes.hulls",
    "decompose_many": "roboyard.shapes.decompose_all",
    "fit_spheres": "roboyard.shapes.spheres",
    "measure_spheres": "roboyard.shapes.metrics",
}

__all__ = [
    "Decomposition",
    "SphereFit",
    "TriangleMesh",
    "convex_hull",
    "decompose_many",
    "fit_spheres",
    "load_mesh",
    "measure_spheres",
    "scaled",
]

if TYPE_CHECKING:
    from roboyard.shapes.decompose import Decomposition
    from roboyard.shapes.decompose_all import decompose_many
    from roboyard.shapes.hulls import convex_hull
    from roboyard.shapes.metrics import measure_spheres
    from roboyard.shapes.spheres import SphereFit, fit_spheres


def __getattr__(name: str) -> Any:
    """Load a public name from its file on first use."""
    if name in _HOMES:
        return getattr(import_module(_HOMES[name]), name)
    raise AttributeError(f"module 'roboyard.shapes' has no attribute {name!r}")
