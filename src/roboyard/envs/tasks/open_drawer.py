"""OpenDrawer: the arm pulls a drawer open by its handle."""

from __future__ import annotations

import numpy as np

from roboyard.description.model import (
    RGBA,
    Box,
    Collision,
    Inertial,
    Joint,
    Limit,
    Link,
    Material,
    Pose,
    RobotDescription,
    Visual,
)
from roboyard.envs.env_arrays import EnvArrays
from roboyard.envs.random_rows import RandomRows, Rows
from roboyard.envs.randomization import Randomization
from roboyard.envs.task import Reward, Task
from roboyard.envs.tasks.robots import arm_actions, arm_name, place_robot
from roboyard.envs.tasks.table import Table, find_table, start_above
from roboyard.robots.robot import Robot
from roboyard.sim.body import Body
from roboyard.sim.world import World
from roboyard.transforms import Array

TRAVEL = 0.2
"""Largest opening (m)."""
OPEN = 0.12
"""Opening at which the drawer counts as open (m)."""
HANDLE = 0.06
"""Distance of the handle's bar from the front (m)."""
WOOD: RGBA = (0.72, 0.55, 0.38, 1.0)
METAL: RGBA = (0.55, 0.57, 0.6, 1.0)


def open_drawer(
    *,
    robot: str = "r1",
    arm: str = "default",
    control: str = "tip",
    limit: int = 150,
    randomize: tuple[Randomization, ...] = (),
) -> Task:
    """Return the task of pulling a drawer open.

    Args:
        robot: registered or bundled name, or a file, of a robot with an arm.
        arm: its name; the first by default.
        control: "tip", "pose" or "joints".
        limit: control steps of an episode.
        randomize: what differs from episode to episode.
    """
    place = Table()

    def build(world: World) -> dict[str, Robot | Body]:
        nonlocal place
        world.add_plane()
        added = place_robot(world, robot)
        name = arm_name(added, arm)
        place = find_table(added, name)
        start_above(added, name, place, height=0.12)
        x, y, z = place.at(0.0, 0.0)
        cabinet = world.add_description(drawer(), (x + HANDLE + 0.05, y, z), fixed_base=True)
        return {"robot": added, "drawer": cabinet}

    def start(env: EnvArrays, rows: Rows, random: RandomRows) -> None:
        env.body("drawer").set_joints(rows, random.uniform(0.0, 0.02, 1))

    def opening(env: EnvArrays) -> Array:
        return env.body("drawer").q[:, 0]

    def to_handle(env: EnvArrays) -> Array:
        return env.body("drawer").link("handle").position - env.robot.tip(arm).position

    def progress(env: EnvArrays) -> Array:
        return np.clip(opening(env) / OPEN, 0.0, 1.0)

    return Task(
        build=build,
        actions=lambda added: arm_actions(added, arm_name(added, arm), control, gripper=True, holds=False),
        observations={
            "proprio": {"q": lambda env: env.robot.q, "v": lambda env: 0.1 * env.robot.v},
            "state": {
                "to_handle": lambda env: env.robot.base.to_local(to_handle(env)),
                "opening": opening,
                "speed": lambda env: env.body("drawer").v[:, 0],
            },
        },
        rewards={
            "reach": Reward(
                function=lambda env: np.exp(-np.linalg.norm(to_handle(env), axis=1) / 0.1), weight=0.5
            ),
            "open": Reward(function=progress, weight=2.0),
            "effort": Reward(function=lambda env: (env.action**2).sum(axis=1), weight=-0.005),
        },
        success=lambda env: opening(env) > OPEN,
        reset=[start],
        randomize=randomize,
        limit=limit,
    )


def drawer() -> RobotDescription:
    """Return a cabinet with one drawer that opens along -x, and a handle on its front.

    The root frame is in the middle of the front, level with the handle.
    """
    wall = 0.015
    depth, width, height = 0.3, 0.3, 0.16
    cabinet = [
        ((depth, width + 2 * wall, wall), (depth / 2, 0.0, height / 2 + wall / 2)),
        ((depth, width + 2 * wall, wall), (depth / 2, 0.0, -height / 2 - wall / 2)),
        ((depth, wall, height), (depth / 2, width / 2 + wall / 2, 0.0)),
        ((depth, wall, height), (depth / 2, -width / 2 - wall / 2, 0.0)),
        ((wall, width + 2 * wall, height + 2 * wall), (depth + wall / 2, 0.0, 0.0)),
    ]
    gap = 0.006
    inner, tall = width - 2 * gap, height - 2 * gap
    box = [
        ((wall, inner, tall), (-wall / 2, 0.0, 0.0)),
        ((depth - 2 * gap, inner, 0.008), (depth / 2 - gap, 0.0, -tall / 2 + 0.004)),
        ((depth - 2 * gap, 0.008, tall * 0.7), (depth / 2 - gap, inner / 2 - 0.004, -0.1 * tall)),
        ((depth - 2 * gap, 0.008, tall * 0.7), (depth / 2 - gap, -inner / 2 + 0.004, -0.1 * tall)),
    ]
    bar = [
        ((0.014, 0.14, 0.014), (0.0, 0.0, 0.0)),
        ((HANDLE, 0.012, 0.012), (HANDLE / 2, 0.064, 0.0)),
        ((HANDLE, 0.012, 0.012), (HANDLE / 2, -0.064, 0.0)),
    ]
    inertia = (0.01, 0.0, 0.0, 0.01, 0.0, 0.01)
    links = (
        _link("cabinet", cabinet, WOOD, Inertial(mass=10.0, inertia=(0.3, 0.0, 0.0, 0.3, 0.0, 0.3))),
        _link("drawer", box, WOOD, Inertial(mass=1.0, inertia=inertia)),
        _link("handle", bar, METAL, Inertial(mass=0.1, inertia=(1e-4, 0.0, 0.0, 1e-4, 0.0, 1e-4))),
    )
    joints = (
        Joint(
            name="slide",
            type="prismatic",
            parent="cabinet",
            child="drawer",
            axis=(-1.0, 0.0, 0.0),
            limit=Limit(lower=0.0, upper=TRAVEL, effort=100.0, velocity=2.0),
            damping=2.0,
            friction=1.0,
        ),
        Joint(
            name="handle_mount",
            type="fixed",
            parent="drawer",
            child="handle",
            origin=Pose(position=(-HANDLE - wall, 0.0, 0.0)),
        ),
    )
    return RobotDescription(name="drawer", links=links, joints=joints)


def _link(
    name: str,
    boxes: list[tuple[tuple[float, float, float], tuple[float, float, float]]],
    rgba: RGBA,
    inertial: Inertial,
) -> Link:
    shapes = [(Box(size=size), Pose(position=place)) for size, place in boxes]
    return Link(
        name=name,
        inertial=inertial,
        visuals=tuple(
            Visual(geometry=box, origin=pose, material=Material(rgba=rgba)) for box, pose in shapes
        ),
        collisions=tuple(Collision(geometry=box, origin=pose) for box, pose in shapes),
    )
