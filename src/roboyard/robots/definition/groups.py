"""Groups of joints with one controller each, from a definition's blocks."""

from __future__ import annotations

from dataclasses import dataclass

from roboyard.robots.definition.schema import RobotDefinition


@dataclass(frozen=True, kw_only=True, slots=True)
class GroupPlan:
    """One group, before it has a controller."""

    name: str
    joints: tuple[str, ...]
    tip: str | None = None
    """End-effector link for inverse kinematics; None for groups without."""
    arm: str | None = None
    """Arm of the group; None for base, trunk and camera."""

    @property
    def kind(self) -> str:
        """Kind of group: base, trunk, camera, arm or gripper."""
        return self.name.split("_", 1)[0] if self.arm is not None else self.name


def plan_groups(definition: RobotDefinition, child_of: dict[str, str]) -> dict[str, GroupPlan]:
    """Return the groups by name, in action order; grippers without fingers are omitted.

    Args:
        definition: of the robot.
        child_of: joint name to its child link.
    """
    found: dict[str, GroupPlan] = {}
    if definition.locomotion is not None:
        found["base"] = GroupPlan(name="base", joints=definition.locomotion.base_joint_names)
    if definition.articulated_trunk is not None:
        joints = definition.articulated_trunk.trunk_joint_names
        found["trunk"] = GroupPlan(name="trunk", joints=joints, tip=child_of[joints[-1]])
    if definition.active_camera is not None:
        found["camera"] = GroupPlan(name="camera", joints=definition.active_camera.camera_joint_names)
    block = definition.manipulation
    for arm in definition.arm_names:
        assert block is not None
        name = f"arm_{arm}"
        found[name] = GroupPlan(
            name=name, joints=block.arm_joint_names[arm], tip=block.eef_link_names[arm], arm=arm
        )
        if block.finger_joint_names.get(arm):
            name = f"gripper_{arm}"
            found[name] = GroupPlan(name=name, joints=block.finger_joint_names[arm], arm=arm)
    return {name: found[name] for name in definition.raw_controller_order if name in found}


def opening_signs(definition: RobotDefinition, plan: GroupPlan) -> tuple[int, ...]:
    """Return for each joint of a gripper 1 or -1, the direction that opens it; 0 for those that do not."""
    block = definition.manipulation
    stated = (block.opening_direction or {}).get(plan.arm or "") if block is not None else None
    if stated is None:
        return (1,) * len(plan.joints)
    if isinstance(stated, str):
        stated = dict.fromkeys(plan.joints, stated)
    signs = {"increasing": 1, "decreasing": -1}
    return tuple(signs.get(stated.get(joint, ""), 0) for joint in plan.joints)
