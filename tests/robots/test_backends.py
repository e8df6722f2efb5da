"""Values as torch tensors where asked: by torch itself if it is there, and by a stand-in for its seam."""

from __future__ import annotations

import sys
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from roboyard.errors import MissingExtraError, RoboyardError
from roboyard.robots import Robot, add_robot
from roboyard.robots.backends import as_backend, as_numpy
from roboyard.sim import World


class Tensor:
    """As much of a tensor as this seam touches."""

    def __init__(self, values: Any, dtype: Any) -> None:
        self.values, self.dtype = np.array(values, dtype), dtype

    def detach(self) -> Tensor:
        return self

    def cpu(self) -> Tensor:
        return self

    def numpy(self) -> np.ndarray:
        return self.values


@pytest.fixture
def stand_in(monkeypatch: pytest.MonkeyPatch) -> None:
    torch = SimpleNamespace(float32=np.float32, as_tensor=lambda array, dtype: Tensor(array, dtype))
    monkeypatch.setitem(sys.modules, "torch", torch)


def rover(**options: Any) -> Robot:
    world = World()
    world.add_plane()
    return add_robot(world, "rover", **options)


def test_getters_give_tensors_where_asked_and_setters_take_them(stand_in: None) -> None:
    robot = rover(backend="torch")
    for value in (
        robot.get_joint_positions(),
        robot.get_joint_velocities(normalized=True),
        robot.get_joint_efforts(),
        *robot.get_position_orientation(),
        robot.get_linear_velocity(),
        robot.get_proprioception()[0],
    ):
        assert isinstance(value, Tensor)
        assert value.dtype is np.float32
    assert isinstance(robot.get_joint_positions(backend="numpy"), np.ndarray)
    robot.set_joint_positions(Tensor([0.5, 0.25], np.float32))
    assert robot.joints.q == pytest.approx([0.5, 0.25])
    robot.set_position_orientation(Tensor([1, 2, 0], np.float32))
    assert robot.get_position_orientation(backend="numpy")[0] == pytest.approx([1, 2, 0])
    robot.apply_action(Tensor([0.5, 0.0], np.float32))
    robot.world.step(240)
    assert robot.get_linear_velocity(backend="numpy")[0] > 0.3


def test_numpy_is_what_comes_unasked() -> None:
    assert isinstance(rover().get_joint_positions(), np.ndarray)
    array = np.arange(3.0)
    assert as_backend(array, "numpy") is array
    assert as_numpy(array) is array


def test_absent_or_unknown_backends_are_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "torch", None)
    with pytest.raises(MissingExtraError, match="torch"):
        rover().get_joint_positions(backend="torch")
    with pytest.raises(RoboyardError, match="backend 'jax' is unknown"):
        rover().get_joint_positions(backend="jax")  # type: ignore[arg-type]


def test_torch_itself() -> None:
    torch = pytest.importorskip("torch")
    robot = rover(backend="torch")
    q = robot.get_joint_positions()
    assert isinstance(q, torch.Tensor)
    assert q.dtype == torch.float32
    robot.set_joint_positions(torch.tensor([0.5, 0.25], requires_grad=True))
    assert robot.joints.q == pytest.approx([0.5, 0.25])
    robot.apply_action(torch.zeros(2))
