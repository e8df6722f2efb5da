"""A robot under OmniGibson's names: breadth-first joint vectors, and torch tensors where requested.

Torch is replaced by a minimal module where it is not installed.
"""

from __future__ import annotations

import sys
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from roboyard.errors import MissingExtraError, RoboyardError
from roboyard.omnigibson import OmniGibsonRobot, wrap
from roboyard.omnigibson.backends import Backend, as_backend, as_numpy
from roboyard.robots import add_robot
from roboyard.sim import World


class Tensor:
    """The methods of a tensor that the wrapper calls."""

    def __init__(self, values: Any, dtype: Any) -> None:
        self.values, self.dtype = np.array(values, dtype), dtype

    def detach(self) -> Tensor:
        return self

    def cpu(self) -> Tensor:
        return self

    def numpy(self) -> np.ndarray:
        return self.values


@pytest.fixture
def fake_torch(monkeypatch: pytest.MonkeyPatch) -> None:
    torch = SimpleNamespace(float32=np.float32, as_tensor=lambda array, dtype: Tensor(array, dtype))
    monkeypatch.setitem(sys.modules, "torch", torch)


def rover(backend: Backend = "numpy") -> OmniGibsonRobot:
    world = World()
    world.add_plane()
    return wrap(add_robot(world, "rover"), backend=backend)


@pytest.fixture(scope="module")
def r1() -> OmniGibsonRobot:
    return wrap(add_robot(World(), "r1"))


def test_getters_return_tensors_on_request_and_setters_accept_them(fake_torch: None) -> None:
    robot = rover(backend="torch")
    for value in (
        robot.get_joint_positions(),
        robot.get_joint_velocities(normalized=True),
        robot.get_joint_efforts(),
        *robot.get_position_orientation(),
        robot.get_linear_velocity(),
        robot.get_proprioception()[0],
        robot.joint_lower_limits,
    ):
        assert isinstance(value, Tensor)
        assert value.dtype is np.float32
    assert isinstance(robot.get_joint_positions(backend="numpy"), np.ndarray)
    robot.set_joint_positions(Tensor([0.5, 0.25], np.float32))
    assert robot.robot.joint_positions == pytest.approx([0.5, 0.25])
    robot.set_position_orientation(Tensor([1, 2, 0], np.float32))
    assert robot.get_position_orientation(backend="numpy")[0] == pytest.approx([1, 2, 0])
    robot.apply_action(Tensor([0.5, 0.0], np.float32))
    robot.robot.world.step(240)
    assert robot.get_linear_velocity(backend="numpy")[0] > 0.3


def test_numpy_is_the_default() -> None:
    assert isinstance(rover().get_joint_positions(), np.ndarray)
    array = np.arange(3.0)
    assert as_backend(array, "numpy") is array
    assert as_numpy(array) is array


def test_missing_and_unknown_backends_are_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "torch", None)
    with pytest.raises(MissingExtraError, match="torch"):
        rover().get_joint_positions(backend="torch")
    with pytest.raises(RoboyardError, match="backend 'jax' is unknown"):
        rover().get_joint_positions(backend="jax")  # type: ignore[arg-type]


def test_with_torch_installed() -> None:
    torch = pytest.importorskip("torch")
    robot = rover(backend="torch")
    q = robot.get_joint_positions()
    assert isinstance(q, torch.Tensor)
    assert q.dtype == torch.float32
    robot.set_joint_positions(torch.tensor([0.5, 0.25], requires_grad=True))
    assert robot.robot.joint_positions == pytest.approx([0.5, 0.25])
    robot.apply_action(torch.zeros(2))


def test_joint_vectors_are_breadth_first_as_in_the_definition_file(r1: OmniGibsonRobot) -> None:
    assert r1.joint_names[10:14] == (
        "left_arm_joint1", "right_arm_joint1", "left_arm_joint2", "right_arm_joint2",
    )  # fmt: skip
    assert r1.joint_names[-4:] == (
        "left_gripper_axis1", "left_gripper_axis2", "right_gripper_axis1", "right_gripper_axis2",
    )  # fmt: skip
    posture = r1.robot.definition.mobile_manipulation.untucked_default_joint_pos
    assert r1.get_joint_positions()[6:] == pytest.approx(posture[6:])
    limits = dict(zip(r1.robot.joint_names, r1.robot.joint_limits, strict=True))
    assert r1.joint_lower_limits == pytest.approx([limits[name][0] for name in r1.joint_names])
    assert r1.joint_upper_limits == pytest.approx([limits[name][1] for name in r1.joint_names])


def test_joints_set_by_breadth_first_index_are_the_named_ones(r1: OmniGibsonRobot) -> None:
    r1.reset()
    index = r1.joint_names.index("right_arm_joint1")
    r1.set_joint_positions([0.3], indices=[index])
    assert r1.robot.joint("right_arm_joint1").position == pytest.approx(0.3)
    assert r1.robot.joint("left_arm_joint1").position == 0.0
    r1.set_joint_velocities([0.5], indices=[index])
    assert r1.get_joint_velocities()[index] == r1.robot.joint("right_arm_joint1").velocity == 0.5
    for group, indices in r1.control_idx.items():
        assert [r1.joint_names[i] for i in indices] == list(r1.robot.groups[group].joints)
    vector, arrays = r1.get_proprioception(("joint_qpos",))
    assert np.array_equal(vector, r1.get_joint_positions())
    assert np.array_equal(arrays["joint_qvel"], r1.get_joint_velocities())
    with pytest.raises(RoboyardError, match="joint positions must be 1 finite numbers"):
        r1.set_joint_positions([1.0, 2.0], indices=[0])


def test_normalized_positions_are_relative_to_the_limits(r1: OmniGibsonRobot) -> None:
    r1.set_joint_positions(r1.joint_upper_limits[6:10], indices=range(6, 10))
    assert r1.get_joint_positions(normalized=True)[6:10] == pytest.approx(np.ones(4))
    r1.reset()


def test_end_effector_poses_agree_between_frames(r1: OmniGibsonRobot) -> None:
    r1.set_position_orientation((1.0, 2.0, 0.0))
    position, quaternion = r1.get_eef_pose("left")
    assert np.array_equal(position, r1.get_eef_position("left"))
    assert np.array_equal(quaternion, r1.get_eef_orientation("left"))
    # the base frame is only shifted by (1, 2, 0)
    assert r1.get_relative_eef_pose("left")[0] == pytest.approx(position - [1.0, 2.0, 0.0])
    assert np.array_equal(r1.get_eef_pose()[0], position)  # the first arm by default
    with pytest.raises(RoboyardError, match="no arm named 'lift'; did you mean 'left'"):
        r1.get_eef_position("lift")
