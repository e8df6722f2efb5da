"""Wheels of a robot that nobody described: round links that turn without end about a level axle, down to the
floor. What swivels about an upright axle is a caster, which the robot does not drive by.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from roboyard.description.model import Joint, RobotDescription
from roboyard.kinematics.description_poses import chain, forward_kinematics
from roboyard.morphology.shape_geometry import robot_bounds, shape_meshes
from roboyard.transforms import Array

LEVEL = 0.1
"""Sine of the most that an axle leans."""
ROUND = 0.9
"""Least reach of a wheel square to its axle, of its largest: that of an octagon."""
DIRECTIONS = 16
ABOVE_FLOOR = 0.15
"""Of its radius: how far a wheel may end above the robot's lowest point."""
AHEAD = 0.995
"""Least share of the y axis in an axle's direction: it rolls the robot along x within 6 degrees."""
ALIKE = 0.05
"""Of the radius: how far the two wheels of an axle may differ, and lie beside one line."""


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Wheel:
    """A wheel, joints at zero, in the root link's frame; m."""

    joint: Joint
    centre: Array
    """(3,) on the axle, in the middle of the wheel."""
    axis: Array
    """(3,) unit."""
    radius: float
    is_direct: bool
    """No joint moves its axle."""

    @property
    def link(self) -> str:
        """The link that rolls."""
        return self.joint.child


@dataclass(frozen=True, kw_only=True, slots=True)
class WheelPair:
    """Two wheels to drive by: both roll the robot along +x when they turn forwards."""

    left: str
    """Joint."""
    right: str
    """Joint."""
    radius: float
    """m"""
    length: float
    """m between the wheels."""


def find_wheels(description: RobotDescription) -> tuple[Wheel, ...]:
    """Driven wheels, depth first; joints that mimic another and casters are none.

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
    """The axle of a robot that drives by just two wheels, side by side and alike; else None."""
    if len(wheels) != 2 or not all(wheel.is_direct and wheel.axis[1] > AHEAD for wheel in wheels):
        return None
    right, left = sorted(wheels, key=lambda wheel: float(wheel.centre[1]))
    between = left.centre - right.centre
    length, tolerance = float(between[1]), ALIKE * left.radius
    if abs(left.radius - right.radius) > tolerance or length < left.radius / 2:
        return None
    if np.hypot(between[0], between[2]) > tolerance:
        return None
    return WheelPair(left=left.joint.name, right=right.joint.name, radius=left.radius, length=length)


def _is_endless(joint: Joint) -> bool:
    return joint.type == "continuous" or (joint.type == "revolute" and joint.position_limits() is None)


def _wheel(
    description: RobotDescription, joint: Joint, frames: Mapping[str, Array], floor: float
) -> Wheel | None:
    frame = frames[joint.child]
    axis = frame[:3, :3] @ np.asarray(joint.axis)
    link = description.link_by_name[joint.child]
    meshes = shape_meshes(link.collisions or link.visuals)
    if abs(axis[2]) > LEVEL or not meshes:
        return None
    points = np.concatenate([mesh.vertices for mesh in meshes]) @ frame[:3, :3].T
    up = np.array([0.0, 0.0, 1.0]) - axis[2] * axis
    up /= np.linalg.norm(up)
    angle = 2.0 * np.pi * np.arange(DIRECTIONS) / DIRECTIONS
    around = np.outer(np.cos(angle), up) + np.outer(np.sin(angle), np.cross(axis, up))
    reach = (points @ around.T).max(axis=0)
    radius = float(reach.max())
    if reach.min() < ROUND * radius or frame[2, 3] - radius > floor + ABOVE_FLOOR * radius:
        return None
    way = [before for before in chain(description, description.root.name, joint.parent) if before.is_moving]
    if any(_is_endless(before) and _is_upright(before, frames) for before in way):
        return None
    along = points @ axis
    centre = frame[:3, 3] + axis * float(along.min() + along.max()) / 2
    return Wheel(joint=joint, centre=centre, axis=axis, radius=radius, is_direct=not way)


def _is_upright(joint: Joint, frames: Mapping[str, Array]) -> bool:
    return abs(float((frames[joint.child][:3, :3] @ np.asarray(joint.axis))[2])) > 0.9
