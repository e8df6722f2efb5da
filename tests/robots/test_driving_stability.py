"""A robot on wheels stays upright however it is driven: curves and full speed tip nothing."""

from __future__ import annotations

from dataclasses import replace

import mujoco
import numpy as np
import pytest

from roboyard.description import load_description
from roboyard.description.model import Pose, RobotDescription
from roboyard.robots import REGISTERED_ROBOTS, Robot, add_robot
from roboyard.robots.definition.schema import VIRTUAL_JOINTS
from roboyard.robots.stability.support_polygon import support_polygon_of
from roboyard.robots.stability.zmp import BalanceMargins
from roboyard.sim import World

G = 9.81
FALLEN = 0.1
"""rad"""


def floor(**options) -> Robot:
    world = World()
    world.add_plane()
    robot = add_robot(world, "r1", action_normalize=False, **options)
    world.step(60)
    return robot


def tilt(robot: Robot) -> float:
    """Rad between the base's axis and the vertical."""
    x, y, _, _ = robot.base_link.pose[1]
    return float(2.0 * np.arcsin(np.hypot(x, y)))


def drive(robot: Robot, twist, steps: int) -> float:
    """The greatest tilt on the way."""
    action, worst = robot.no_op_action(), 0.0
    action[robot.controller_action_idx["base"]] = twist
    for _ in range(steps):
        robot.apply_action(action)
        robot.world.step(robot.steps_per_control)
        worst = max(worst, tilt(robot))
    return worst


def balance_of(robot: Robot) -> BalanceMargins:
    support_polygon = support_polygon_of(robot)
    assert support_polygon is not None
    found = support_polygon.balance(np.arange(len(robot.joint_names)))
    assert found is not None
    return found


def mast_robot(height: float) -> Robot:
    """A made-up base on four balls, 30 cm apart, with a mass on a mast; its virtual joints carry it."""
    links, joints, above = ["<link name='world_link'/>"], [], "world_link"
    for name, kind, axis in zip(
        VIRTUAL_JOINTS,
        ("prismatic",) * 3 + ("revolute",) * 2 + ("continuous",),
        ("1 0 0", "0 1 0", "0 0 1") * 2,
        strict=True,
    ):
        child = "base_link" if name == VIRTUAL_JOINTS[-1] else name.replace("joint", "link")
        links.append(f"<link name='{child}'/>" if child != "base_link" else "")
        joints.append(
            f"<joint name='{name}' type='{kind}'><parent link='{above}'/><child link='{child}'/>"
            f"<axis xyz='{axis}'/><limit lower='-100' upper='100' effort='1000' velocity='2'/></joint>"
        )
        above = child
    inertia = "<inertia ixx='.2' iyy='.2' izz='.2' ixy='0' ixz='0' iyz='0'/>"
    links.append(
        "<link name='base_link'><inertial><origin xyz='0 0 0.1'/><mass value='10'/>"
        f"{inertia}</inertial></link>"
    )
    corners = [(x, y) for x in (-0.15, 0.15) for y in (-0.15, 0.15)]
    for i, (x, y) in enumerate(corners):
        links.append(
            f"<link name='ball{i}'><inertial><mass value='0.1'/>{inertia.replace('.2', '.0001')}</inertial>"
            "<collision><geometry><sphere radius='0.05'/></geometry></collision></link>"
        )
        joints.append(
            f"<joint name='foot{i}' type='fixed'><parent link='base_link'/><child link='ball{i}'/>"
            f"<origin xyz='{x} {y} 0.05'/></joint>"
        )
    links.append(f"<link name='mast'><inertial><mass value='10'/>{inertia}</inertial></link>")
    joints.append(
        "<joint name='up' type='fixed'><parent link='base_link'/><child link='mast'/>"
        f"<origin xyz='0.03 0 {height}'/></joint>"
    )
    description = load_description(f"<robot name='mast'>{''.join(links + joints)}</robot>")
    base = [VIRTUAL_JOINTS[k] for k in (0, 1, 5)]
    definition = {
        "raw_controller_order": ["base"],
        "default_controllers": {"base": "HolonomicBaseJointController"},
        "base_footprint_link_name": "base_link",
        "holonomic_base": {"force_sphere_wheel_approximation": False},
        "locomotion": {
            "base_joint_names": base,
            "floor_touching_base_link_names": [f"ball{i}" for i in range(4)],
        },
    }
    world = World()
    world.add_plane()
    robot = add_robot(world, description, definition=definition, action_normalize=False)
    world.step(60)
    return robot


def tall_rover(height: float) -> Robot:
    """The rover with as much mass again on top, on two wheels and its caster."""
    registered = REGISTERED_ROBOTS["rover"]
    names = ("left_wheel", "right_wheel", "caster")
    assert registered.definition.locomotion is not None
    block = registered.definition.locomotion.model_copy(update={"floor_touching_base_link_names": names})
    definition = registered.definition.model_copy(update={"locomotion": block})
    world = World()
    world.add_plane()
    description = with_load(registered.description(definition), height)
    robot = add_robot(world, description, definition=definition, action_normalize=False)
    world.step(60)
    return robot


def with_load(description: RobotDescription, height: float) -> RobotDescription:
    """The rover's hull with its mass twice as high up as `height`, so that its mean height is `height`."""
    links = []
    for link in description.links:
        if link.name == "base_link":
            assert link.inertial is not None
            inertial = replace(link.inertial, mass=18.0, origin=Pose(position=(-0.04, 0, height)))
            link = replace(link, inertial=inertial)
        links.append(link)
    return replace(description, links=tuple(links))


@pytest.mark.parametrize(
    ("twist", "change"),
    [
        ((0.75, 0, 2.0), (0, 0, 0)),
        ((0, 0, 3.0), (0, 0, 0)),
        ((0.3, -0.4, -1.5), (0.5, 1.0, 2.0)),
        ((0, 0, 0), (1, -1, 3)),
    ],
)
def test_zmp_shifts_agree_with_inverse_dynamics(twist, change) -> None:
    """Compare with the base moment of MuJoCo's inverse dynamics, with all other joints at rest."""
    robot = floor()
    posture = robot.joint_positions
    posture[[5, 7, 10, 11, 12]] = 0.7, 0.2, 0.5, 0.3, 1.0  # turned, leaning, one arm out
    robot.joint_positions = posture
    robot.joint_arrays.refresh()
    balance = balance_of(robot)
    model, data = robot.world.model, robot.world.data
    dofs = robot.joint_arrays.dofs[:6]
    turn = robot.base_link.pose[1]
    yaw = 2.0 * np.arctan2(turn[2], turn[3])
    axes = np.array([[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]])

    def supported(twist, change) -> np.ndarray:
        """Return the (2,) zero-moment point relative to the base's origin, in its axes (m)."""
        v, a, w = axes @ twist[:2], axes @ change[:2], twist[2]
        data.qvel[:] = data.qacc[:] = 0.0
        data.qvel[dofs[[0, 1, 5]]] = *v, w
        data.qacc[dofs[[0, 1, 5]]] = *(a + w * np.array([-v[1], v[0]])), change[2]
        mujoco.mj_inverse(model, data)
        force = data.qfrc_inverse[dofs]
        moment, height = force[3:5], robot.base_link.pose[0][2]
        return axes.T @ (np.array([-moment[1], moment[0]]) - height * force[:2]) / force[2]

    flags = model.opt.disableflags
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONTACT | mujoco.mjtDisableBit.mjDSBL_ACTUATION)
    shift = supported(np.array(twist), np.array(change)) - supported(np.zeros(3), np.zeros(3))
    model.opt.disableflags = flags
    assert balance.push(np.array(twist, float), np.array(change, float)) == pytest.approx(
        balance.outwards @ shift, abs=1e-3, rel=0.01
    )


@pytest.mark.parametrize(
    "twist", [(0.75, 0, np.pi), (1.5, 0, np.pi), (1.5, 1.5, -np.pi), (0, -1.5, np.pi), (1.5, 0, 1.0)]
)
def test_r1_turns_sharply_at_full_speed_and_stops(twist) -> None:
    robot = floor()
    assert drive(robot, twist, 60) < 0.03
    linear, angular = robot.velocity_in_base
    assert angular[2] / twist[2] > 0.35
    assert linear[:2] == pytest.approx(
        np.array(twist[:2]) * angular[2] / twist[2], abs=0.12
    )  # the same curve
    assert drive(robot, (0, 0, 0), 60) < 0.03


def test_a_stable_curve_is_driven_as_commanded() -> None:
    robot = floor()
    assert drive(robot, (0.5, 0, 1.5), 90) < 0.01
    linear, angular = robot.velocity_in_base
    assert (linear[0], angular[2]) == pytest.approx((0.5, 1.5), rel=0.03)


@pytest.mark.parametrize("height", [1.0, 1.8])
def test_a_tall_narrow_base_stays_upright_under_random_commands(height: float) -> None:
    robot, draw = mast_robot(height), np.random.default_rng(1)
    worst = 0.0
    for _ in range(12):
        worst = max(worst, drive(robot, draw.choice((-1, 0, 1), 3) * robot_speeds(robot), 20))
    assert worst < FALLEN


def robot_speeds(robot: Robot) -> np.ndarray:
    return robot.controllers["base"].limits.velocity


def test_without_acceleration_limits_it_tips_over() -> None:
    robot = floor(controllers={"base": {"max_acceleration": None}})
    assert drive(robot, (1.5, 0, np.pi), 60) > FALLEN


def test_a_tall_rover_takes_curves_slower() -> None:
    robot = tall_rover(0.6)
    for twist in ((1.5, 3.0), (-1.5, 3.0), (0.0, -6.0), (1.5, 0.0), (-1.5, -1.0)):
        assert drive(robot, twist, 40) < FALLEN
