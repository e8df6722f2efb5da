"""Semantics of a robot, as SRDF holds them beside a URDF: base, wheels, groups, end effectors, postures.

`roboyard.morphology` infers it from geometry, a source configuration overrides it, and `roboyard.export`
translates it into other programs' files.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

BaseKind = Literal["none", "wheeled", "differential", "holonomic"]
"""How the base moves: not by itself (fixed or legged), by wheels driven one by one, by two wheels side by
side, or along x and y and about z by virtual joints.
"""
REST = "rest"
"""Name of the rest posture."""


@dataclass(frozen=True, kw_only=True, slots=True)
class EndEffector:
    """An end-effector link and the gripper that belongs to it."""

    link: str
    """Name of the link whose frame is moved to a target."""
    gripper_links: tuple[str, ...] = ()
    """Links that touch a grasped object."""
    gripper_joints: tuple[str, ...] = ()
    """Joints that open and close the gripper."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Arm:
    """A chain of joints that moves one end effector."""

    name: str
    """`left` or `right` where the end effector's name says so, else a number."""
    joints: tuple[str, ...]
    """From the base outwards, without those of the trunk and of the gripper."""
    end_effector: EndEffector


@dataclass(frozen=True, kw_only=True, slots=True)
class WheelPair:
    """Two equal wheels side by side; both roll the robot along +x when their joints turn forwards."""

    left: str
    """Joint name."""
    right: str
    """Joint name."""
    radius: float
    """m"""
    length: float
    """Distance between the two wheels (m)."""


@dataclass(frozen=True, kw_only=True, slots=True)
class SemanticDescription:
    """Base, wheels, groups, end effectors, disabled collision pairs and named postures of a robot."""

    base_link: str
    """The link that counts as the base: the root, or the first link below the virtual joints."""
    base: BaseKind = "none"
    base_joints: tuple[str, ...] = ()
    """Joints that move the base: driven virtual joints, or those of the wheels."""
    virtual_joints: tuple[str, ...] = ()
    """Joints that represent the motion of the base, root first; they move no mechanical part."""
    wheel_links: tuple[str, ...] = ()
    """Links that roll on the floor and are driven."""
    caster_links: tuple[str, ...] = ()
    """Links that roll on the floor and swivel about an upright axis; nothing drives them."""
    wheel_pair: WheelPair | None = None
    """The two wheels of a differential drive."""
    trunk_joints: tuple[str, ...] = ()
    """Joints below the base that move all arms."""
    end_effectors: tuple[EndEffector, ...] = ()
    """In the configuration's order, else depth first."""
    arms: tuple[Arm, ...] = ()
    """In order of their names."""
    disabled_collision_pairs: tuple[tuple[str, str], ...] = ()
    """Links whose collision shapes overlap at rest though no joint connects them."""
    postures: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    """Name to joint positions by joint name (rad or m); see `REST`."""

    @property
    def rest(self) -> Mapping[str, float]:
        """Joint name to its position in the rest posture (rad or m); empty where none is known."""
        return self.postures.get(REST, {})

    @property
    def groups(self) -> dict[str, tuple[str, ...]]:
        """Group name to its joints: base, trunk, then each arm (also one without joints) and its gripper."""
        groups = {"base": self.base_joints, "trunk": self.trunk_joints}
        groups = {name: joints for name, joints in groups.items() if joints}
        for arm in self.arms:
            groups[f"arm_{arm.name}"] = arm.joints
            if arm.end_effector.gripper_joints:
                groups[f"gripper_{arm.name}"] = arm.end_effector.gripper_joints
        return groups
