"""Test that the planner's spheres cover what is seen of each link, not only its collision shapes.

A vendor's collision shape may be a small cylinder in a large cover: spheres that fit the cylinder leave the
cover bare, and a planner moves it through the furniture. Links whose spheres do not fit the collision shapes
either, as a configuration may give them, are warnings.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from roboyard.description.geometry import shape_meshes
from roboyard.description.model import Collision, Visual
from roboyard.errors import MeshError
from roboyard.shapes.surface_points import share_near_spheres, surface_points
from roboyard.validation.report import Gate
from roboyard.validation.test_world import TestWorld

MIN_COVERED = 0.6
"""Smallest share of a link's visual surface inside or near a sphere."""
NEAR = 0.01
"""Distance to a sphere that counts as covered (m)."""
SMALL = 0.03
"""Links whose visual shapes are smaller than this do not count (m)."""


def sphere_gates(test_world: TestWorld) -> tuple[Gate, ...]:
    """Measure the smallest share of a link's visible surface that spheres cover."""
    title = "Spheres cover what is seen"
    if not test_world.spheres:
        skipped = "no planner file with spheres belongs to the robot"
        return (
            Gate(name="spheres", title=title, figure=1.0, threshold=MIN_COVERED, unit="", skipped=skipped),
        )
    shares: dict[str, float] = {}
    as_given: list[str] = []
    for link in test_world.description.links:
        spheres = test_world.spheres.get(link.name, ())
        share = _share(link.visuals, spheres)
        if share is None:
            continue
        solid = _share(link.collisions, spheres) if spheres else 0.0
        if share < MIN_COVERED and solid is not None and solid < MIN_COVERED:
            as_given.append(f"link {link.name!r}: its spheres cover {share:.0%} of its visual shapes")
        else:
            shares[link.name] = share
    bare = sorted((share, name) for name, share in shares.items() if share < MIN_COVERED)
    return (
        Gate(
            name="spheres",
            title=title,
            figure=min(shares.values(), default=1.0),
            threshold=MIN_COVERED,
            unit="of the surface",
            sense="at least",
            detail=f"{len(shares)} links; points of visual shapes within {NEAR * 100:g} cm of a sphere",
            findings=[
                f"link {name!r}: spheres cover its collision shapes and {share:.0%} of its visual ones"
                for share, name in bare
            ],
            warnings=[_several(as_given)] if as_given else (),
            advice="collision shapes as large as the visual ones, curobo.sphere_preset, or "
            "curobo.collision_spheres",
        ),
    )


def _several(texts: Sequence[str]) -> str:
    return "; ".join(texts[:3]) + (f"; and {len(texts) - 3} more links" if len(texts) > 3 else "")


def _share(shapes: Sequence[Visual | Collision], spheres: Sequence[Mapping[str, Any]]) -> float | None:
    """Return the share of shapes' surface that spheres cover; None for tiny, unreadable or no shapes."""
    try:
        meshes = shape_meshes(shapes)
    except MeshError:
        return None
    points = surface_points(meshes)
    if not len(points) or float(np.ptp(points, axis=0).max()) < SMALL:
        return None
    return share_near_spheres(points, [s["center"] for s in spheres], [s["radius"] for s in spheres], NEAR)
