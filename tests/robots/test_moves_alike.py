"""The same robot follows the same targets alike under `World`, in the demo and as a `Robot`."""

from __future__ import annotations

import numpy as np
import pytest

from roboyard import World, add_robot
from roboyard.assets import asset_path

TARGET = np.array([0.4, -0.5, 0.3, 0.6, -0.4, 0.5, -0.3])
SECONDS = 1.5
CHECKS = 30


def under_world() -> np.ndarray:
    """(CHECKS, 7) joint positions (rad) while the drives of `World` pull to TARGET."""
    world = World()
    body = world.add_urdf(asset_path("arm7"), fixed_base=True)
    for name, value in zip(body.joint_names, TARGET, strict=True):
        body.joint(name).drive_position(float(value))
    return np.array([_after(world, lambda: body.joint_positions) for _ in range(CHECKS)])


def as_robot() -> np.ndarray:
    """The same while a `Robot` holds the target with its default joint controller."""
    world = World()
    robot = add_robot(world, asset_path("arm7"), fixed_base=True, action_normalize=False)
    robot.apply_action(TARGET)  # a change from the rest posture
    found = [_after(world, lambda: robot.joint_positions)]
    robot.apply_action(np.zeros(7))
    return np.array([*found, *(_after(world, lambda: robot.joint_positions) for _ in range(CHECKS - 1))])


def _after(world: World, positions) -> np.ndarray:
    world.step(round(SECONDS / CHECKS / world.timestep))
    return positions()


def test_a_robot_holds_the_posture_that_the_body_holds() -> None:
    """Both carry the same load with the same stiffness, so that they sag alike."""
    world, robot = under_world(), as_robot()
    np.testing.assert_allclose(robot[-1], TARGET, atol=0.03)
    np.testing.assert_allclose(robot[-1], world[-1], atol=0.01)


def test_a_robot_arrives_about_when_the_body_does() -> None:
    def arrival(found: np.ndarray) -> float:
        late = np.abs(found - TARGET).max(axis=1) > 0.1 * np.abs(TARGET).max()
        return float(np.flatnonzero(late).max() + 1) * SECONDS / CHECKS

    assert 0.1 < arrival(under_world()) < 0.6
    assert arrival(as_robot()) < 2.5 * arrival(under_world())


@pytest.mark.parametrize("share", [0.5, 1.0])
def test_speed_does_not_depend_on_the_time_step(share: float) -> None:
    found = []
    for timestep in (1 / 240, 1 / 480):
        world = World(timestep=timestep)
        body = world.add_urdf(asset_path("arm7"), fixed_base=True)
        for name, value in zip(body.joint_names, TARGET, strict=True):
            body.joint(name).drive_position(float(share * value))
        world.step(round(0.3 / timestep))
        found.append(body.joint_positions)
    np.testing.assert_allclose(found[0], found[1], atol=0.03)
