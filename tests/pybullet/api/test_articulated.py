"""Jacobians, mass matrices and inverse dynamics, compared with PyBullet 3.2.7 and with finite differences."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import roboyard.pybullet as p
from roboyard.pybullet.state.bodies.body_records import BodyRecord

ARM = """<robot name="arm"><link name="base">
    <inertial><mass value="4"/><inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.1"/></inertial>
    <collision><geometry><box size="0.3 0.3 0.2"/></geometry></collision></link>
  <link name="a"><inertial><origin xyz="0 0 0.2" rpy="0.2 0 0"/><mass value="2"/>
    <inertia ixx="0.02" ixy="0" ixz="0" iyy="0.03" iyz="0" izz="0.01"/></inertial></link>
  <link name="b"><inertial><origin xyz="0.15 0 0"/><mass value="1"/>
    <inertia ixx="0.01" ixy="0" ixz="0" iyy="0.02" iyz="0" izz="0.03"/></inertial></link>
  <link name="c"><inertial><origin xyz="0.1 0.05 0"/><mass value="0.5"/>
    <inertia ixx="0.01" ixy="0" ixz="0" iyy="0.01" iyz="0" izz="0.01"/></inertial></link>
  <joint name="j0" type="revolute"><parent link="base"/><child link="a"/><origin xyz="0 0 0.1"/>
    <axis xyz="0 0 1"/>
    <limit lower="-3" upper="3" effort="50" velocity="5"/></joint>
  <joint name="j1" type="revolute"><parent link="a"/><child link="b"/><origin xyz="0 0 0.4" rpy="0.3 0 0"/>
    <axis xyz="0 1 0"/><limit lower="-3" upper="3" effort="50" velocity="5"/></joint>
  <joint name="j2" type="prismatic"><parent link="b"/><child link="c"/><origin xyz="0.3 0 0"/>
    <axis xyz="1 0 0"/>
    <limit lower="-1" upper="1" effort="50" velocity="5"/></joint></robot>"""
POSTURES = ([0.0, 0.0, 0.0], [0.4, -0.7, 0.2], [-1.3, 1.1, -0.5])


def arm(p: Any, folder: Path, *, fixed: bool = True) -> int:
    file = folder / "arm.urdf"
    file.write_text(ARM)
    return p.loadURDF(str(file), [0.2, 0.1, 0.5], [0, 0, 0.6, 0.8], useFixedBase=fixed, flags=2)


def message_of(call: Callable[[], Any]) -> list[str]:
    try:
        return ["no error", repr(call())]
    except Exception as problem:
        return [type(problem).__name__, str(problem)]


def record_jacobians(p: Any, folder: Path) -> Any:
    body = arm(p, folder)
    zeros = [0.0] * 3
    return [
        p.calculateJacobian(body, link, point, q, zeros, zeros)
        for q in POSTURES
        for link, point in ((0, [0, 0, 0.1]), (2, [0, 0, 0]), (2, [0.1, 0.2, 0.3]))
    ]


def record_jacobians_of_a_floating_base(p: Any, folder: Path) -> Any:
    body = arm(p, folder, fixed=False)
    zeros = [0.0] * 3
    return [p.calculateJacobian(body, 2, [0.1, 0, 0], q, zeros, zeros) for q in POSTURES]


def record_mass_matrices(p: Any, folder: Path) -> Any:
    fixed, floating = arm(p, folder), arm(p, folder, fixed=False)
    return [[p.calculateMassMatrix(body, q) for body in (fixed, floating)] for q in POSTURES]


def record_inverse_dynamics(p: Any, folder: Path) -> Any:
    p.setGravity(0, 0, -9.81)
    body = arm(p, folder)
    return [
        p.calculateInverseDynamics(body, q, dq, ddq)
        for q in POSTURES
        for dq, ddq in (([0, 0, 0], [0, 0, 0]), ([1, -2, 0.5], [0, 0, 0]), ([0.3, 0.2, 0.1], [4, -5, 6]))
    ]


def record_inverse_dynamics_of_a_floating_base(p: Any, folder: Path) -> Any:
    p.setGravity(1.0, -2.0, -9.81)
    body = arm(p, folder, fixed=False)
    pose = [0.3, 0.2, 0.1, 0.0, 0.0, 0.6, 0.8]  # Bullet turns about several axes in another order
    return [
        p.calculateInverseDynamics(body, pose + q, [*speeds, 0.5, -0.4, 0.3], [*changes, 3, 2, -1])
        for q in POSTURES
        for speeds, changes in (([0] * 6, [0] * 6), ([1, -2, 0.5, 3, 4, 5], [0.3, 0.2, 0.1, 4, -5, 6]))
    ]


def record_wrong_arguments(p: Any, folder: Path) -> Any:
    body = arm(p, folder)
    three, two = [0.0] * 3, [0.0] * 2
    return [
        message_of(lambda: p.calculateJacobian(body, 2, three, two, two, two)),
        message_of(lambda: p.calculateJacobian(body, 2, two, three, three, three)),
        message_of(lambda: p.calculateInverseDynamics(body, three, three, two)),
    ]


@pytest.mark.parametrize(
    ("scenario", "tolerance"),
    [
        (record_jacobians, 1e-6),
        (record_jacobians_of_a_floating_base, 1e-6),
        (record_mass_matrices, 1e-6),
        (record_inverse_dynamics, 1e-6),
        (record_inverse_dynamics_of_a_floating_base, 1e-6),
        (record_wrong_arguments, 0),
    ],
)
def test_results_are_pybullets(agrees: Any, scenario: Any, tolerance: float) -> None:
    agrees(scenario, tolerance)


@pytest.mark.parametrize("q", POSTURES)
def test_a_jacobian_is_how_the_point_moves(client: int, tmp_path: Path, q: list[float]) -> None:
    body, step = arm(p, tmp_path), 1e-5
    linear, _ = p.calculateJacobian(body, 2, [0, 0, 0], q, [0] * 3, [0] * 3)

    def place(values: list[float]) -> np.ndarray:
        for joint, value in enumerate(values):
            p.resetJointState(body, joint, value)
        return np.array(body_frame(p.getLinkState(body, 2, computeForwardKinematics=1)[4]))

    def body_frame(point: Any) -> Any:
        position, orientation = p.getBasePositionAndOrientation(body)
        inverse = p.invertTransform(position, orientation)
        return p.multiplyTransforms(*inverse, point, [0, 0, 0, 1])[0]

    for column in range(3):
        ahead, behind = list(q), list(q)
        ahead[column] += 1000 * step
        behind[column] -= 1000 * step
        difference = (place(ahead) - place(behind)) / (2000 * step)
        assert [row[column] for row in linear] == pytest.approx(difference.tolist(), abs=2e-4)


@pytest.mark.parametrize("fixed", [True, False])
@pytest.mark.parametrize("q", POSTURES)
def test_the_compiled_tree_does_what_mujoco_does(
    client: int, tmp_path: Path, fixed: bool, q: list[float], monkeypatch: pytest.MonkeyPatch
) -> None:
    p.setGravity(1, 2, -9)
    arm(p, tmp_path)
    body = arm(p, tmp_path, fixed=fixed)
    pose, six = ([], []) if fixed else ([0.1, 0.2, 0.3, 0, 0.6, 0, 0.8], [1.0, 2.0, 3.0, -1.0, 0.5, 0.25])

    def results() -> list[Any]:
        return [
            p.calculateInverseDynamics(body, pose + q, [*six, 0.1, 0.2, 0.3], [*six, 3.0, 2.0, 1.0]),
            p.calculateMassMatrix(body, [*q, 7.0]),
            *(p.calculateJacobian(body, link, [0.1, 0.2, 0.3], q, q, q) for link in (-1, 0, 2)),
        ]

    compiled = results()
    assert results() == compiled, "nothing is left over"
    monkeypatch.setattr(BodyRecord, "tree", lambda record, model: None)
    for ours, theirs in zip(compiled, results(), strict=True):
        np.testing.assert_allclose(np.array(ours), np.array(theirs), rtol=1e-10, atol=1e-10)


def test_a_changed_mass_counts(client: int, tmp_path: Path) -> None:
    body = arm(p, tmp_path)
    before = p.calculateMassMatrix(body, POSTURES[0])
    p.changeDynamics(body, 2, mass=1.5)
    after = p.calculateMassMatrix(body, POSTURES[0])
    assert after[2][2] == pytest.approx(before[2][2] + 1.0), "the slide carries 1 kg more"


@pytest.mark.parametrize("q", POSTURES)
def test_a_mass_matrix_is_symmetric_and_positive(client: int, tmp_path: Path, q: list[float]) -> None:
    for fixed in (True, False):
        matrix = np.array(p.calculateMassMatrix(arm(p, tmp_path, fixed=fixed), q))
        assert matrix == pytest.approx(matrix.T)
        assert np.linalg.eigvalsh(matrix).min() > 0
        assert matrix.shape == ((3, 3) if fixed else (9, 9))


def test_inverse_dynamics_is_mass_times_acceleration_plus_gravity(client: int, tmp_path: Path) -> None:
    body, q, ddq = arm(p, tmp_path), POSTURES[1], [1.0, -2.0, 3.0]
    p.setGravity(0, 0, -9.81)
    bias = np.array(p.calculateInverseDynamics(body, q, [0] * 3, [0] * 3))
    efforts = np.array(p.calculateInverseDynamics(body, q, [0] * 3, ddq))
    assert efforts - bias == pytest.approx(np.array(p.calculateMassMatrix(body, q)) @ ddq)


def test_gravity_compensation_holds_the_arm(client: int, tmp_path: Path) -> None:
    body, q = arm(p, tmp_path), POSTURES[1]
    p.setGravity(0, 0, -9.81)
    for joint, value in enumerate(q):
        p.resetJointState(body, joint, value)
        p.setJointMotorControl2(body, joint, p.VELOCITY_CONTROL, force=0)
    for _ in range(50):
        now = [p.getJointState(body, joint)[0] for joint in range(3)]
        for joint, effort in enumerate(p.calculateInverseDynamics(body, now, [0] * 3, [0] * 3)):
            p.setJointMotorControl2(body, joint, p.TORQUE_CONTROL, force=effort)
        p.stepSimulation()
    assert [p.getJointState(body, joint)[0] for joint in range(3)] == pytest.approx(q, abs=1e-4)


def test_a_floating_base_weighs_what_its_links_do(client: int, tmp_path: Path) -> None:
    body = arm(p, tmp_path, fixed=False)
    p.setGravity(0, 0, -10)
    efforts = p.calculateInverseDynamics(body, [0, 0, 0, 0, 0, 0, 1, *POSTURES[1]], [0] * 9, [0] * 9)
    assert efforts[:3] == pytest.approx((0, 0, 75), abs=1e-6), "7.5 kg; the force comes before the torque"
