"""Odd values for every parameter of every function: `error` or TypeError, and a world that goes on."""

from __future__ import annotations

import inspect
import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

import roboyard.pybullet as p
from roboyard.errors import RoboyardError
from roboyard.pybullet.functions import NAMES

NAN, INF = math.nan, math.inf
ARM = """<robot name="r"><link name="a"/><link name="b"><inertial><mass value="1"/>
<inertia ixx="0.01" ixy="0" ixz="0" iyy="0.01" iyz="0" izz="0.01"/></inertial></link>
<joint name="j" type="revolute"><parent link="a"/><child link="b"/><axis xyz="0 1 0"/>
<limit lower="-1" upper="1" effort="9" velocity="2"/></joint></robot>"""
VALUES: tuple[Any, ...] = (
    NAN, INF, -2, 1e300, 2**31, "x", None, [], [NAN] * 3, [INF] * 3, [NAN] * 4, [1e300] * 3, [0] * 3, [0] * 4,
    [NAN], [[NAN] * 3], ["x"] * 3, [99],
)  # fmt: skip
CONNECTIONS = {"connect", "disconnect"}
USUAL = (
    (("filename", "file"), "arm.urdf"),
    (("orn", "orientation", "quaternion", "quat"), [0, 0, 0, 1]),
    (("ids", "indices"), [0]),
    (("index", "id", "link", "body"), 0),
    (("matrix",), [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]),
    (
        ("pos", "vector", "force", "torque", "axis", "from", "to", "euler", "color", "aabb", "velocit"),
        [0, 0, 1],
    ),
)
"""Words in names of parameters, and a value that such parameters accept; the first match counts."""


def usual(parameter: str) -> Any:
    """Return a value that a parameter of this name accepts, in most functions."""
    for words, value in USUAL:
        if any(word in parameter.lower() for word in words):
            return value
    return 1


def parameters(name: str) -> dict[str, inspect.Parameter]:
    """Return the parameters of a function that can be given by name."""
    kinds = (inspect.Parameter.VAR_POSITIONAL, inspect.Parameter.VAR_KEYWORD)
    found = inspect.signature(getattr(p, name)).parameters
    return {
        key: value for key, value in found.items() if key != "physicsClientId" and value.kind not in kinds
    }


def fill() -> None:
    """Put an arm, a ball, a constraint and a saved state into an empty world."""
    p.resetSimulation()
    Path("arm.urdf").write_text(ARM)
    p.loadURDF("arm.urdf", useFixedBase=1)
    ball = p.createCollisionShape(p.GEOM_SPHERE, radius=0.1)
    p.createMultiBody(1, ball, basePosition=[1, 0, 1])
    p.createConstraint(1, -1, -1, -1, p.JOINT_FIXED, [0, 0, 0], [0, 0, 0], [1, 0, 1])
    p.saveState()


@pytest.fixture
def client(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[int]:
    monkeypatch.chdir(tmp_path)
    number = p.connect(p.DIRECT)
    yield number
    p.disconnect(number)


@pytest.mark.parametrize("name", sorted(set(NAMES) - CONNECTIONS))
def test_any_value_ends_in_an_error_of_pybullet(client: int, name: str) -> None:
    function, given = getattr(p, name), parameters(name)
    required = {key: usual(key) for key, value in given.items() if value.default is inspect.Parameter.empty}
    fill()
    for parameter in given:
        for value in VALUES:
            try:
                function(**{**required, parameter: value})
            except (p.error, TypeError, OverflowError):
                continue
    fill()
    p.stepSimulation()
    assert p.getBasePositionAndOrientation(1)[0] == pytest.approx((1, 0, 1), abs=1e-3)


def test_refusals_of_the_world_are_errors_of_both_interfaces(client: int) -> None:
    fill()
    with pytest.raises(p.error, match=r"^applyExternalForce failed: .*finite") as caught:
        p.applyExternalForce(1, -1, [NAN] * 3, [0, 0, 0], p.WORLD_FRAME)
    assert isinstance(caught.value, RoboyardError)
    assert type(caught.value).__module__ == "roboyard.pybullet"


def test_rays_that_are_not_finite_or_have_no_length_hit_nothing(client: int) -> None:
    fill()
    miss = (-1, -1, 1.0, (0.0,) * 3, (0.0,) * 3)
    odd = [[NAN, 0, 2], [0, 0, INF], [0, 0, 0], [1e-300, 0, 0], [0, 0, 1e300]]
    for end in odd:
        assert p.rayTest([0, 0, 0], end) == (miss,)
    hits = p.rayTestBatch([[0, 0, 0]] * 5 + [[1, 0, 0]], [*odd, [1, 0, 2]])
    assert hits[:5] == (miss,) * 5
    assert hits[5][0] == 1
    assert hits[5][3] == pytest.approx((1, 0, 0.9), abs=1e-3)


def test_records_of_logs_are_bounded(client: int) -> None:
    fill()
    with pytest.raises(p.error, match=r"^startStateLogging failed\.") as caught:
        p.startStateLogging(p.STATE_LOGGING_GENERIC_ROBOT, "log.bin", maxLogDof=2**31)
    assert caught.value.__notes__ == ["maxLogDof is at most 10000, got 2147483648"]
    assert not Path("log.bin").exists()


def test_an_empty_target_is_no_target(client: int) -> None:
    fill()
    p.setJointMotorControlMultiDof(0, 0, p.POSITION_CONTROL, targetPosition=[], force=[9])
    for _ in range(50):
        p.stepSimulation()
    assert p.getJointState(0, 0)[0] == pytest.approx(0.0, abs=1e-3)


def test_angles_that_are_infinite_give_numbers_that_are_none(client: int) -> None:
    assert all(map(math.isnan, p.getQuaternionFromEuler([INF, 0, 0])))
    assert all(map(math.isnan, p.getQuaternionFromAxisAngle([0, 0, 1], INF)))
    matrix = p.computeProjectionMatrixFOV(INF, 1, 0.1, 9)
    assert math.isnan(matrix[0])
    assert matrix[10:12] == pytest.approx((-1.02247202, -1.0))


def test_inverse_kinematics_refuses_joints_of_several_degrees_of_freedom(tmp_path: Path) -> None:
    """Whose positions are more numbers than the kinematic chain has."""
    file = tmp_path / "ball.urdf"
    file.write_text(
        ARM.replace('type="revolute"', 'type="spherical"').replace(
            "</robot>",
            """<link name="c"><inertial><mass value="1"/>
<inertia ixx="0.01" ixy="0" ixz="0" iyy="0.01" iyz="0" izz="0.01"/></inertial></link>
<joint name="k" type="revolute"><parent link="b"/><child link="c"/><axis xyz="0 1 0"/><limit lower="-1"
 upper="1" effort="9" velocity="2"/></joint></robot>""",
        )
    )
    client = p.connect(p.DIRECT)
    try:
        body = p.loadURDF(str(file), useFixedBase=True, physicsClientId=client)
        for _ in range(2):
            with pytest.raises(p.error, match=r"joint 0 \(j\) has several degrees of freedom"):
                p.calculateInverseKinematics(body, 1, [0.1, 0.0, 0.2], physicsClientId=client)
        with pytest.raises(p.error, match="several degrees of freedom"):
            p.calculateInverseKinematics2(body, [1], [[0.1, 0.0, 0.2]], physicsClientId=client)
    finally:
        p.disconnect(client)
