"""Detect wheels from geometry: round links that turn without limits about a level axle and reach the floor.

A wheel whose axle swivels without limits about an upright axis is a caster; nothing drives it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from roboyard.description.geometry import shape_meshes
from roboyard.description.model import Joint, RobotDescription
from roboyard.description.semantic import WheelPair
from roboyard.kinematics.description_poses import chain, forward_kinematics
from roboyard.morphology.bounds import robot_bounds
from roboyard.transforms import Array

MAX_TILT = 0.1
"""Largest sine of the angle between an axle and the floor."""
MIN_ROUNDNESS = 0.9
"""Smallest radius of a wheel across its axle, as a share of its largest; an octagon has 0.92."""
DIRECTIONS = 16
"""Directions around the axle in which the radius is measured."""
MAX_HEIGHT = 0.15
"""Largest height of a wheel's lowest point above the robot's, as a share of the wheel's radius."""
MIN_FORWARD = 0.995
"""Smallest y component of a driven axle's unit axis: the wheel rolls along x within 6 degrees."""
PAIR_TOLERANCE = 0.05
"""Largest difference of the two radii of a pair, and offset of their axles, as a share of the radius."""
MIN_UPRIGHT = 0.9
"""Smallest |z| component of a caster's swivel axis."""


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Wheel:
    """A wheel, all joints at zero, in the root link's frame."""

    joint: Joint
    centre: Array
    """(3,) point on the axle in the middle of the wheel (m)."""
    axis: Array
    """(3,) unit vector along the axle."""
    radius: float
    """m"""
    is_direct: bool
    """Whether no joint moves the axle."""
    is_caster: bool
    """Whether the axle swivels without limits about an upright axis."""

    @property
    def link(self) -> str:
        """Name of the link that rolls."""
        return self.joint.child


def find_wheels(description: RobotDescription) -> tuple[Wheel, ...]:
    """Return the driven wheels, depth first; casters and joints that mimic another are excluded.

    Raises:
        MeshError: a mesh file cannot be read.
    """
    return tuple(wheel for wheel in find_rolling_links(description) if not wheel.is_caster)


def find_rolling_links(description: RobotDescription) -> tuple[Wheel, ...]:
    """Return the driven wheels and the casters, depth first.

    Raises:
        MeshError: a mesh file cannot be read.
    """
    bounds = robot_bounds(description, visual=not any(link.collisions for link in description.links))
    if bounds is None:
        return ()
    frames = forward_kinematics(description)
    found = (
        _wheel(description, joint, frames, float(bounds[0, 2]))
        for joint in description.depth_first_joints
        if joint.mimic is None and _is_endless(joint)
    )
    return tuple(wheel for wheel in found if wheel is not None)


def find_wheel_pair(wheels: Sequence[Wheel]) -> WheelPair | None:
    """Return the pair of a robot that drives by exactly two equal wheels side by side; else None."""
    if len(wheels) != 2 or not all(wheel.is_direct and wheel.axis[1] > MIN_FORWARD for wheel in wheels):
        return None
    right, left = sorted(wheels, key=lambda wheel: float(wheel.centre[1]))
    between = left.centre - right.centre
    length, tolerance = float(between[1]), PAIR_TOLERANCE * left.radius
    if abs(left.radius - right.radius) > tolerance or length < left.radius / 2:
        return None
    if np.hypot(between[0], between[2]) > tolerance:
        return None
    return WheelPair(left=left.joint.name, right=right.joint.name, radius=left.radius, length=length)


def _is_endless(joint: Joint) -> bool:
    """Return whether a joint turns without limits."""
    return joint.type == "continuous" or (joint.type == "revolute" and joint.position_limits() is None)


def _wheel(
    description: RobotDescription, joint: Joint, frames: Mapping[str, Array], floor: float
) -> Wheel | None:
    """Return the wheel that a joint turns; None where its link is not round, not level or above the floor."""
    frame = frames[joint.child]
    axis = frame[:3, :3] @ np.asarray(joint.axis)
    link = description.link_by_name[joint.child]
    meshes = shape_meshes(link.collisions or link.visuals)
    if abs(axis[2]) > MAX_TILT or not meshes:
        return None
    points = np.concatenate([mesh.vertices for mesh in meshes]) @ frame[:3, :3].T
    up = np.array([0.0, 0.0, 1.0]) - axis[2] * axis
    up /= np.linalg.norm(up)
    angle = 2.0 * np.pi * np.arange(DIRECTIONS) / DIRECTIONS
    around = np.outer(np.cos(angle), up) + np.outer(np.sin(angle), np.cross(axis, up))
    radii = (points @ around.T).max(axis=0)
    radius = float(radii.max())
    if radii.min() < MIN_ROUNDNESS * radius or frame[2, 3] - radius > floor + MAX_HEIGHT * radius:
        return None
    above = [joint for joint in chain(description, description.root.name, joint.parent) if joint.is_moving]
    along = points @ axis
    centre = frame[:3, 3] + axis * float(along.min() + along.max()) / 2
    return Wheel(
        joint=joint,
        centre=centre,
        axis=axis,
        radius=radius,
        is_direct=not above,
        is_caster=any(_is_endless(joint) and _is_upright(joint, frames) for joint in above),
    )


def _is_upright(joint: Joint, frames: Mapping[str, Array]) -> bool:
    """Return whether a joint's axis points up or down."""
    return abs(float((frames[joint.child][:3, :3] @ np.asarray(joint.axis))[2])) > MIN_UPRIGHT
