"""Small robots for the simulator's tests, made in memory."""

from __future__ import annotations

import numpy as np

from roboyard.description.model import (
    Box,
    Collision,
    Inertial,
    Joint,
    Limit,
    Link,
    Mimic,
    Pose,
    RobotDescription,
)


def rod(name: str, mass: float = 1.0, length: float = 1.0, **extra) -> Link:
    """A thin rod along -z, hanging from its frame."""
    moment = mass * length**2 / 12
    return Link(
        name=name,
        inertial=Inertial(
            mass=mass, origin=Pose(position=(0, 0, -length / 2)), inertia=(moment, 0, 0, moment, 0, 1e-4)
        ),
        **extra,
    )


def pendulum(**joint) -> RobotDescription:
    """One rod on a hinge about y."""
    return RobotDescription(
        name="pendulum",
        links=(Link(name="base"), rod("rod")),
        joints=(Joint(name="hinge", type="continuous", parent="base", child="rod", axis=(0, 1, 0), **joint),),
    )


def arm(limit: Limit | None = None) -> RobotDescription:
    """Two rods on hinges and a gripper of two fingers, the second of which mimics the first."""
    limit = limit or Limit(lower=-2.0, upper=2.0, effort=100.0, velocity=5.0)
    stroke = Limit(lower=0.0, upper=0.05, effort=20.0, velocity=1.0)
    return RobotDescription(
        name="arm",
        links=(
            Link(name="base"),
            rod("upper"),
            rod("lower", collisions=(Collision(geometry=Box(size=(0.05, 0.05, 0.9))),)),
            rod("left", 0.1, 0.1),
            rod("right", 0.1, 0.1),
        ),
        joints=(
            Joint(
                name="shoulder", type="revolute", parent="base", child="upper", axis=(0, 1, 0), limit=limit
            ),
            Joint(
                name="elbow",
                type="revolute",
                parent="upper",
                child="lower",
                origin=Pose(position=(0, 0, -1)),
                axis=(0, 1, 0),
                limit=limit,
            ),
            Joint(
                name="left_finger",
                type="prismatic",
                parent="lower",
                child="left",
                origin=Pose(position=(0, 0, -1)),
                axis=(0, 1, 0),
                limit=stroke,
            ),
            Joint(
                name="right_finger",
                type="prismatic",
                parent="lower",
                child="right",
                origin=Pose(position=(0, 0, -1)),
                axis=(0, -1, 0),
                limit=stroke,
                mimic=Mimic(joint="left_finger"),
            ),
        ),
    )


def loose(name: str, inertial: Inertial | None) -> RobotDescription:
    """One link with a box shape and the given inertial."""
    return RobotDescription(
        name=name,
        links=(
            Link(name="base", inertial=inertial, collisions=(Collision(geometry=Box(size=(0.2, 0.2, 0.2))),)),
        ),
    )


def angle_between(a: np.ndarray, b: np.ndarray) -> float:
    """rad between two quaternions."""
    return 2 * float(np.arccos(np.clip(abs(np.dot(a, b)), 0, 1)))
