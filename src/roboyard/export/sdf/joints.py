"""Joints of SDF, and Gazebo Sim's plugins that drive them."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from typing import TYPE_CHECKING

import numpy as np

from roboyard.description.model import Joint, JointType, Limit, LoopJoint, Pose
from roboyard.export.definition_blocks import wheel_sides
from roboyard.export.sdf.xml import add, add_pose
from roboyard.transforms import Array

if TYPE_CHECKING:
    from roboyard.description.robot_model import RobotModel

UNLIMITED = 1e16
"""SDF's own value for no limit (rad or m)."""
KINDS = {
    "revolute": "revolute",
    "continuous": "continuous",
    "prismatic": "prismatic",
    "fixed": "fixed",
    "spherical": "ball",
}


def add_joint(model: ET.Element, joint: Joint, leaders: set[str]) -> str:
    """Add a joint at its child's frame; return a note where SDF has no such joint, else an empty text.

    Args:
        model: `<model>`.
        joint: of the tree.
        leaders: names of the joints that others may follow.
    """
    if joint.type not in KINDS:
        return f'joint "{joint.name}": SDF has no {joint.type} joint; its child moves freely'
    made = add(model, "joint", name=joint.name, type=KINDS[joint.type])
    add(made, "parent", joint.parent)
    add(made, "child", joint.child)
    if joint.type in ("fixed", "spherical"):
        return ""
    axis = add(made, "axis")
    add(axis, "xyz", joint.axis)
    if joint.mimic is not None and joint.mimic.joint in leaders:
        follows = add(axis, "mimic", joint=joint.mimic.joint)
        add(follows, "multiplier", joint.mimic.multiplier)
        add(follows, "offset", joint.mimic.offset)
        add(follows, "reference", 0.0)
    limit = joint.limit or Limit()
    lower, upper = joint.position_limits() or (-UNLIMITED, UNLIMITED)
    written = add(axis, "limit")
    add(written, "lower", lower)
    add(written, "upper", upper)
    if limit.effort is not None:
        add(written, "effort", limit.effort)
    if limit.velocity is not None:
        add(written, "velocity", limit.velocity)
    if joint.damping or joint.friction:
        dynamics = add(axis, "dynamics")
        add(dynamics, "damping", joint.damping)
        add(dynamics, "friction", joint.friction)
    return ""


def planar_steps(joint: Joint) -> tuple[Joint, ...]:
    """Return a planar joint as two slides and a turn in a row, with a link of its own between each two."""
    axis = np.asarray(joint.axis, dtype=float)
    start = np.eye(3)[int(np.abs(axis).argmin())]
    first = np.cross(axis, np.cross(start, axis))
    first /= np.linalg.norm(first)
    links = (joint.parent, f"{joint.name}_1_link", f"{joint.name}_2_link", joint.child)
    parts: tuple[tuple[str, JointType, Array], ...]
    parts = (
        (f"{joint.name}_1", "prismatic", first),
        (f"{joint.name}_2", "prismatic", np.cross(axis, first)),
        (joint.name, "continuous", axis),
    )
    return tuple(
        Joint(
            name=name,
            type=kind,
            parent=links[k],
            child=links[k + 1],
            origin=joint.origin if k == 0 else Pose(),
            axis=(float(way[0]), float(way[1]), float(way[2])),
            damping=joint.damping,
            friction=joint.friction,
        )
        for k, (name, kind, way) in enumerate(parts)
    )


def add_loop(model: ET.Element, loop: LoopJoint) -> None:
    """Add a joint that closes a loop, at its frame in the second link."""
    made = add(model, "joint", name=loop.name, type=KINDS[loop.type])
    add_pose(made, loop.second_origin)
    add(made, "parent", loop.first)
    add(made, "child", loop.second)
    if loop.type == "revolute":
        axis = add(made, "axis")
        add(axis, "xyz", loop.axis)
        limit = add(axis, "limit")
        add(limit, "lower", -UNLIMITED)
        add(limit, "upper", UNLIMITED)


def add_plugins(model: ET.Element, robot: RobotModel) -> None:
    """Add Gazebo Sim's plugins: joint states, trajectories of driven joints, differential drive."""
    _plugin(model, "joint-state-publisher", "JointStatePublisher")
    sides = wheel_sides(robot.semantic)
    rolling: set[str] = set()
    if sides is not None:
        left, right = sides
        rolling = {wheel.joint for side in sides for wheel in side}
        drive = _plugin(model, "diff-drive", "DiffDrive")
        for tag, side in (("left_joint", left), ("right_joint", right)):
            for wheel in side:
                add(drive, tag, wheel.joint)
        to_left = np.cross(robot.semantic.up, robot.semantic.forward)
        across = [float(np.mean([np.asarray(w.centre) @ to_left for w in side])) for side in sides]
        add(drive, "wheel_separation", across[0] - across[1])
        add(drive, "wheel_radius", float(np.mean([wheel.radius for wheel in (*left, *right)])))
    driven = [name for name, kind in robot.drives.items() if kind != "none" and name not in rolling]
    known = robot.description.joint_by_name
    driven = [name for name in driven if name in known and known[name].mimic is None]
    if driven:
        control = _plugin(model, "joint-trajectory-controller", "JointTrajectoryController")
        for name in driven:
            add(control, "joint_name", name)


def _plugin(model: ET.Element, library: str, name: str) -> ET.Element:
    return add(model, "plugin", filename=f"gz-sim-{library}-system", name=f"gz::sim::systems::{name}")
