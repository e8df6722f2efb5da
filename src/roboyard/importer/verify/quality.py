"""How well each link's collision shapes and spheres stand for it, and what overlaps at rest."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from roboyard.description.geometry import shape_meshes
from roboyard.description.model import Link
from roboyard.description.robot_model import CollisionSphere, RobotModel
from roboyard.importer.context import ImportContext
from roboyard.shapes.cache import content_key, load_arrays, store_arrays
from roboyard.shapes.coverage import Coverage, measure_coverage
from roboyard.shapes.mesh import TriangleMesh
from roboyard.transforms import Array

VERSION = 1
"""Raised when the same shapes give other figures than before."""
BALLOON = 1.0
"""Excess of a link's collision shapes, as a share of the link's volume, from which the user is told."""
REACH = 1e-4
"""m: overlap of neighbours below which they just touch."""
FIGURES = ("excess", "missing", "coverage", "sphere_excess")


def quality(robot: RobotModel, context: ImportContext) -> RobotModel:
    """The robot as it is; facts `links` hold each link's figures, warnings name hulls that are mostly air."""
    overlaps = neighbour_overlaps(robot)
    planned = robot.planning.spheres if robot.planning is not None else {}
    facts: dict[str, dict[str, object]] = {}
    links = robot.description.links
    for index, link in enumerate(links):
        context.log.tell(index / len(links), link.name)
        facts[link.name] = _link_facts(robot, link, planned.get(link.name, ()))
        own = {(b if a == link.name else a): d for (a, b), d in overlaps.items() if link.name in (a, b)}
        facts[link.name]["overlaps_mm"] = {name: round(depth * 1e3, 2) for name, depth in own.items()}
    context.log.facts["links"] = facts
    _tell_of_balloons(facts, context)
    return robot


def _link_facts(robot: RobotModel, link: Link, spheres: Sequence[CollisionSphere]) -> dict[str, object]:
    facts: dict[str, object] = {
        "mass": None if link.inertial is None else link.inertial.mass,
        "shapes": len(link.collisions),
        "spheres": len(spheres),
    }
    solid = shape_meshes(robot.solids.get(link.name, ())) or shape_meshes(link.visuals)
    seen = [*solid, *shape_meshes(link.visuals)]
    if not seen:
        return facts
    corners = np.concatenate([mesh.vertices for mesh in seen])
    facts["size"] = [round(float(extent), 4) for extent in np.ptp(corners, axis=0)]
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
    """`measure_coverage`, kept on disk."""
    centers = np.array([ball.center for ball in spheres]).reshape(-1, 3)
    radii = np.array([ball.radius for ball in spheres])
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
    """How deep the collision shapes of links joined by a joint reach into one another at rest; m."""
    import mujoco

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
        if depth > REACH:
            found[joint.parent, joint.child] = float(depth)
    return found


def _apart(data: object, boxes: Array, a: int, b: int) -> bool:
    """Whether the balls round two geoms do not meet."""
    centers, radii = [], []
    for geom in (a, b):
        turn = np.asarray(data.geom_xmat[geom]).reshape(3, 3)  # type: ignore[attr-defined]
        centers.append(data.geom_xpos[geom] + turn @ boxes[geom, :3])  # type: ignore[attr-defined]
        radii.append(float(np.linalg.norm(boxes[geom, 3:])))
    return bool(np.linalg.norm(centers[0] - centers[1]) > sum(radii))


def _tell_of_balloons(facts: Mapping[str, Mapping[str, object]], context: ImportContext) -> None:
    """Warn of links whose collision shapes hold more air than link."""
    for name, figures in facts.items():
        excess = figures.get("excess")
        if isinstance(excess, float) and excess > BALLOON:
            context.log.warn(
                f"its collision shapes hold {excess:.1f} times its volume in air; list it in "
                "collision.coacd_links, or raise collision.hull_count",
                f'link "{name}"',
            )
