"""Meanings of the numbers of an action: joints, end effectors, grippers and bases."""

from __future__ import annotations

from roboyard.envs.actions.action import Action, BoundAction, Place
from roboyard.envs.actions.base_actions import BaseTwist
from roboyard.envs.actions.gripper_actions import GripperOpening
from roboyard.envs.actions.joint_actions import JointDelta, JointTarget, JointVelocity
from roboyard.envs.actions.tip_actions import TipDelta

__all__ = [
    "Action",
    "BaseTwist",
    "BoundAction",
    "GripperOpening",
    "JointDelta",
    "JointTarget",
    "JointVelocity",
    "Place",
    "TipDelta",
]
