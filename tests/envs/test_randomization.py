"""Randomisation from episode to episode, against closed forms."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import roboyard.envs as envs
from roboyard.envs.random_rows import RandomRows
from roboyard.errors import ConfigError

N = 32


def after(env: envs.BatchEnv, command: np.ndarray, steps: int) -> np.ndarray:
    """Observations after so many steps of one action."""
    observed = np.zeros(0)
    for _ in range(steps):
        observed = env.step(command)[0]
    return observed


def test_friction_stops_a_sliding_box_where_it_should(make_arm_task: Any) -> None:
    speed = 1.5

    def push(env: envs.EnvArrays, rows: np.ndarray, random: RandomRows) -> None:
        env.body("box").set_velocity(rows, np.array([speed, 0.0, 0.0]))

    task = make_arm_task(
        randomize=[
            envs.Friction("box", (0.3, 0.9)),
            envs.Friction("floor", (0.0, 0.0)),
        ],
        reset=[push],
        limit=100,
    )
    plain = task.build

    def build(world: Any) -> Any:
        bodies = plain(world)
        return {**bodies, "floor": world.bodies[0]}

    env = envs.BatchEnv(make_arm_task(**{**vars(task), "build": build}), N)
    start = env.reset(seed=0)[0][:, 7]
    observed = after(env, np.zeros((N, 7)), 60)
    model = env.runner.physics.world.model
    geom = int(model.body_geomadr[env.runner.env.body("box").root.row])
    friction = env.runner.physics.model_field("geom_friction")[:, geom, 0]
    assert 0.3 <= friction.min() < 0.4 and 0.8 < friction.max() <= 0.9
    np.testing.assert_allclose(observed[:, 7] - start, speed**2 / (2 * friction * 9.81), rtol=0.06)


def test_masses_differ_and_the_robot_sags_by_its_own(make_arm_task: Any) -> None:
    env = envs.BatchEnv(make_arm_task(randomize=[envs.Mass("box", (0.5, 2.0))]), N)
    env.reset(seed=0)
    mass = env.runner.physics.model_field("body_mass")[:, env.runner.env.body("box").root.row]
    own = env.runner.world.model.body_mass[env.runner.env.body("box").root.row]
    factor = mass / own
    assert 0.5 <= factor.min() < 0.7 and 1.7 < factor.max() <= 2.0
    env.reset(seed=0)
    again = env.runner.physics.model_field("body_mass")[:, env.runner.env.body("box").root.row]
    np.testing.assert_array_equal(mass, again)  # factors are of the own mass, not of the last one


def test_gravity_differs(make_arm_task: Any) -> None:
    def lift(env: envs.EnvArrays, rows: np.ndarray, random: RandomRows) -> None:
        env.body("box").set_pose(rows, np.array([1.0, 0.0, 5.0]))

    env = envs.BatchEnv(make_arm_task(randomize=[envs.Gravity((-2.0, 2.0))], reset=[lift]), N)
    env.reset(seed=0)
    observed = after(env, np.zeros((N, 7)), 10)
    gravity = env.runner.physics.model_field("opt.gravity")
    time = 10 / 30
    np.testing.assert_allclose(observed[:, 9] - 5.0, 0.5 * gravity[:, 2] * time**2, rtol=0.02)


def test_a_delay_shifts_the_motion(make_arm_task: Any) -> None:
    def path(delay: tuple[int, int]) -> np.ndarray:
        env = envs.BatchEnv(make_arm_task(randomize=[envs.Delay(delay)]), 1)
        env.reset(seed=0)
        return np.array([env.step(np.full((1, 7), 0.5))[0][0, 0] for _ in range(15)])

    now, late = path((0, 0)), path((3, 3))
    np.testing.assert_allclose(late[3:], now[:-3], atol=1e-4)


def test_joints_start_within_the_noise_and_their_limits(make_arm_task: Any) -> None:
    env = envs.BatchEnv(make_arm_task(randomize=[envs.JointNoise(position=0.2)]), N)
    observed = env.reset(seed=0)[0][:, :7]
    start = np.array([0.0, 0.6, 0.0, -1.2, 0.0, 0.8, 0.0])
    assert 0.15 < np.abs(observed - start).max() <= 0.2 + 1e-6


def test_a_body_starts_elsewhere(make_arm_task: Any) -> None:
    env = envs.BatchEnv(make_arm_task(randomize=[envs.Pose("box", x=(-0.1, 0.1), y=(0.2, 0.3))]), N)
    box = env.reset(seed=0)[0][:, 7:10]
    assert (np.abs(box[:, 0] - 1.0) <= 0.1 + 1e-6).all() and (box[:, 1] >= 0.2 - 1e-6).all()
    np.testing.assert_allclose(box[:, 2], 0.05, atol=1e-6)


def test_streams_do_not_depend_on_the_other_environments(make_arm_task: Any) -> None:
    task = make_arm_task(randomize=[envs.JointNoise(position=0.2)])
    two, many = envs.BatchEnv(task, 2), envs.BatchEnv(task, 5)
    np.testing.assert_array_equal(two.reset(seed=7)[0], many.reset(seed=7)[0][:2])


def test_ranges_that_make_no_sense_are_errors(make_arm_task: Any) -> None:
    for declared in (envs.Mass("box", (0.0, 1.0)), envs.Friction("box", (1.0, 0.5)), envs.Delay((2, 1))):
        with pytest.raises(ConfigError, match="range"):
            envs.BatchEnv(make_arm_task(randomize=[declared]), 1)
    with pytest.raises(ConfigError, match="fixed"):
        envs.BatchEnv(make_arm_task(randomize=[envs.Pose("robot")]), 1)


def test_drives_push_by_their_own_gains(make_arm_task: Any) -> None:
    change = envs.Gains(stiffness=(0.4, 2.5), damping=(0.5, 2.0))
    task = make_arm_task(actions={"arm_0": envs.JointTarget(0.005)}, randomize=[change])
    env = envs.BatchEnv(task, N)
    env.reset(seed=0)
    physics, robot = env.runner.physics, env.runner.env.robot
    kp, kd = robot.robot.loop.gains(np.ones(7, dtype=bool))
    force, bias = physics.field("qfrc_actuator"), physics.field("qfrc_bias")

    def effort(command: float, speed: float) -> np.ndarray:
        physics.field("qvel")[:] = speed
        physics.forward()
        env.runner.actions.apply(np.full((N, 7), command))
        physics.batch.forward()
        return (force - bias)[:, robot.dofs]

    stiffness = effort(1.0, 0.0) / (0.005 * kp)
    damping = (effort(0.0, 0.0) - effort(0.0, 0.01)) / (0.01 * kd)
    for factor, (low, high) in ((stiffness, change.stiffness), (damping, change.damping)):
        np.testing.assert_allclose(factor, factor[:, :1].repeat(7, axis=1), rtol=1e-3)  # one for all joints
        assert low - 1e-3 <= factor.min() < low + 0.3 and high - 0.3 < factor.max() <= high + 1e-3
