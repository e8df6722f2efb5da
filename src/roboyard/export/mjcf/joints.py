"""Joints of a link, and the actuators that drive them."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from roboyard.description.mass_properties import link_masses, trace_mass
from roboyard.description.model import Joint, RobotDescription
from roboyard.export.geometry import zero_poses
from roboyard.export.mjcf.xml import add
from roboyard.kinematics.joint_models import plane_axes
from roboyard.transforms import matrix_from_quaternion

if TYPE_CHECKING:
    from roboyard.description.robot_model import RobotModel

INFINITE = 1e6
"""rad, m and their like: a limit beyond this is none."""
LOCKED_HALF_RANGE = 1e-9
"""rad or m: MuJoCo asks for a range that is not empty."""
BANDWIDTH = 40.0
"""rad/s: how fast a position drive settles, critically damped, when it moves its inertia at zero alone."""


def add_joint(body: ET.Element, joint: Joint) -> tuple[str, ...]:
    """Add what a joint is in MuJoCo; returns the names."""
    common: dict[str, Any] = {
        "damping": joint.damping if joint.damping > 0 else None,
        "frictionloss": joint.friction if joint.friction > 0 else None,
    }
    match joint.type:
        case "fixed":
            return ()
        case "revolute" | "continuous" | "prismatic":
            kind = "slide" if joint.type == "prismatic" else "hinge"
            add(body, "joint", name=joint.name, type=kind, axis=joint.axis, range=_range(joint), **common)
            return (joint.name,)
        case "spherical":
            add(body, "joint", name=joint.name, type="ball", **common)
            return (joint.name,)
        case "planar":
            axes = [("x", "slide"), ("y", "slide"), ("r", "hinge")]
            vectors = (*plane_axes(joint.axis), joint.axis)
        case "floating":
            axes = [("x", "slide"), ("y", "slide"), ("z", "slide"), ("r", "ball")]
            vectors = (*np.eye(3), None)
    names = []
    for (letter, kind), axis in zip(axes, vectors, strict=True):
        names.append(f"{joint.name}_{letter}")
        add(body, "joint", name=names[-1], type=kind, axis=axis, **common)
    return tuple(names)


def _range(joint: Joint) -> tuple[float, float] | None:
    limits = joint.position_limits()
    if limits is None or max(map(abs, limits)) >= INFINITE:
        return None
    lower, upper = limits
    if upper - lower < 2 * LOCKED_HALF_RANGE:
        middle = (lower + upper) / 2
        return (middle - LOCKED_HALF_RANGE, middle + LOCKED_HALF_RANGE)
    return (lower, upper)


def add_actuators(parent: ET.Element, robot: RobotModel) -> tuple[str, ...]:
    """Add an actuator for every driven joint, named like the joint; returns the names in order."""
    description = robot.description
    inertia = moved_inertia(description)
    added = []
    for joint in description.depth_first_joints:
        kind = robot.drives.get(joint.name, "none")
        if kind == "none" or joint.mimic is not None:
            continue
        if joint.type not in ("revolute", "continuous", "prismatic"):
            continue
        moved = inertia[joint.name]
        common: dict[str, Any] = {"name": joint.name, "joint": joint.name}
        effort = _positive(joint.limit.effort if joint.limit else None)
        force = None if effort is None else (-effort, effort)
        if kind == "position":
            gains = {"kp": _rounded(moved * BANDWIDTH**2), "kv": _rounded(2 * moved * BANDWIDTH)}
            add(parent, "position", **common, ctrlrange=_range(joint), forcerange=force, **gains)
        elif kind == "velocity":
            speed = _positive(joint.limit.velocity if joint.limit else None)
            command = None if speed is None else (-speed, speed)
            gain = _rounded(moved * BANDWIDTH)
            add(parent, "velocity", **common, ctrlrange=command, forcerange=force, kv=gain)
        else:
            add(parent, "motor", **common, ctrlrange=force)
        added.append(joint.name)
    return tuple(added)


def _positive(limit: float | None) -> float | None:
    """A limit that limits: zero, a common export error, and enormous values count as none."""
    return limit if limit is not None and 0 < limit < INFINITE else None


def _rounded(value: float) -> float:
    return float(f"{value:.4g}")


def moved_inertia(description: RobotDescription) -> Mapping[str, float]:
    """Return the inertia that each single-DOF joint accelerates at zero, all joints beyond it fixed.

    Returns:
        Joint name to the moment about its axis (kg m²), or to the mass (kg) for prismatic joints.
    """
    poses, masses = zero_poses(description), link_masses(description)
    trace = trace_mass(description, masses)
    mass: dict[str, float] = {}
    first: dict[str, np.ndarray] = {}
    second: dict[str, np.ndarray] = {}
    for link in description.links:
        found = masses[link.name] or trace
        turn = poses[link.name][:3, :3]
        centre = poses[link.name][:3, 3] + turn @ found.position
        axes = turn @ matrix_from_quaternion(found.quaternion)
        mass[link.name] = found.mass
        first[link.name] = found.mass * centre
        second[link.name] = axes @ np.diag(found.principal) @ axes.T + _parallel(found.mass, centre)
    for joint in reversed(description.depth_first_joints):
        mass[joint.parent] += mass[joint.child]
        first[joint.parent] = first[joint.parent] + first[joint.child]
        second[joint.parent] = second[joint.parent] + second[joint.child]
    moved = {}
    for joint in description.joints:
        child = joint.child
        if joint.type == "prismatic":
            moved[joint.name] = mass[child]
        elif joint.type in ("revolute", "continuous"):
            at = poses[child][:3, 3]
            axis = poses[child][:3, :3] @ np.asarray(joint.axis)
            mixed = (
                np.dot(first[child], at) * np.eye(3)
                - (np.outer(first[child], at) + np.outer(at, first[child])) / 2
            )
            about = second[child] - 2 * mixed + _parallel(mass[child], at)
            moved[joint.name] = max(float(axis @ about @ axis), 1e-9)
    return moved


def _parallel(mass: float, at: np.ndarray) -> np.ndarray:
    return mass * (np.dot(at, at) * np.eye(3) - np.outer(at, at))
