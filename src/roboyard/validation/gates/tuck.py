"""Test the tucked and untucked postures: no self-collision, and no motion away from them."""

from __future__ import annotations

import numpy as np

from roboyard.robots.definition.postures import ResetMode
from roboyard.validation.gates.weak_joints import because_weak
from roboyard.validation.report import Gate
from roboyard.validation.test_world import TestWorld, own_contacts

SECONDS = 1.0
"""Duration of the test in each posture (s)."""
OVERLAP = 2e-4
"""Penetration of two links that counts as a self-collision (m)."""
MAX_MOTION = 0.05
"""Distance that a joint may move away from the posture (rad or m)."""


def tuck_gates(test_world: TestWorld) -> tuple[Gate, ...]:
    """Measure the largest motion away from either posture."""
    if test_world.definition.mobile_manipulation is None:
        return (
            Gate(
                name="tuck",
                title="The robot stays in its tucked and untucked postures",
                figure=0.0,
                threshold=MAX_MOTION,
                unit="rad or m",
                skipped="the definition has no mobile_manipulation block",
            ),
        )
    robot = test_world.robot()
    assert robot.mobile_manipulation is not None
    findings, worst = [], 0.0
    modes: tuple[ResetMode, ...] = ("tuck", "untuck")
    for mode in modes:
        robot.reset()
        robot.tuck() if mode == "tuck" else robot.untuck()
        posture = robot.joint_positions
        weak = {name: because_weak(robot, name) for name in robot.joint_names}
        overlaps = [pair for pair in own_contacts(robot.world, robot.body) if pair[2] > OVERLAP]
        findings += [f"{mode}ed: {a} and {b} overlap by {depth * 1e3:.1f} mm" for a, b, depth in overlaps]
        robot.world.step(round(SECONDS / robot.world.timestep))
        held = [i for g in robot.groups.values() if g.kind not in ("base", "gripper") for i in g.indices]
        away = np.abs(robot.joint_positions - posture)[held]
        if len(away) and away.max() > MAX_MOTION:
            name = robot.joint_names[held[int(away.argmax())]]
            findings.append(f"{mode}ed: {name} moved by {away.max():.3g}{weak[name]}")
        worst = max(worst, float(away.max(initial=0.0)), MAX_MOTION * 2 if overlaps else 0.0)
    return (
        Gate(
            name="tuck",
            title="The robot stays in its tucked and untucked postures",
            figure=worst,
            threshold=MAX_MOTION,
            unit="rad or m",
            detail=f"motion of arms, torso and head in {SECONDS:g} s in each posture; a self-collision fails",
            findings=findings,
            advice="tucked_default_joint_pos and untucked_default_joint_pos, the order of their joints, and "
            "disabled_collision_pairs",
        ),
    )
