"""Spheres and pairs of a robot without a planner file, fitted to its collision shapes and cached on disk."""

from __future__ import annotations

import logging
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from roboyard.description.geometry import geometry_mesh, transformed_mesh
from roboyard.description.model import Collision, Link, Mesh, RobotDescription, Sphere, Visual
from roboyard.description.robot_model import CollisionSphere
from roboyard.errors import ConfigError
from roboyard.planning.spheres.never_touching import proven_apart
from roboyard.planning.spheres.self_pairs import adjacent_pairs, allowed_overlaps, ignored_pairs, rough_pairs
from roboyard.planning.spheres.sphere_model import SphereModel
from roboyard.shapes.cache import content_key, load_arrays, store_arrays
from roboyard.shapes.mesh import TriangleMesh
from roboyard.transforms import Array

VERSION = 2
"""Cache version: increase it when the same shapes give other spheres or pairs than before."""
SLACK = 0.001
"""Largest distance of a shape's surface outside the fitted spheres (m)."""
BUFFER = 0.0005
"""Padding of every sphere against obstacles and other links, beyond the slack (m)."""
SMALLEST = 1e-6
"""Extent below which a shape is ignored as a point (m)."""

Progress = Callable[[str], None]


def fitted_model(
    description: RobotDescription,
    *,
    rest: Mapping[str, float] | None = None,
    tools: Sequence[str] = (),
    progress: Progress | None = None,
) -> SphereModel:
    """Return spheres around the hulls of a robot's collision shapes, and the pairs that may touch.

    Args:
        description: the robot; where no link has a collision shape, visual ones are used.
        rest: joint name to rest position (rad or m); zero, or the nearest limit, by default.
        tools: end-effector links; links without children by default.
        progress: called with the name of each link that is fitted and not cached; logs one line
            by default.

    Raises:
        ConfigError: no link has a shape.
        MeshError: a mesh cannot be read.
    """
    spheres, gaps = _spheres(description, progress)
    if not spheres:
        raise ConfigError(f"{description.name}: no link has a collision or visual shape; add one to plan for")
    leaves = [l.name for l in description.links if not description.child_joints[l.name]]
    model = SphereModel(
        description=description,
        spheres=spheres,
        ignore=frozenset(),
        buffer=BUFFER,
        self_buffer=dict.fromkeys(spheres, BUFFER / 2),
        gaps=gaps,
        retract=dict(rest or {}),
        tools=tuple(tools or leaves),
    )
    model = replace(model, ignore=ignored_pairs(model))
    return _judged(model)


def covering_model(model: SphereModel, progress: Progress | None = None) -> SphereModel:
    """Return a planner file's robot with fitted spheres added, so that its spheres contain its hulls.

    Files leave parts of links without spheres; among their spheres alone, paths are found that the robot
    cannot take. Pairs that the file ignores stay ignored.

    Args:
        model: as `load_planner_file` returns it.
        progress: called with the name of each link that is fitted and not cached; logs one line
            by default.

    Raises:
        MeshError: a mesh cannot be read.
    """
    fitted, gaps = _spheres(model.description, progress)
    names = [
        link.name for link in model.description.links if link.name in fitted or link.name in model.spheres
    ]
    pairs = adjacent_pairs(model.description, [name for name in names if name in fitted])
    made = replace(
        model,
        spheres={name: (*model.spheres.get(name, ()), *fitted.get(name, ())) for name in names},
        ignore=model.ignore | pairs,
        gaps={name: gaps.get(name, 0.0) for name in names},
        self_buffer={name: model.self_buffer.get(name, BUFFER / 2) for name in names},
    )
    return _judged(made)


def _judged(model: SphereModel) -> SphereModel:
    """Return a model with the pairs for whose hulls its spheres are too rough."""
    model = replace(model, rough=rough_pairs(model))
    apart = proven_apart(model)
    model = replace(model, rough=model.rough - apart, apart=apart)
    return replace(model, overlaps=allowed_overlaps(model))


def _spheres(
    description: RobotDescription, progress: Progress | None
) -> tuple[dict[str, tuple[CollisionSphere, ...]], dict[str, float]]:
    """Return spheres around the hulls of each link's shapes, and how far those end outside (m)."""
    progress = progress or _logged_once(description.name)
    shapes: dict[str, Sequence[Collision | Visual]] = {l.name: l.collisions for l in description.links}
    if not any(shapes.values()):
        shapes = {l.name: l.visuals for l in description.links}
    spheres, gaps = {}, {}
    for link in description.links:
        own = _link_spheres(link, shapes[link.name], progress)
        if len(own):
            spheres[link.name] = tuple(
                CollisionSphere(center=(float(x), float(y), float(z)), radius=float(r)) for x, y, z, r in own
            )
            exact = all(isinstance(s.geometry, Sphere) for s in shapes[link.name])
            gaps[link.name] = 0.0 if exact else SLACK
    return spheres, gaps


def _link_spheres(link: Link, shapes: Sequence[Collision | Visual], progress: Progress | None) -> Array:
    """Return (s, 4) centres and radii in the link's frame (m)."""
    rows = [
        (*shape.origin.position, shape.geometry.radius)
        for shape in shapes
        if isinstance(shape.geometry, Sphere) and shape.geometry.radius > 0
    ]
    surfaces = _surfaces([shape for shape in shapes if not isinstance(shape.geometry, Sphere)])
    if surfaces:
        parts = [part for mesh, is_hull in surfaces for part in (mesh.vertices, mesh.faces, is_hull)]
        key = content_key("planning", VERSION, SLACK, *parts)
        stored = load_arrays("spheres", key)
        if stored is None:
            from roboyard.shapes.spheres.fit import fit_spheres

            if progress is not None:
                progress(link.name)
            fit = fit_spheres(_solids(surfaces), preset="safe")
            stored = {"spheres": np.concatenate([fit.centers, fit.radii[:, None]], axis=1)}
            store_arrays("spheres", key, stored)
        rows.extend(stored["spheres"])
    return np.array(rows, dtype=float).reshape(-1, 4)


def _logged_once(robot: str) -> Progress:
    """Return a progress callback that logs one line when the first link of a robot is fitted."""
    links: list[str] = []

    def note(link: str) -> None:
        if not links:
            logging.getLogger("roboyard").warning(
                "fitting spheres to the links of %s: once, about 2 seconds", robot
            )
        links.append(link)

    return note


def _surfaces(shapes: Sequence[Collision | Visual]) -> list[tuple[TriangleMesh, bool]]:
    """Return shapes in the link's frame, and whether physics sees their hulls."""
    found = []
    for shape in shapes:
        mesh = geometry_mesh(shape.geometry)
        if mesh is None or not len(mesh.faces) or np.ptp(mesh.vertices, axis=0).max() < SMALLEST:
            continue
        found.append((transformed_mesh(mesh, shape.origin), isinstance(shape.geometry, Mesh)))
    return found


def _solids(surfaces: Sequence[tuple[TriangleMesh, bool]]) -> list[TriangleMesh]:
    """Return the convex solids that physics sees: hulls of meshes, and primitives."""
    from roboyard.shapes.convex.hulls import convex_hull

    return [convex_hull(mesh, None).mesh if is_hull else mesh for mesh, is_hull in surfaces]
