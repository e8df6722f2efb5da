"""Against numbers recorded from PyBullet 3.2.7, and against SciPy."""

from __future__ import annotations

import json
from math import pi
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import roboyard.pybullet as p

RECORDED = json.loads((Path(__file__).parent / "data/recorded_maths.json").read_text())
EXACT = {"getQuaternionFromEuler", "getEulerFromQuaternion", "getMatrixFromQuaternion"}


def flat(value: object) -> list[float]:
    return [x for part in value for x in flat(part)] if isinstance(value, list | tuple) else [value]


@pytest.mark.parametrize("name", sorted(RECORDED))
def test_agrees_with_recorded_numbers(name: str) -> None:
    tolerance = 1e-14 if name in EXACT else 1e-5 if "Velocity" in name else 2e-6
    for arguments, expected in RECORDED[name]:
        got = flat(getattr(p, name)(*arguments))
        np.testing.assert_allclose(got, flat(expected), rtol=tolerance, atol=tolerance)
        assert all(type(x) is float for x in got)


def test_numpy_arguments_give_python_floats() -> None:
    q = p.getQuaternionFromEuler(np.array([0.1, 0.2, 0.3]))
    values = flat([q, p.getMatrixFromQuaternion(np.array(q)), p.getMatrixFromQuaternion([0, 0, 0, 1])])
    assert all(type(x) is float for x in values)


def test_euler_angles_are_about_fixed_axes() -> None:
    q = p.getQuaternionFromEuler([0.3, -0.8, 2.0])
    np.testing.assert_allclose(q, Rotation.from_euler("xyz", [0.3, -0.8, 2.0]).as_quat(), atol=1e-15)


@pytest.mark.parametrize("pitch", [pi / 2, -pi / 2])
def test_roll_is_zero_at_the_poles(pitch: float) -> None:
    roll, found, yaw = p.getEulerFromQuaternion(p.getQuaternionFromEuler([0.4, pitch, 0.1]))
    assert (roll, found) == (0.0, pitch)
    again = Rotation.from_euler("xyz", [roll, found, yaw])
    wanted = Rotation.from_euler("xyz", [0.4, pitch, 0.1])
    assert (again.inv() * wanted).magnitude() < 1e-6


def test_matrix_ignores_the_length_of_the_quaternion() -> None:
    q = np.array([0.1, -0.2, 0.3, 0.4])
    np.testing.assert_allclose(
        np.reshape(p.getMatrixFromQuaternion(3 * q), (3, 3)), Rotation.from_quat(q).as_matrix(), atol=1e-15
    )


def test_a_transform_times_its_inverse_is_nothing() -> None:
    pose = [1.0, 2.0, 3.0], p.getQuaternionFromEuler([0.3, -0.5, 1.1])
    position, orientation = p.multiplyTransforms(*pose, *p.invertTransform(*pose))
    np.testing.assert_allclose(position, 0.0, atol=1e-6)
    np.testing.assert_allclose(orientation, [0, 0, 0, 1], atol=1e-6)


def test_special_rotations() -> None:
    assert p.getAxisAngleFromQuaternion([0, 0, 0, 1]) == ((1.0, 0.0, 0.0), 0.0)
    assert p.getQuaternionSlerp([0, 0, 0, 1], [0, 0, 0, 1], 0.5) == (0.0, 0.0, 0.0, 1.0)
    assert p.calculateVelocityQuaternion([0, 0, 0, 1], [0, 0, 0, 1], 0.1) == (0.0, 0.0, 0.0)
    assert np.isnan(p.getMatrixFromQuaternion([0, 0, 0, 0])).all()
    assert np.isnan(p.computeViewMatrix([0, 0, 0], [0, 0, 0], [0, 0, 1])[0])
    assert p.computeProjectionMatrixFOV(60, 0, 1, 1)[0] == np.inf


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: p.getQuaternionFromEuler([1, 2]), "Euler angles need a 3 coordinates [roll, pitch, yaw]."),
        (lambda: p.getEulerFromQuaternion([1, 2]), "Quaternion need a 4 components [x,y,z,w]."),
        (lambda: p.getMatrixFromQuaternion([1, 2]), "Couldn't convert quaternion [x,y,z,w]."),
        (
            lambda: p.invertTransform([1, 2, 3], [0, 0, 1]),
            "Invalid input: expected position [x,y,z] and orientation [x,y,z,w].",
        ),
        (lambda: p.computeViewMatrix([0, 0], [0, 0, 0], [0, 0, 1]), "Error in computeViewMatrix."),
        (
            lambda: p.computeViewMatrixFromYawPitchRoll([0, 0], 1, 2, 3, 4, 2),
            "Cannot convert cameraTargetPosition.",
        ),
    ],
)
def test_wrong_shapes_raise_pybullets_text(call: object, message: str) -> None:
    with pytest.raises(p.error) as caught:
        call()
    assert str(caught.value) == message


def test_text_is_no_number() -> None:
    with pytest.raises(TypeError):
        p.multiplyTransforms([1, 2, "3"], [0, 0, 0, 1], [0, 0, 0], [0, 0, 0, 1])
    with pytest.raises(TypeError):
        p.getQuaternionFromEuler(["a", 0, 0])
    with pytest.raises(TypeError):
        p.computeProjectionMatrixFOV("a", 1, 0.1, 10)
