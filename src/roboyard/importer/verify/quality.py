"""Fit of each link's collision shapes and spheres, and overlaps at rest."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from roboyard.description.geometry import shape_meshes
from roboyard.description.model import Link
from roboyard.description.robot_model import CollisionSphere, RobotModel
from roboyard.importer.context import ImportContext
from roboyard.shapes.cache import content_key, load_arrays, store_arrays
from roboyard.shapes.coverage import Coverage, measure_coverage
from roboyard.shapes.mesh import TriangleMesh, bounding_box
from roboyard.transforms import Array

VERSION = 1
"""Cache version: increase it when the same shapes give other figures than before."""
MAX_EXCESS = 1.0
"""Excess volume of a link's collision shapes from which a warning is logged, as a share of the link's."""
MIN_OVERLAP = 1e-4
"""Smallest depth that counts as overlap of adjacent links (m)."""
FIGURES = ("excess", "missing", "coverage", "sphere_excess")


def measure_quality(robot: RobotModel, context: ImportContext) -> RobotModel:
    """Record each link's figures in the fact `links`, and warn of hulls that are mostly empty.

    The robot is returned unchanged.
    """
    overlaps = neighbour_overlaps(robot)
    planned = robot.planning.spheres if robot.planning is not None else {}
    facts: dict[str, dict[str, object]] = {}
    links = robot.description.links
    for index, link in enumerate(links):
        context.log.report_progress(index / len(links), link.name)
        facts[link.name] = _link_facts(robot, link, planned.get(link.name, ()))
        own = {(b if a == link.name else a): d for (a, b), d in overlaps.items() if link.name in (a, b)}
        facts[link.name]["overlaps_mm"] = {name: round(depth * 1e3, 2) for name, depth in own.items()}
    context.log.facts["links"] = facts
    _warn_of_excess(facts, context)
    return robot


def _link_facts(robot: RobotModel, link: Link, spheres: Sequence[CollisionSphere]) -> dict[str, object]:
    facts: dict[str, object] = {
        "mass": None if link.inertial is None else link.inertial.mass,
        "shapes": len(link.collisions),
        "spheres": len(spheres),
    }
    solid = shape_meshes(robot.solids.get(link.name, ())) or shape_meshes(link.visuals)
    shown = [*solid, *shape_meshes(link.visuals)]
    if not shown:
        return facts
    corners = np.concatenate([mesh.vertices for mesh in shown])
    facts["size"] = [round(float(extent), 4) for extent in np.ptp(bounding_box(corners), axis=0)]
    hulls = shape_meshes(link.collisions)
    if not solid or not (hulls or spheres):
        return facts
    cover = _cover(solid, hulls, spheres)
    if hulls:
        facts["excess"], facts["missing"] = round(cover.excess, 4), round(cover.missing, 4)
    if spheres:
        facts["coverage"], facts["sphere_excess"] = round(cover.coverage, 4), round(cover.sphere_excess, 4)
    return facts


def _cover(
    solid: Sequence[TriangleMesh], hulls: Sequence[TriangleMesh], spheres: Sequence[CollisionSphere]
) -> Coverage:
    """Return the coverage of a link's shapes and spheres, cached on disk."""
    centers = np.array([sphere.center for sphere in spheres]).reshape(-1, 3)
    radii = np.array([sphere.radius for sphere in spheres])
    parts: list[object] = [VERSION, centers, radii, len(solid)]
    for mesh in (*solid, *hulls):
        parts += [np.round(mesh.vertices, 9) + 0.0, mesh.faces]
    key = content_key(*parts)
    known = load_arrays("covers", key)
    if known is not None and set(known) == set(FIGURES):
        return Coverage(**{name: float(known[name]) for name in FIGURES})
    cover = measure_coverage(solid, hulls, centers, radii)
    store_arrays("covers", key, {name: np.asarray(getattr(cover, name)) for name in FIGURES})
    return cover


def neighbour_overlaps(robot: RobotModel) -> dict[tuple[str, str], float]:
    """Return how deep the collision shapes of links connected by a joint overlap at rest (m)."""
    from roboyard._mujoco import mujoco
    from roboyard.sim import World

    world = World(visual_geoms=False)
    body = world.add_description(robot.description, fixed_base=True, self_collision=True, drives=False)
    rest = robot.semantic.rest
    for joint in body.joints:
        if joint.is_scalar and joint.name in rest:
            joint.position = rest[joint.name]
    world.detect_contacts()
    row_of = {link.name: int(row) for link, row in zip(body.links, body.mujoco_ids, strict=True)}
    geoms: dict[int, list[int]] = {}
    for geom, row in enumerate(world.model.geom_bodyid):
        geoms.setdefault(int(row), []).append(geom)
    found: dict[tuple[str, str], float] = {}
    line = np.zeros(6)
    boxes = world.model.geom_aabb
    for joint in robot.description.joints:
        first, second = (geoms.get(row_of[name], []) for name in (joint.parent, joint.child))
        depth = 0.0
        for a in first:
            for b in second:
                if _apart(world.data, boxes, a, b):
                    continue
                depth = max(depth, -mujoco.mj_geomDistance(world.model, world.data, a, b, 1.0, line))
        if depth > MIN_OVERLAP:
            found[joint.parent, joint.child] = float(depth)
    return found


def _apart(data: object, boxes: Array, a: int, b: int) -> bool:
    """Return whether the bounding spheres of two geoms do not touch."""
    centers, radii = [], []
    for geom in (a, b):
        rotation = np.asarray(data.geom_xmat[geom]).reshape(3, 3)  # type: ignore[attr-defined]
        centers.append(data.geom_xpos[geom] + rotation @ boxes[geom, :3])  # type: ignore[attr-defined]
        radii.append(float(np.linalg.norm(boxes[geom, 3:])))
    return bool(np.linalg.norm(centers[0] - centers[1]) > sum(radii))


def _warn_of_excess(facts: Mapping[str, Mapping[str, object]], context: ImportContext) -> None:
    """Warn of links whose collision shapes enclose more empty space than link."""
    for name, figures in facts.items():
        excess = figures.get("excess")
        if isinstance(excess, float) and excess > MAX_EXCESS:
            context.log.warn(
                f"its collision shapes enclose {excess:.1f} times its volume of empty space; list it in "
                "collision.coacd_links, or raise collision.hull_count",
                f'link "{name}"',
            )
