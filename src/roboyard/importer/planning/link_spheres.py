"""Collision spheres of links, fitted once for each distinct shape and cached on disk."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from roboyard.description.geometry import shape_meshes
from roboyard.description.model import Collision, Sphere
from roboyard.description.robot_model import CollisionSphere
from roboyard.importer.context import ImportContext
from roboyard.shapes.cache import content_key, load_arrays, store_arrays
from roboyard.shapes.mesh import TriangleMesh
from roboyard.shapes.spheres.fit import fit_spheres
from roboyard.transforms import Array

VERSION = 3
"""Cache version: increase it when the same shapes give other spheres than before."""
SMALLEST = 1e-6
"""Extent below which a shape is ignored as a point (m)."""
FIGURES = ("coverage", "surface_coverage", "protrusion", "excess", "gap_mm")


def fit_links(
    solids: Mapping[str, Sequence[Collision]], context: ImportContext, *, preset: str
) -> dict[str, tuple[CollisionSphere, ...]]:
    """Return the spheres of every link with a shape of non-zero size, in the order of `solids`.

    Args:
        solids: link name to its shapes, in the link's frame.
        context: log and progress of the import.
        preset: preset of `fit_spheres`.
    """
    found: dict[str, tuple[CollisionSphere, ...]] = {}
    facts: dict[str, object] = {}
    known: dict[str, dict[str, Array]] = {}
    with_shapes = [name for name, shapes in solids.items() if shapes]
    for done, name in enumerate(with_shapes):
        context.log.report_progress(done / len(with_shapes), name)
        exact = _exact_spheres(solids[name])
        if exact is not None:
            found[name] = exact
            facts[name] = {"spheres": len(exact), "exact": True}
            continue
        meshes = [mesh for mesh in shape_meshes(solids[name]) if _extent([mesh]) > SMALLEST]
        if not meshes:
            continue
        arrays, cached = _fitted(meshes, preset, known)
        found[name] = _spheres(arrays["centers"], arrays["radii"])
        facts[name] = {
            "spheres": len(found[name]),
            "cached": cached,
            **{key: round(float(arrays[key]), 4) for key in FIGURES},
        }
    context.log.facts["spheres"] = facts
    return found


def _exact_spheres(shapes: Sequence[Collision]) -> tuple[CollisionSphere, ...] | None:
    """Return shapes that are spheres already; None where one is not."""
    made = []
    for shape in shapes:
        if not isinstance(shape.geometry, Sphere):
            return None
        made.append(CollisionSphere(center=shape.origin.position, radius=shape.geometry.radius))
    return tuple(made)


def _fitted(
    meshes: list[TriangleMesh], preset: str, known: dict[str, dict[str, Array]]
) -> tuple[dict[str, Array], bool]:
    origin = np.min([mesh.bounds[0] for mesh in meshes], axis=0)
    parts: list[object] = [preset, VERSION]
    for mesh in meshes:
        parts += [np.round(mesh.vertices - origin, 9) + 0.0, mesh.faces]
    key = content_key(*parts)
    cached = key in known
    arrays = known.get(key)
    if arrays is None:
        arrays = load_arrays("spheres", key)
        cached = arrays is not None
    if arrays is None:
        fit = fit_spheres(meshes, preset=preset)  # type: ignore[arg-type]
        arrays = {"centers": fit.centers - origin, "radii": fit.radii}
        arrays |= {name: np.asarray(float(getattr(fit, name))) for name in FIGURES}
        store_arrays("spheres", key, arrays)
    known[key] = arrays
    return {**arrays, "centers": arrays["centers"] + origin}, cached


def _spheres(centers: Array, radii: Array) -> tuple[CollisionSphere, ...]:
    """Return (n, 3) centres and (n,) radii as spheres, rounded outwards to a hundredth of a millimetre."""
    made = []
    for center, radius in zip(centers, radii, strict=True):
        x, y, z = (round(float(value), 5) + 0.0 for value in center)
        made.append(CollisionSphere(center=(x, y, z), radius=max(round(float(radius) + 5e-6, 5), 1e-5)))
    return tuple(made)


def _extent(meshes: list[TriangleMesh]) -> float:
    lower = np.min([mesh.bounds[0] for mesh in meshes], axis=0)
    upper = np.max([mesh.bounds[1] for mesh in meshes], axis=0)
    return float((upper - lower).max())
