"""Changes that a definition makes to the robot's description before it is added to a world."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from dataclasses import replace

import numpy as np

from roboyard.description.mass_properties import GRAVITY
from roboyard.description.model import Collision, Joint, Link, Mesh, Pose, RobotDescription, Sphere
from roboyard.kinematics.description_poses import forward_kinematics
from roboyard.robots.definition.schema import RobotDefinition
from roboyard.robots.stability.ground_clearance import links_below_floor, trim
from roboyard.robots.stability.wheels import Wheel, as_sphere, driven_wheels, mesh_points

SWIVEL_FRICTION = 1e-3
"""Dry friction of a caster's joints as a multiple of the load (m): bearings and the floor below the wheel."""


def edit_description(definition: RobotDefinition, description: RobotDescription) -> RobotDescription:
    """Return the description with disabled collision shapes removed, round wheels, and hidden markers."""
    disabled = set(definition.disabled_collision_link_names or ())
    hidden: set[str] = set()
    if definition.visual_only_eef_links and definition.manipulation is not None:
        hidden = set(definition.manipulation.eef_link_names.values())
    wheels: Collection[str] = ()
    block = definition.holonomic_base
    if block is not None and block.force_sphere_wheel_approximation and definition.locomotion is not None:
        wheels = definition.locomotion.floor_touching_base_link_names
    links = tuple(_edit_link(link, disabled, hidden, wheels) for link in description.links)
    driven = driven_wheels(definition, description)
    if driven:
        links = _with_round_wheels(links, definition, description, driven)
    joints = tuple(_with_swivel_friction(definition, description))
    return replace(description, links=links, joints=joints)


def _with_swivel_friction(definition: RobotDefinition, description: RobotDescription) -> Iterator[Joint]:
    """Yield the joints; those of casters that have no dry friction get some.

    The wheels of casters slide without friction (see `roboyard.robots.body_setup`), so that nothing else
    stops their swivels on a robot that leans by the least angle.
    """
    block = definition.locomotion
    floor = block.floor_touching_base_link_names if block is not None else ()
    wheels = {*block.base_joint_names} if block is not None else set()
    swivels = set[str]()
    for link in floor if definition.two_wheel is not None else ():
        above = []
        while (joint := description.parent_joint.get(link)) is not None and joint.name not in wheels:
            above += [joint.name] if joint.type == "continuous" and joint.mimic is None else []
            link = joint.parent
        swivels |= set(above) if joint is None else set()
    mass = sum(link.inertial.mass for link in description.links if link.inertial is not None)
    friction = SWIVEL_FRICTION * GRAVITY * mass / max(len(floor), 1)
    for joint in description.joints:
        loose = joint.name in swivels and joint.friction == 0.0
        yield replace(joint, friction=friction) if loose else joint


def _with_round_wheels(
    links: tuple[Link, ...],
    definition: RobotDefinition,
    description: RobotDescription,
    driven: Mapping[str, Wheel],
) -> tuple[Link, ...]:
    """Return the links with driven wheels as spheres, and other shapes trimmed above the floor."""
    radius = definition.two_wheel.wheel_radius if definition.two_wheel is not None else 0.0
    heights = links_below_floor(definition, description, driven.values())
    poses = forward_kinematics(description)
    return tuple(
        as_sphere(link, driven[link.name], radius)
        if link.name in driven
        else trim(link, poses[link.name], heights[link.name])
        if link.name in heights
        else link
        for link in links
    )


def _edit_link(
    link: Link, disabled: Collection[str], hidden: Collection[str], wheels: Collection[str]
) -> Link:
    if link.name in hidden:
        return replace(link, visuals=(), collisions=())
    if link.name in disabled:
        return replace(link, collisions=())
    if link.name in wheels:
        return replace(link, collisions=tuple(bounding_sphere(shape) for shape in link.collisions))
    return link


def bounding_sphere(collision: Collision) -> Collision:
    """Return a mesh's bounding sphere around the centre of its box; other shapes unchanged."""
    geometry = collision.geometry
    if not isinstance(geometry, Mesh):
        return collision
    points = mesh_points(geometry)
    centre = (points.min(axis=0) + points.max(axis=0)) / 2
    radius = float(np.linalg.norm(points - centre, axis=1).max())
    at = collision.origin.matrix() @ np.append(centre, 1.0)
    position = (float(at[0]), float(at[1]), float(at[2]))
    return replace(collision, geometry=Sphere(radius=radius), origin=Pose(position=position))
