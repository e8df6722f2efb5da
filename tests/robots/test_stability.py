"""A robot on wheels stays upright: shocks decay, and no command tips it over."""

from __future__ import annotations

import numpy as np
import pytest
from reference_stability import hull_edges

from roboyard.robots import Robot, add_robot
from roboyard.robots.stability.support_polygon import support_polygon_of
from roboyard.sim import World

G = 9.81


def floor(**options) -> Robot:
    world = World()
    world.add_plane()
    robot = add_robot(world, "r1", **options)
    world.step(60)
    return robot


def tilt(robot: Robot) -> float:
    """Rad of the base, roll or pitch."""
    return float(np.abs(robot.joint_positions[3:5]).max())


def hold(robot: Robot, steps: int, **commands: list[float]) -> float:
    """The greatest tilt on the way."""
    action, worst = robot.no_op_action(), 0.0
    for name, command in commands.items():
        action[robot.controller_action_idx[name]] = command
    for _ in range(steps):
        robot.apply_action(action)
        robot.world.step(robot.steps_per_control)
        worst = max(worst, tilt(robot))
    return worst


def test_edges_of_a_square() -> None:
    points = np.array([[0, 0], [2, 0], [2, 2], [0, 2], [1, 1], [1, 0], [2, 2]], float)
    found = hull_edges(points)
    assert found is not None
    normals, bounds, middle = found
    message = {(int(n[0]), int(n[1])): b for n, b in zip(normals.round(9), bounds, strict=True)}
    assert message == {(0, -1): 0.0, (1, 0): 2.0, (0, 1): 2.0, (-1, 0): 0.0}
    assert middle.tolist() == [1.0, 1.0]
    assert hull_edges(points[:1]) is None
    assert hull_edges(np.array([[0, 0], [1, 1], [2, 2], [3, 3]], float)) is None


def test_margins_agree_with_the_cart_table_and_finite_differences() -> None:
    """A base that speeds up by a moves the floor's answer by -h a / g; joints move the centre of mass."""
    robot = floor()
    support_polygon = support_polygon_of(robot)
    assert support_polygon is not None
    places = np.arange(26)
    balance = support_polygon.balance(places)
    assert balance is not None
    edges = hull_edges(np.array([contact.position[:2] for contact in robot.world.contacts(robot.body)]))
    assert edges is not None
    normals, height = edges[0], robot.body.center_of_mass[2]
    assert balance.zmp_shift[:, 0] == pytest.approx(-normals[:, 0] * height / G, rel=0.01, abs=1e-6)
    assert balance.zmp_shift[:, 1] == pytest.approx(-normals[:, 1] * height / G, rel=0.01, abs=1e-6)
    assert balance.edge == pytest.approx(edges[1] - normals @ robot.body.center_of_mass[:2], abs=2e-3)
    q, small = robot.joint_positions, 1e-5
    for place in (6, 7, 8, 9, 10, 13):
        moved = []
        for sign in (1, -1):
            robot.joint_positions = q + sign * small * (places == place)
            moved.append(robot.body.center_of_mass[:2])
        assert balance.com_shift[:, place] == pytest.approx(
            normals @ (moved[0] - moved[1]) / (2 * small), abs=1e-4
        )


@pytest.mark.parametrize(
    ("joint", "speed"),
    [("torso_joint1", 0.5), ("torso_joint2", 1.0), ("torso_joint3", 1.0), ("left_arm_joint2", 1.0)],
)
def test_a_shock_to_a_joint_decays(joint: str, speed: float) -> None:
    """Drives at their limits do not excite coupled joints; no shock here has the energy to tip R1."""
    robot = floor()
    posture = robot.joint_positions
    robot.joint_arrays.v = robot.joint_arrays.v + np.where(np.array(robot.joint_names) == joint, speed, 0.0)
    hold(robot, 75)
    assert robot.joint_positions[6:] == pytest.approx(posture[6:], abs=0.01)
    assert np.abs(robot.joint_velocities).max() < 0.02
    assert tilt(robot) < 0.01


@pytest.mark.parametrize(("com_shift", "way"), [(0.1, (1.0, 0.0, 0.0)), (-0.1, (-1.0, 0.0, 0.0))])
def test_a_bent_robot_drives_and_stops_upright(com_shift: float, way: tuple[float, ...]) -> None:
    robot = floor()
    assert hold(robot, 120, trunk=[0, com_shift, 0, 0]) < 0.005
    assert robot.joint_positions[7] * np.sign(com_shift) > 0.35
    assert hold(robot, 45, base=list(way)) < 0.03
    assert robot.joint_velocities[0] * way[0] > 1.0
    assert hold(robot, 240) < 0.03
    assert abs(robot.joint_velocities[0]) < 0.1


def test_without_keep_balance_the_trunk_tips_the_robot() -> None:
    robot = floor(controllers={"trunk": {"keep_balance": False}})
    assert hold(robot, 75, trunk=[0.1, 0, 0, 0]) > 0.2


def test_a_joint_stopped_for_stability_moves_back_and_on() -> None:
    """Bending back with another joint increases the margin of the stopped one."""
    robot = floor()
    hold(robot, 75, trunk=[0, 0.1, 0, 0])
    stopped = robot.joint_positions[7]
    assert hold(robot, 75, trunk=[-0.1, 0.1, 0, 0]) < 0.01
    gone_on = robot.joint_positions[7]
    assert gone_on > stopped + 0.2
    hold(
        robot, 60, trunk=[0, 0, 0, 0]
    )  # the other arrives: joints that move at once share the support margin
    gone_on = robot.joint_positions[7]
    assert hold(robot, 30, trunk=[0, -0.1, 0, 0]) < 0.01
    assert robot.joint_positions[7] < gone_on - 0.05


@pytest.mark.parametrize(("size", "held"), [(1.0, 1), (0.1, 30)])
def test_random_commands_do_not_tip_the_robot(size: float, held: int) -> None:
    """All joints at once share the margins of the support polygon."""
    robot, draw = floor(), np.random.default_rng(0)
    worst, action = 0.0, robot.no_op_action()
    for step in range(480):
        if step % held == 0:
            action = draw.uniform(-size, size, robot.action_dim)
        robot.apply_action(action)
        robot.world.step(robot.steps_per_control)
        worst = max(worst, tilt(robot))
    assert worst < 0.05
