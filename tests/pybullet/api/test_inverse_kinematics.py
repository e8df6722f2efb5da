"""Inverse kinematics: solutions are checked by forward kinematics, options against PyBullet's habits."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import roboyard.pybullet as p

LENGTHS = (0.4, 0.3, 0.2)


def arm_text(joints: int) -> str:
    """A chain of hinges about z, x and y in turn."""
    axes = ("0 0 1", "0 1 0", "0 1 0", "1 0 0", "0 1 0", "0 0 1")
    links = ['<link name="l0"/>']
    for k in range(joints):
        links.append(
            f'<link name="l{k + 1}"><inertial><mass value="1"/><inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" '
            f'iyz="0" izz="0.1"/></inertial></link><joint name="j{k}" type="revolute"><parent link="l{k}"/>'
            f'<child link="l{k + 1}"/><origin xyz="0 0 {LENGTHS[k % 3]}"/><axis xyz="{axes[k]}"/>'
            '<limit lower="-2.5" upper="2.5" effort="10" velocity="10"/></joint>'
        )
    return f'<robot name="arm">{"".join(links)}</robot>'


def load(p: Any, folder: Path, joints: int = 6) -> int:
    file = folder / f"arm{joints}.urdf"
    file.write_text(arm_text(joints))
    return p.loadURDF(str(file), [0.1, 0.2, 0], [0, 0, 0.6, 0.8], useFixedBase=True)


@pytest.fixture
def arm(client: int, tmp_path: Path) -> int:
    return load(p, tmp_path)


def pose_at(body: int, q: Any) -> tuple[Any, Any]:
    for joint, value in enumerate(q):
        p.resetJointState(body, joint, value)
    return p.getLinkState(body, 5, computeForwardKinematics=1)[4:6]


@pytest.mark.parametrize("seed", range(5))
def test_reachable_positions_are_reached(arm: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    goal, _ = pose_at(arm, rng.uniform(-1, 1, 6))
    pose_at(arm, [0.1] * 6)
    q = p.calculateInverseKinematics(arm, 5, goal, maxNumIterations=2000, residualThreshold=1e-5)
    assert len(q) == 6
    assert pose_at(arm, q)[0] == pytest.approx(goal, abs=1e-3)


@pytest.mark.parametrize("seed", range(3))
def test_reachable_poses_are_reached(arm: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    goal_q = rng.uniform(-0.8, 0.8, 6)
    goal = pose_at(arm, goal_q)
    pose_at(arm, goal_q + 0.15)
    q = p.calculateInverseKinematics(arm, 5, *goal, maxNumIterations=3000, residualThreshold=1e-6)
    position, orientation = pose_at(arm, q)
    assert position == pytest.approx(goal[0], abs=2e-3)
    assert abs(np.dot(orientation, goal[1])) == pytest.approx(1, abs=1e-3)


def test_the_robot_does_not_move(arm: int) -> None:
    pose_at(arm, [0.2] * 6)
    p.calculateInverseKinematics(arm, 5, [0.3, 0.3, 0.8])
    assert [state[0] for state in p.getJointStates(arm, range(6))] == pytest.approx([0.2] * 6)


def test_repeated_calls_come_nearer(arm: int) -> None:
    goal, _ = pose_at(arm, [0.5, 0.6, -0.4, 0.3, 0.2, 0.1])
    pose_at(arm, [0.1] * 6)
    errors = []
    for _ in range(12):
        q = p.calculateInverseKinematics(arm, 5, goal)
        errors.append(np.linalg.norm(np.subtract(pose_at(arm, q)[0], goal)))
    assert errors[-1] < 0.3 * errors[0]
    assert all(after <= before + 1e-3 for before, after in pairwise(errors))


def test_the_search_starts_at_current_positions(arm: int) -> None:
    pose_at(arm, [0.0] * 6)
    start = [0.3, -0.2, 0.4, 0.1, 0.2, 0.3]
    assert p.calculateInverseKinematics(arm, 5, [1, 1, 1], currentPositions=start, maxNumIterations=0) == (
        pytest.approx(start)
    )


def test_lists_of_another_length_are_ignored(arm: int) -> None:
    pose_at(arm, [0.1] * 6)
    goal = [0.3, 0.2, 0.9]
    plain = p.calculateInverseKinematics(arm, 5, goal)
    short = p.calculateInverseKinematics(
        arm, 5, goal, lowerLimits=[-1], upperLimits=[1], jointRanges=[2], restPoses=[0], jointDamping=[0.1]
    )
    assert short == pytest.approx(plain)


@pytest.mark.parametrize("count", [6, 8])
def test_dampings_may_be_more_than_joints(arm: int, count: int) -> None:
    """Recorded with PyBullet 3.2.7, which reads the first six."""
    pose_at(arm, [0.1] * 6)
    damping = [1e-5, 1e-3, 0.1, 1, 1e-5, 0.5, 9, 9][:count]
    q = p.calculateInverseKinematics(arm, 5, [0.3, 0.2, 0.9], [0, 0.6, 0, 0.8], jointDamping=damping)
    recorded = (-1.238209, -3.110325, 3.141437, 0.155632, 1.318524, -0.160789)
    assert q == pytest.approx(recorded, abs=1e-5)


def test_rest_poses_draw_the_null_space(arm: int) -> None:
    pose_at(arm, [0.1] * 6)
    goal, _ = pose_at(arm, [0.4, 0.5, 0.3, -0.2, 0.4, 0.0])
    found = {}
    for rest in (-1.0, 1.0):
        pose_at(arm, [0.1] * 6)
        q = [0.1] * 6
        for _ in range(20):
            q = p.calculateInverseKinematics(
                arm, 5, goal, lowerLimits=[-2.5] * 6, upperLimits=[2.5] * 6, jointRanges=[5] * 6,
                restPoses=[0.4, 0.5, 0.3, -0.2, 0.4, rest], currentPositions=list(q),
            )  # fmt: skip
        found[rest] = q[5]
    assert found[-1.0] < found[1.0]


def test_several_links_have_targets(arm: int) -> None:
    pose_at(arm, [0.3, 0.4, -0.2, 0.2, 0.3, 0.1])
    goals = [p.getLinkState(arm, link, computeForwardKinematics=1)[4] for link in (3, 5)]
    pose_at(arm, [0.1] * 6)
    q = p.calculateInverseKinematics2(arm, [3, 5], goals, maxNumIterations=3000, residualThreshold=1e-5)
    pose_at(arm, q)
    for link, goal in zip((3, 5), goals, strict=True):
        assert p.getLinkState(arm, link, computeForwardKinematics=1)[4] == pytest.approx(goal, abs=5e-3)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda body: p.calculateInverseKinematics(body, 5, [0, 0]), "couldn't extract position vector3"),
        (
            lambda body: p.calculateInverseKinematics(body, 9, [0, 0, 0]),
            "Error in calculateInverseKinematics",
        ),
        (lambda body: p.calculateInverseKinematics(7, 5, [0, 0, 0]), "Error in calculateInverseKinematics"),
        (
            lambda body: p.calculateInverseKinematics(body, 5, [0, 0, 0], currentPositions=[1]),
            "size of input",
        ),
        (lambda body: p.calculateInverseKinematics2(body, [5], [[0, 0, 0]] * 2), "Error in calculateInverse"),
        (lambda body: p.calculateInverseKinematics2(body, [], []), "Error in calculateInverseKinematics"),
    ],
)
def test_wrong_arguments_raise(arm: int, call: Any, message: str) -> None:
    with pytest.raises(p.error, match=message):
        call(arm)


def test_a_body_without_joints_has_no_solution(client: int) -> None:
    body = p.createMultiBody(1)
    with pytest.raises(p.error) as caught:
        p.calculateInverseKinematics(body, 0, [0, 0, 0])
    assert "no movable joint" in caught.value.__notes__[0]


def test_the_orientation_of_a_target_is_that_of_the_inertial_frame(client: int, tmp_path: Path) -> None:
    """PyBullet compares the target with the tip's principal axes, at the position of its link frame."""
    text = arm_text(6).replace(
        "</robot>",
        '<link name="tip"><inertial><origin xyz="0.1 0 0" rpy="0.4 -0.9 0.3"/><mass value="0.1"/>'
        '<inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>'
        '<joint name="t" type="fixed"><parent link="l6"/><child link="tip"/>'
        '<origin xyz="0 0 0.1"/></joint></robot>',
    )
    (tmp_path / "arm.urdf").write_text(text)
    arm = p.loadURDF(str(tmp_path / "arm.urdf"), useFixedBase=True)
    place = [0.5, 0.3, 0.6]
    turn = p.getQuaternionFromEuler([0.3, 1.2, -0.2])
    angles = p.calculateInverseKinematics(arm, 6, place, turn, maxNumIterations=2000, residualThreshold=1e-9)
    for joint, angle in enumerate(angles):
        p.resetJointState(arm, joint, angle)
    state = p.getLinkState(arm, 6)
    np.testing.assert_allclose(state[4], place, atol=1e-4)
    assert abs(np.dot(state[1], turn)) == pytest.approx(1.0, abs=1e-6)


def test_with_current_positions_the_target_is_in_the_base_frame(client: int, tmp_path: Path) -> None:
    """As in PyBullet, where a script gives the joint positions of another moment."""
    (tmp_path / "arm.urdf").write_text(arm_text(6))
    arm = p.loadURDF(str(tmp_path / "arm.urdf"), [1, 2, 3], [0, 0, 0.6, 0.8], useFixedBase=True)
    start = [0.1, 0.4, 0.5, 0.1, 0.2, 0.1]
    for joint, angle in enumerate(start):
        p.resetJointState(arm, joint, angle)
    in_base = [0.4, 0.2, 0.6]
    in_world = p.multiplyTransforms([1, 2, 3], [0, 0, 0.6, 0.8], in_base, [0, 0, 0, 1])[0]
    np.testing.assert_allclose(
        p.calculateInverseKinematics(arm, 5, in_base, currentPositions=start),
        p.calculateInverseKinematics(arm, 5, in_world),
        atol=1e-6,
    )
