"""Test that joints which nothing drives do not swing: fingers that should mimic another, loose flaps.

The driven joints follow random actions for two seconds. Wheels and casters, which roll, are not counted.
"""

from __future__ import annotations

import numpy as np

from roboyard.robots import Robot
from roboyard.robots.definition.schema import VIRTUAL_JOINTS
from roboyard.validation.gates.stand import floor_contacts
from roboyard.validation.report import Gate
from roboyard.validation.test_world import TestWorld

SECONDS = 2.0
MAX_SWING = {"prismatic": 0.02, "revolute": 0.2, "continuous": 0.2}
"""Largest motion of a joint that nothing drives, by its type (m, rad)."""


def free_joint_gates(test_world: TestWorld) -> tuple[Gate, ...]:
    """Count the free joints that swing."""
    robot = test_world.robot()
    free = free_joints(robot, test_world)
    title = "No free joint swings"
    if not free:
        skipped = "every joint is driven, follows another or rolls"
        return (
            Gate(name="free_joints", title=title, figure=0.0, threshold=0.0, unit="joints", skipped=skipped),
        )
    rows = robot.joint_arrays.indices_of(free)
    start = robot.joint_positions[rows]
    swing = np.zeros(len(free))
    rng = np.random.default_rng(test_world.seed)
    space = robot.action_space
    low, high = np.maximum(space.low, -1.0), np.minimum(space.high, 1.0)
    for _ in range(round(SECONDS * robot.control_freq)):
        if robot.action_dim:
            robot.apply_action(rng.uniform(low, high))
        robot.world.step(robot.steps_per_control)
        swing = np.maximum(swing, np.abs(robot.joint_positions[rows] - start))
    joints = robot.description.joint_by_name
    found = [
        f"joint {name!r} swings freely by {by:.2g} {'m' if joints[name].type == 'prismatic' else 'rad'}; it "
        "mimics nothing and has no drive"
        for name, by in sorted(zip(free, swing, strict=True), key=lambda pair: -pair[1])
        if not by <= MAX_SWING.get(joints[name].type, MAX_SWING["revolute"])
    ]
    return (
        Gate(
            name="free_joints",
            title=title,
            figure=float(len(found)),
            threshold=0.0,
            unit="joints",
            detail=f"{len(free)} joints without drive or leader, {SECONDS:g} s of random actions",
            findings=found,
            advice='a <mimic joint="..."/> element in the URDF, a group for the joint, or <dynamics '
            'damping="..."/>',
        ),
    )


def free_joints(robot: Robot, test_world: TestWorld) -> list[str]:
    """Return the joints that no group drives, no leader moves and no limit holds, except those that roll or
    guide the base.
    """
    understood = test_world.understood
    rolling = {*understood.get("caster_joints", ()), *understood.get("drive_wheels", ())}
    above = robot.description.parent_joint
    rolling |= {above[link].name for link in floor_contacts(robot) if link in above}
    on_floor = robot.locomotion.floor_touching_links if robot.locomotion is not None else ()
    rolling |= {robot.description.parent_joint[link.name].name for link in on_floor if link.index}
    rolling |= {*robot.guide_joints}
    driven = {name for group in robot.groups.values() for name in group.joints}
    found = []
    for name in robot.joint_names:
        joint = robot.description.joint_by_name[name]
        leader = None if joint.mimic is None else joint.mimic.joint
        follows = leader is not None and leader != name and leader in robot.joint_names
        held = joint.mimic is None and joint.position_limits() is not None
        if name not in driven | rolling and name not in VIRTUAL_JOINTS and not follows and not held:
            found.append(name)
    return found
