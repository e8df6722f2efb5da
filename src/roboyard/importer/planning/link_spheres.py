"""Collision spheres of links, fitted once for each distinct shape and cached on disk."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor

import numpy as np

from roboyard._threads import thread_count
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
WORKERS = 2
"""Most links fitted at a time."""
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
    given: dict[str, list[TriangleMesh]] = {}
    for name, shapes in solids.items():
        exact = _exact_spheres(shapes) if shapes else ()
        if exact is None:
            meshes = [mesh for mesh in shape_meshes(shapes) if _extent([mesh]) > SMALLEST]
            if meshes:
                given[name] = meshes
        elif exact:
            found[name] = exact
            facts[name] = {"spheres": len(exact), "exact": True}
    for name, (arrays, cached) in zip(given, _all_fitted(given, preset, context), strict=True):
        found[name] = _spheres(arrays["centers"], arrays["radii"])
        facts[name] = {
            "spheres": len(found[name]),
            "cached": cached,
            **{key: round(float(arrays[key]), 4) for key in FIGURES},
        }
    order = [name for name in solids if name in found]
    context.log.facts["spheres"] = {name: facts[name] for name in order}
    return {name: found[name] for name in order}


def _exact_spheres(shapes: Sequence[Collision]) -> tuple[CollisionSphere, ...] | None:
    """Return shapes that are spheres already; None where one is not."""
    made = []
    for shape in shapes:
        if not isinstance(shape.geometry, Sphere):
            return None
        made.append(CollisionSphere(center=shape.origin.position, radius=shape.geometry.radius))
    return tuple(made)


def _all_fitted(
    given: Mapping[str, list[TriangleMesh]], preset: str, context: ImportContext
) -> Iterator[tuple[dict[str, Array], bool]]:
    """Yield the fit of each link's meshes, and whether it was known; equal shapes are fitted once.

    The loops of a fit hold no lock of Python's, so that threads fit on several cores.
    """
    keys: list[str] = []
    origins: list[Array] = []
    for meshes in given.values():
        origin = np.min([mesh.bounds[0] for mesh in meshes], axis=0)
        parts: list[object] = [preset, VERSION]
        for mesh in meshes:
            parts += [np.round(mesh.vertices - origin, 9) + 0.0, mesh.faces]
        keys.append(content_key(*parts))
        origins.append(origin)
    with ThreadPoolExecutor(max_workers=thread_count(WORKERS), thread_name_prefix="spheres") as pool:
        tasks: dict[str, Future[tuple[dict[str, Array], bool]]] = {}
        try:
            for key, origin, meshes in zip(keys, origins, given.values(), strict=True):
                if key not in tasks:
                    tasks[key] = pool.submit(_fitted, meshes, origin, key, preset)
            seen: set[str] = set()
            for done, (name, key, origin) in enumerate(zip(given, keys, origins, strict=True)):
                context.log.report_progress(done / len(given), name)
                arrays, cached = tasks[key].result()
                yield {**arrays, "centers": arrays["centers"] + origin}, cached or key in seen
                seen.add(key)
        finally:
            pool.shutdown(cancel_futures=True)


def _fitted(
    meshes: list[TriangleMesh], origin: Array, key: str, preset: str
) -> tuple[dict[str, Array], bool]:
    """Return a fit with its centres from `origin`, and whether it was stored."""
    arrays = load_arrays("spheres", key)
    if arrays is not None:
        return arrays, True
    fit = fit_spheres(meshes, preset=preset)  # type: ignore[arg-type]
    arrays = {"centers": fit.centers - origin, "radii": fit.radii}
    arrays |= {name: np.asarray(float(getattr(fit, name))) for name in FIGURES}
    store_arrays("spheres", key, arrays)
    return arrays, False


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
