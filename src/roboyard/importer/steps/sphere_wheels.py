"""Replace collision shapes of wheels by bounding spheres, which roll smoothly, also over edges."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from roboyard.description.geometry import shape_meshes
from roboyard.description.model import Collision, Link, Mesh, Visual
from roboyard.description.robot_model import Approximation, RobotModel
from roboyard.importer.context import ImportContext
from roboyard.importer.steps.collision import MAX_VERTICES, hull_collision
from roboyard.morphology.wheels import find_wheels
from roboyard.shapes.convex.hulls import convex_hull


def mark_wheels(robot: RobotModel, context: ImportContext) -> RobotModel:
    """Return the robot with its wheel links; where `use_sphere_wheels` is set, each collides as its bounding
    sphere.

    A wheel of several shapes gets one convex hull first.
    """
    base = context.config.base_motion
    wheels = tuple(name for name in base.wheel_links if name in robot.description.link_by_name)
    if not base.wheel_links and not base.use_holonomic_joints and not robot.semantic.conclusions:
        wheels = tuple(wheel.link for wheel in find_wheels(robot.description))
        if wheels:
            context.log.note(f"wheels detected: {', '.join(wheels)}; set base_motion.wheel_links for others")
    robot = replace(robot, semantic=replace(robot.semantic, wheel_links=wheels))
    if not base.use_sphere_wheels:
        return robot
    approximations: dict[str, Approximation] = dict(robot.approximations)
    links: list[Link] = []
    for link in robot.description.links:
        if link.name in wheels:
            who = f'link "{link.name}"'
            if not link.collisions:
                context.log.warn("a wheel without collision shape cannot roll", who)
            else:
                link = _one_mesh(link, context)
                approximations[link.name] = "boundingSphere"
                context.log.note("collides as its bounding sphere", who)
        links.append(link)
    description = replace(robot.description, links=tuple(links))
    return replace(robot, description=description, approximations=approximations)


def _one_mesh(link: Link, context: ImportContext) -> Link:
    if len(link.collisions) == 1 and isinstance(link.collisions[0].geometry, Mesh):
        return link
    meshes = shape_meshes(link.collisions)
    if not meshes:
        return link
    hull = convex_hull(np.concatenate([mesh.vertices for mesh in meshes]), MAX_VERTICES).mesh
    origin = Visual(geometry=link.collisions[0].geometry)
    made: Collision = hull_collision(link.name, 0, hull, context, origin_of=origin)
    return replace(link, collisions=(made,))
