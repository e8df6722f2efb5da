"""Test that a robot of its kind has the base, arms, grippers and actions that a user expects."""

from __future__ import annotations

from collections.abc import Iterator

from roboyard.robots import Robot
from roboyard.validation.gates.weak_joints import because_undriven
from roboyard.validation.report import Gate
from roboyard.validation.test_world import TestWorld

MOVING_BASES = ("wheeled", "differential", "holonomic", "ackermann", "legged")
"""Kinds of bases that move by themselves, and so need a group `base`."""
WITH_BASE = ("mobile_manipulator", "mobile_base", "vehicle", "quadruped", "biped")
ARMS_OF = {"fixed_arm": 1, "dual_arm": 2, "mobile_manipulator": 1, "humanoid": 2}
"""Kind to its smallest number of arms."""
WITH_GRIPPER = ("mobile_manipulator", "hand", "gripper")
WITHOUT_ACTIONS = ("object", "drone")


def complete_gates(test_world: TestWorld) -> tuple[Gate, ...]:
    """Count the parts that a robot of this kind lacks."""
    understood = test_world.understood
    title = "The robot has the parts of its kind"
    if not understood:
        skipped = "nothing states what kind of robot it is"
        return (Gate(name="complete", title=title, figure=0.0, threshold=0.0, unit="parts", skipped=skipped),)
    robot = test_world.robot()
    kind = str(understood.get("kind", "other"))
    missing = list(_missing(robot, kind, test_world))
    warnings = []
    if kind in WITH_GRIPPER and not any(group.startswith("gripper_") for group in robot.groups):
        text = f"a robot of kind {kind!r} usually has a gripper; none is driven by a group of its own"
        warnings.append(f"{text}; set curobo.eef_to_gripper_info where it has one")
    return (
        Gate(
            name="complete",
            title=title,
            figure=float(len(missing)),
            threshold=0.0,
            unit="parts",
            detail=f"kind {kind!r} on a base {understood.get('base', 'none')!r}; groups: "
            f"{', '.join(robot.groups) or 'none'}",
            findings=missing,
            warnings=warnings,
            advice="understanding.json has the reasons; base_motion.wheel_joints and "
            "curobo.eef_to_gripper_info of the source configuration state base, arms and grippers",
        ),
    )


def _is_bolted(robot: Robot) -> bool:
    """Return whether a base neither floats nor moves by joints between it and the world."""
    return robot.body.is_fixed and robot.definition.holonomic_base is None and not robot.guide_joints


def _missing(robot: Robot, kind: str, test_world: TestWorld) -> Iterator[str]:
    """Yield each missing part with its remedy."""
    understood, groups = test_world.understood, robot.groups
    base = understood.get("base", "none")
    if "base" not in groups and (kind in WITH_BASE or base in MOVING_BASES):
        yield f"no group moves the base, although it is {base!r}: it stands where it is put"
    elif base in MOVING_BASES and _is_bolted(robot):
        yield f"the base is {base!r} but fixed to the world, so that its wheels or legs turn in place"
    wanted = ARMS_OF.get(kind, 0)
    if len(robot.arms) < wanted:
        joints = [name for names in understood.get("arms", {}).values() for name in names]
        yield f"{len(robot.arms)} of {wanted} arms are in the definition" + because_undriven(robot, joints)
    for arm, joints in understood.get("arms", {}).items():
        if arm not in robot.arms:
            yield f"arm {arm!r} has no group arm_{arm}" + because_undriven(robot, joints)
    for arm, joints in understood.get("grippers", {}).items():
        driven = {name for group in groups.values() for name in group.joints}
        lost = [joint for joint in joints if joint in robot.joint_names and joint not in driven]
        if lost:
            yield f"gripper {arm!r}: joint {lost[0]!r} is in no group, so that it cannot be closed"
    free = set(robot.joint_names) - set(understood.get("caster_joints", ()))
    if free and not robot.action_dim and kind not in WITHOUT_ACTIONS:
        yield f"it has {len(free)} joints and no action drives any of them"
