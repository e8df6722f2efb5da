"""The orders in which joint values are written. Files carry the joint names beside every vector."""

from __future__ import annotations

from roboyard.description.model import Joint, RobotDescription
from roboyard.kinematics.joint_order import ONE_NUMBER


def depth_first_links(description: RobotDescription) -> tuple[str, ...]:
    """Link names from the root, each followed by all that hangs from it, children in file order."""
    return (description.root.name, *(joint.child for joint in description.depth_first_joints))


def prim_order_joints(description: RobotDescription) -> tuple[Joint, ...]:
    """All joints in the order of their prims on a stage: link by link depth first, each with its own joints.

    Sibling joints stand together, which plain depth-first order does not do. cuRobo files use this order.
    """
    return tuple(joint for link in depth_first_links(description) for joint in description.child_joints[link])


def scalar_joints(joints: tuple[Joint, ...]) -> tuple[Joint, ...]:
    """Those that move by one number of their own: no fixed, planar, ball, floating or mimicking joints."""
    return tuple(joint for joint in joints if joint.type in ONE_NUMBER and joint.mimic is None)
