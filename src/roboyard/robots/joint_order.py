"""The order of a robot's joint vectors: level by level from the root, children in file order.

Definition files hold their postures in this order (it is PhysX's), so `Robot` uses it too. `Body` goes depth
first; `Robot.joint_names` says which joint each entry is.
"""

from __future__ import annotations

from roboyard.description.model import RobotDescription
from roboyard.kinematics.joint_order import breadth_first_joints, planned_joints


def robot_joint_names(description: RobotDescription) -> tuple[str, ...]:
    """Names of the joints of one degree of freedom, level by level."""
    return tuple(joint.name for joint in planned_joints(breadth_first_joints(description)))
