"""External forces on links, compared with PyBullet 3.2.7."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import roboyard.pybullet as p

ROTORS = """<robot name="rotors"><link name="base">
  <inertial><mass value="0.5"/><inertia ixx="0.01" ixy="0" ixz="0" iyy="0.02" iyz="0" izz="0.03"/></inertial>
  </link>{}</robot>"""
ROTOR = """<link name="rotor{0}"><inertial><origin xyz="{1}"/><mass value="0"/>
  <inertia ixx="0" ixy="0" ixz="0" iyy="0" iyz="0" izz="0"/></inertial></link>
  <joint name="rotor{0}" type="fixed"><parent link="base"/><child link="rotor{0}"/>
  <origin xyz="0 0 0.1"/></joint>"""
ARM = """<robot name="arm"><link name="base"/><link name="rod"><inertial>
  <origin xyz="0.3 0 0"/><mass value="1"/>
  <inertia ixx="0.01" ixy="0" ixz="0" iyy="0.03" iyz="0" izz="0.04"/></inertial></link>
  <joint name="hinge" type="continuous"><parent link="base"/><child link="rod"/>
  <axis xyz="0 0 1"/></joint></robot>"""


def rotors(p: Any, folder: Path) -> int:
    file = folder / "rotors.urdf"
    places = ("0.2 0 0", "-0.1 0.2 0", "-0.1 -0.2 0")
    file.write_text(ROTORS.format("".join(ROTOR.format(i, place) for i, place in enumerate(places))))
    return p.loadURDF(str(file), flags=p.URDF_USE_INERTIA_FROM_FILE)


def record_rotors_of_no_mass(p: Any, folder: Path) -> Any:
    """Thrust of rotors whose links have no mass, at the centres of mass that the file gives."""
    body, seen = rotors(p, folder), []
    for step in range(60):
        for rotor, thrust in enumerate((1.0, 1.1 + 0.2 * np.sin(0.3 * step), 0.9)):
            p.applyExternalForce(body, rotor, [0.05, 0, float(thrust)], [0.01, 0.02, 0], p.LINK_FRAME)
        p.applyExternalTorque(body, 0, [0, 0, 0.01], p.LINK_FRAME)
        p.stepSimulation()
        if step in (0, 1, 9, 59):
            seen.append([p.getBaseVelocity(body), p.getBasePositionAndOrientation(body)])
    return seen


def record_pushed_swinging_rod(p: Any, folder: Path) -> Any:
    """Forces on a turning link, in its own frame and in the world's."""
    file = folder / "arm.urdf"
    file.write_text(ARM)
    arm, seen = p.loadURDF(str(file), useFixedBase=True, flags=p.URDF_USE_INERTIA_FROM_FILE), []
    p.setJointMotorControl2(arm, 0, p.VELOCITY_CONTROL, force=0)
    for step in range(80):
        if step < 40:
            p.applyExternalForce(arm, 0, [0, 20, 0], [0.1, 0, 0], p.LINK_FRAME)
        else:
            p.applyExternalForce(arm, 0, [0, 20, 0], [0.3, 0.1, 0], p.WORLD_FRAME)
        p.stepSimulation()
        if step in (0, 1, 39, 40, 79):
            seen.append(p.getJointState(arm, 0)[:2])
    return seen


def test_rotors_without_mass_push_where_the_file_has_them(agrees: Callable[..., None]) -> None:
    agrees(record_rotors_of_no_mass, 1e-4)


def test_a_swinging_rod_is_pushed_as_in_pybullet(agrees: Callable[..., None]) -> None:
    agrees(record_pushed_swinging_rod, 1e-4)


def test_a_push_off_the_centre_of_a_massless_link_turns_the_body(client: int, tmp_path: Path) -> None:
    body = rotors(p, tmp_path)
    p.applyExternalForce(body, 0, [0, 0, 2.4], [0, 0, 0], p.LINK_FRAME)
    p.stepSimulation()
    linear, angular = p.getBaseVelocity(body)
    np.testing.assert_allclose(linear, [0, 0, 2.4 / 0.5 / 240], atol=1e-9)
    np.testing.assert_allclose(angular, [0, -0.2 * 2.4 / 0.02 / 240, 0], atol=1e-9)


def test_whole_numbers_push_a_base_as_floats_do(client: int) -> None:
    """Those too large for a float are refused, as by Python's own functions."""
    speeds = []
    for one in (1, 1.0):
        body = p.createMultiBody(1.0, p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.1, 0.2, 0.3]))
        p.resetBasePositionAndOrientation(body, [0, 0, 1], p.getQuaternionFromEuler([0.3, 0.5, 0.7]))
        p.applyExternalForce(body, -1, [3 * one, 0 * one, one], [0 * one, one, 0 * one], p.LINK_FRAME)
        p.applyExternalTorque(body, -1, [0 * one, 2 * one, 0 * one], p.LINK_FRAME)
        p.stepSimulation()
        speeds.append(np.concatenate(p.getBaseVelocity(body)))
        p.removeBody(body)
    np.testing.assert_array_equal(*speeds)
    assert np.abs(speeds[0]).max() > 0.1
    body = p.createMultiBody(1.0)
    with pytest.raises(OverflowError):
        p.applyExternalForce(body, -1, [10**400, 0, 0], [0, 0, 0], p.LINK_FRAME)


def test_pushes_in_link_and_world_axes_agree(client: int, tmp_path: Path) -> None:
    """The same force, torque and point, given in the axes of a tilted inertial frame and in the world's."""
    file = tmp_path / "arm.urdf"
    file.write_text(ARM.replace('xyz="0.3 0 0"', 'xyz="0.3 0.1 0" rpy="0.2 0.3 0.4"'))
    speeds = []
    for flag in (p.LINK_FRAME, p.WORLD_FRAME):
        arm = p.loadURDF(str(file), [0, 0, 1], [0, 0.6, 0, 0.8], flags=p.URDF_USE_INERTIA_FROM_FILE)
        for link in (0, -1):
            if link < 0:
                origin, turn = p.getBasePositionAndOrientation(arm)
            else:
                origin, turn = p.getLinkState(arm, link)[:2]
            force, torque, point = [1.0, 2.0, 3.0], np.array([0.3, 0.1, 0.2]), (0.1, -0.2, 0.3)
            if flag == p.WORLD_FRAME:
                axes = np.reshape(p.getMatrixFromQuaternion(turn), (3, 3))
                force, torque, point = (axes @ v for v in (force, torque, point))
                point = point + origin
            p.applyExternalForce(arm, link, force, point, flag)
            p.applyExternalTorque(arm, link, torque, flag)
        p.stepSimulation()
        speeds.append([*np.concatenate(p.getBaseVelocity(arm)), p.getJointState(arm, 0)[1]])
        p.removeBody(arm)
    np.testing.assert_allclose(*speeds, rtol=1e-6, atol=1e-7)
    assert np.abs(speeds[0]).max() > 0.01


def test_pushes_that_cannot_be_are_refused(client: int, tmp_path: Path) -> None:
    body = rotors(p, tmp_path)
    p.applyExternalForce(body + 7, 0, [1, 0, 0], [0, 0, 0], p.LINK_FRAME)  # ignored
    p.applyExternalForce(body, 3, [1, 0, 0], [0, 0, 0], p.LINK_FRAME)
    p.stepSimulation()
    np.testing.assert_array_equal(p.getBaseVelocity(body), np.zeros((2, 3)))
    for flag in (0, 3):
        with pytest.raises(p.error, match="flag has to be"):
            p.applyExternalForce(body, 0, [1, 0, 0], [0, 0, 0], flag)
    with pytest.raises(p.error, match="force needs"):
        p.applyExternalForce(body, 0, [1, 0], [0, 0, 0], p.LINK_FRAME)
    with pytest.raises(p.error, match="finite"):
        p.applyExternalTorque(body, 0, [np.inf, 0, 0], p.LINK_FRAME)
    with pytest.raises(TypeError):
        p.applyExternalForce(body, 0, ["1", 0, 0], [0, 0, 0], p.LINK_FRAME)
