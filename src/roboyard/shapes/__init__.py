"""Load meshes; compute convex parts, collision spheres and inertias (numba is loaded on first use)."""

from __future__ import annotations

from typing import TYPE_CHECKING

from roboyard._lazy import lazy_names
from roboyard.shapes.load import load_mesh, scaled
from roboyard.shapes.mesh import TriangleMesh

_HOMES = {
    "Decomposition": "roboyard.shapes.convex.decomposition",
    "SphereFit": "roboyard.shapes.spheres.fit",
    "convex_hull": "roboyard.shapes.convex.hulls",
    "decompose_many": "roboyard.shapes.convex.batch",
    "fit_spheres": "roboyard.shapes.spheres.fit",
    "measure_spheres": "roboyard.shapes.spheres.metrics",
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
    from roboyard.shapes.convex.batch import decompose_many
    from roboyard.shapes.convex.decomposition import Decomposition
    from roboyard.shapes.convex.hulls import convex_hull
    from roboyard.shapes.spheres.fit import SphereFit, fit_spheres
    from roboyard.shapes.spheres.metrics import measure_spheres


__getattr__ = lazy_names(__name__, _HOMES)
