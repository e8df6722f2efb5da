"""Casters that a file omits, of a robot on two driven wheels.

Some vendors draw two wheels under a chassis and no caster. Such a robot rocks on its axle and drags its
chassis. Where neither the wheels nor the links that the definition lists carry the centre of mass, four
frictionless spheres under the front and the rear of the chassis do, as casters would.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import replace

import numpy as np

from roboyard.description.model import Collision, Joint, Link, Pose, RobotDescription, Sphere
from roboyard.kinematics.description_poses import forward_kinematics
from roboyard.robots.definition.schema import RobotDefinition
from roboyard.robots.stability.ground_clearance import centre_of_mass, is_inside, placed, rigid_links
from roboyard.robots.stability.wheels import driven_wheels, to_left
from roboyard.transforms import Array

ASSUMED_CASTERS = "assumed_casters"
"""Name of the link that the spheres belong to."""
RADIUS = 0.3
"""Radius of the spheres, as a share of the wheels'."""
AT_END, AT_SIDE = 0.9, 0.6
"""Place of the spheres: shares of the chassis' length from the axle, and of half the track."""
NEAR, SMALL = 0.01, 3.0
"""Distance to the floor (m) and size, in radii of the wheels, of a fixed link that is a caster."""
LEAST_LENGTH = 0.5
"""Smallest distance of the spheres from the axle, as a share of the wheels' radius."""


def with_casters(
    definition: RobotDefinition, description: RobotDescription
) -> tuple[RobotDefinition, RobotDescription]:
    """Return definition and description with casters where two wheels alone do not carry the robot; both
    unchanged for all others.
    """
    wheels = list(driven_wheels(definition, description).values())
    left = to_left(definition, description)
    two_wheel, locomotion = definition.two_wheel, definition.locomotion
    if len(wheels) != 2 or left is None or two_wheel is None or locomotion is None or abs(left[2]) > 0.3:
        return definition, description
    if ASSUMED_CASTERS in description.link_by_name:
        return definition, description
    poses = forward_kinematics(description)
    hubs = np.array(
        [(poses[w.link] @ np.append(np.asarray(w.joint.axis) * w.centre, 1.0))[:3] for w in wheels]
    )
    floor = float(hubs[:, 2].min()) - two_wheel.wheel_radius
    centre = centre_of_mass(description, poses)
    contacts = list(hubs)
    driven = {wheel.link for wheel in wheels}
    if _has_fixed_caster(description, poses, floor, two_wheel.wheel_radius, driven):
        return definition, description
    for name in locomotion.floor_touching_base_link_names:
        if name not in driven:
            shapes = placed(description.link_by_name[name].collisions, poses[name])
            contacts += [points[points[:, 2].argmin()] for points in shapes]
    if not np.isfinite(centre).all() or is_inside(np.array(contacts)[:, :2], centre[:2]):
        return definition, description
    forward = np.cross(left, (0.0, 0.0, 1.0))
    forward = forward / np.linalg.norm(forward)
    middle = hubs.mean(axis=0)
    chassis = [
        points
        for name in rigid_links(description)
        if name not in driven
        for points in placed(
            description.link_by_name[name].collisions or description.link_by_name[name].visuals, poses[name]
        )
    ]
    if not chassis:
        return definition, description
    points = np.concatenate(chassis)
    low = points[points[:, 2] < floor + 4.0 * two_wheel.wheel_radius]
    along = ((low if len(low) else points) - middle) @ forward
    least = LEAST_LENGTH * two_wheel.wheel_radius
    weight = float((centre - middle) @ forward)
    front = max(AT_END * float(along.max()), least, weight + least)
    rear = min(AT_END * float(along.min()), -least, weight - least)
    radius = RADIUS * two_wheel.wheel_radius
    across = AT_SIDE * float(abs((hubs[0] - hubs[1]) @ left)) / 2
    shapes = tuple(
        _sphere(radius, middle + reach * forward + side * across * left, floor)
        for reach in (front, rear)
        for side in (1.0, -1.0)
    )
    description = replace(
        description,
        links=(*description.links, Link(name=ASSUMED_CASTERS, collisions=shapes)),
        joints=(
            *description.joints,
            Joint(
                name=f"{ASSUMED_CASTERS}_joint",
                type="fixed",
                parent=description.root.name,
                child=ASSUMED_CASTERS,
            ),
        ),
    )
    names = (*locomotion.floor_touching_base_link_names, ASSUMED_CASTERS)
    block = locomotion.model_copy(update={"floor_touching_base_link_names": names})
    return definition.model_copy(update={"locomotion": block}), description


def _has_fixed_caster(
    description: RobotDescription,
    poses: Mapping[str, Array],
    floor: float,
    radius: float,
    driven: Collection[str],
) -> bool:
    """Return whether a small link that is fixed to the root reaches the floor; `floor` and `radius` in m."""
    for name in rigid_links(description):
        shapes = placed(description.link_by_name[name].collisions, poses[name])
        if name in driven or not shapes:
            continue
        points = np.concatenate(shapes)
        if points[:, 2].min() < floor + NEAR and np.ptp(points[:, :2], axis=0).max() < SMALL * radius:
            return True
    return False


def _sphere(radius: float, place: Array, floor: float) -> Collision:
    """Return a sphere that stands on the floor below a (3,) point of the root link's frame (m)."""
    position = (float(place[0]), float(place[1]), floor + radius)
    return Collision(geometry=Sphere(radius=radius), origin=Pose(position=position))
