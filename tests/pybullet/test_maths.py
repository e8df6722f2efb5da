"""Against numbers recorded from PyBullet 3.2.7, and against SciPy."""

from __future__ import annotations

import json
from math import pi
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import roboyard.pybullet as p
from roboyard.pybullet.api.math import camera_matrices

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


CAMERAS: list[tuple[str, tuple[Any, ...], list[float]]] = [
    ("computeProjectionMatrixFOV", (60.0, 1.0, 0.1, 0.10001), [
        1.73205078, 0, 0, 0, 0, 1.73205078, 0, 0, 0, 0, -20003.6426, -1, 0, 0, -2000.46423, 0,
    ]),
    ("computeProjectionMatrixFOV", (33.3, 1.7, 2.0, 2.0003), [
        1.96692491, 0, 0, 0, 0, 3.34377241, 0, 0, 0, 0, -13337.4199, -1, 0, 0, -26676.8398, 0,
    ]),
    ("computeProjectionMatrixFOV", (-7.5, 0.3, 0.013, 4321.0), [
        -50.8568344, 0, 0, 0, 0, -15.2570515, 0, 0, 0, 0, -1.00000608, -1, 0, 0, -0.0260000788, 0,
    ]),
    ("computeProjectionMatrix", (-0.31, 0.52, -0.33, 0.34, 0.7, 0.70003), [
        1.68674695, 0, 0, 0, 0, 2.08955216, 0, 0, 0.253012031, 0.0149253588, -46604.3789, -1,
        0, 0, -32623.7637, 0,
    ]),
    ("computeProjectionMatrix", (1, 1, 0, 1, 1, 2), [
        np.inf, 0, 0, 0, 0, 2, 0, 0, np.inf, 1, -3, -1, 0, 0, -4, 0,
    ]),
    ("computeViewMatrix", ([1.23, -4.5, 3.21], [0.4, 0.31, 0.2], [0.1, 0.2, 0.9]), [
        0.987538338, 0.0618012212, 0.144736663, 0, 0.0893210545, 0.537101746, -0.838775039, 0,
        -0.129575625, 0.841250539, 0.524888337, 0, -0.3967897, -0.359471798, -5.6374054, 1,
    ]),
    ("computeViewMatrixFromYawPitchRoll", ([0.1, 0.2, 0.3], 2.7, 45, -30, 0, 2), [
        0.707106709, -0.353553414, 0.612372458, 0, 0.707106829, 0.353553295, -0.612372398, 0,
        2.98023224e-08, 0.866025388, 0.49999994, 0, -0.212132022, -0.295162916, -2.78876257, 1,
    ]),
    ("computeViewMatrixFromYawPitchRoll", ([0.1, -0.2, 0.3], 1.9, 123.4, -33.3, 12.5, 1), [
        0.537432253, 0.26658392, -0.800062239, 0, 0.11914584, 0.915200591, 0.384983271, 0,
        0.834847808, -0.302226514, 0.460095972, 0, -0.280368447, 0.247049719, -1.88102603, 1,
    ]),
    ("computeViewMatrixFromYawPitchRoll", ([0, 0, 0], 0, 10, 20, 30, 2), [
        *(np.nan, np.nan, np.nan, 0) * 3, np.nan, np.nan, np.nan, 1,
    ]),
]  # fmt: skip
"""Commands, arguments, and the matrices that PyBullet 3.2.7 returns, to nine digits."""


@pytest.mark.parametrize(("name", "given", "expected"), CAMERAS)
def test_matrices_of_cameras_have_pybullets_last_bit(
    name: str, given: tuple[Any, ...], expected: list[float]
) -> None:
    """Near and far planes that are close together included, and without the compiled function, too."""
    wanted = tuple(np.array(expected, np.float32).astype(float).tolist())
    for module in (p, camera_matrices):
        np.testing.assert_array_equal(getattr(module, name)(*given), wanted)


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
