"""Planning groups of a robot."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    from roboyard.description.model import Joint
    from roboyard.description.robot_model import RobotModel

GroupKind = Literal["arm", "gripper", "body"]


@dataclass(frozen=True, kw_only=True, slots=True)
class Group:
    """Joints that are planned together."""

    name: str
    kind: GroupKind
    joints: tuple[str, ...]
    """Driven ones, base first; mimic joints follow."""
    chain: tuple[str, str] | None = None
    """First and last link of an arm."""
    arm: str | None = None
    """Group of the arm that carries a gripper."""
    mount: str | None = None
    """Link of that arm to which the gripper is fixed."""

    @property
    def controller(self) -> str:
        """Name of the group's controller."""
        return f"{self.name}_controller"


def groups_of(robot: RobotModel) -> tuple[Group, ...]:
    """Return the groups of a robot: arms with grippers, other grippers, trunk, head, legs."""
    semantic, joints = robot.semantic, robot.description.joint_by_name
    groups: list[Group] = []
    several = len(semantic.arms) > 1
    known: set[str] = set()
    for arm in semantic.arms:
        own = _moving(arm.joints, joints)
        name = f"{arm.name}_arm" if several or not arm.name.isdigit() else "arm"
        end = arm.end_effector
        if own:
            chain = (joints[own[0]].parent, end.link)
            groups.append(Group(name=name, kind="arm", joints=own, chain=chain))
        fingers = _moving(end.gripper_joints, joints)
        if fingers:
            known |= set(fingers)
            groups.append(
                Group(
                    name=name.replace("arm", "gripper"),
                    kind="gripper",
                    joints=fingers,
                    arm=name if own else None,
                    mount=end.gripper.palm if end.gripper is not None else joints[fingers[0]].parent,
                )
            )
    for number, gripper in enumerate(semantic.grippers, start=1):
        fingers = _moving(gripper.joints, joints)
        if fingers and not known & set(fingers):
            groups.append(Group(name=f"gripper_{number}", kind="gripper", joints=fingers, mount=gripper.palm))
    bodies = {"trunk": semantic.trunk_joints, "head": semantic.head_joints}
    bodies |= {f"{leg.name}_leg": leg.joints for leg in semantic.legs}
    for name, listed in bodies.items():
        own = _moving(listed, joints)
        if own:
            groups.append(Group(name=name, kind="body", joints=own))
    return tuple(groups)


def _moving(names: tuple[str, ...], joints: Mapping[str, Joint]) -> tuple[str, ...]:
    """Return the joints that a motor can move."""
    return tuple(
        name for name in names if name in joints and joints[name].is_moving and joints[name].mimic is None
    )
