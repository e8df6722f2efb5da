"""Can the robot be tucked and untucked: no overlap in either posture, and it stays in it?"""

from __future__ import annotations

import numpy as np

from roboyard.robots.definition.postures import ResetMode
from roboyard.validation.report import Gate
from roboyard.validation.test_world import TestWorld, own_contacts

SECONDS = 1.0
OVERLAP = 2e-4
"""m"""
STAYS = 0.05
"""rad or m: how far a joint may move away from the posture"""


def tuck(bench: TestWorld) -> tuple[Gate, ...]:
    """Largest motion away from either posture."""
    if bench.definition.mobile_manipulation is None:
        return (
            Gate(
                name="tuck",
                title="Tucked and untucked postures hold",
                figure=0.0,
                threshold=STAYS,
                unit="rad or m",
                skipped="the definition has no mobile_manipulation",
            ),
        )
    robot = bench.robot()
    assert robot.mobile_manipulation is not None
    findings, worst = [], 0.0
    modes: tuple[ResetMode, ...] = ("tuck", "untuck")
    for mode in modes:
        robot.reset()
        robot.tuck() if mode == "tuck" else robot.untuck()
        wanted = robot.joint_arrays.q
        overlaps = [pair for pair in own_contacts(robot) if pair[2] > OVERLAP]
        findings += [f"{mode}ed: {a} and {b} overlap by {depth * 1e3:.1f} mm" for a, b, depth in overlaps]
        robot.world.step(round(SECONDS / robot.world.timestep))
        held = [i for g in robot.groups.values() if g.kind != "base" for i in g.indices]
        away = np.abs(robot.joint_arrays.q - wanted)[held]
        if len(away) and away.max() > STAYS:
            name = robot.joint_names[held[int(away.argmax())]]
            findings.append(f"{mode}ed: {name} moved by {away.max():.3g}")
        worst = max(worst, float(away.max(initial=0.0)), STAYS * 2 if overlaps else 0.0)
    return (
        Gate(
            name="tuck",
            title="Tucked and untucked postures hold",
            figure=worst,
            threshold=STAYS,
            unit="rad or m",
            detail=f"motion of arms, torso and head in {SECONDS:g} s after each jump (an overlap "
            f"counts as a fault)",
            findings=findings,
            advice="look at tucked_default_joint_pos and untucked_default_joint_pos, their order of "
            "joints, and"
            " disabled_collision_pairs",
        ),
    )
