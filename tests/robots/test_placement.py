"""Where `add_robot` puts a robot: its lowest point on the floor, visual shapes included."""

from __future__ import annotations

import numpy as np
import pytest

from roboyard.description.loader import load_description
from roboyard.description.model import RobotDescription
from roboyard.robots import add_robot
from roboyard.robots.placement import lowest_point
from roboyard.scenes import load_scene
from roboyard.sim.world import World

BODY = """<robot name="tall"><link name="base"><inertial><mass value="3"/>
<inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.1"/></inertial>
<collision><origin xyz="0 0 {z}" rpy="{roll} 0 0"/><geometry>{shape}</geometry></collision>
<visual><origin xyz="0 0 {z}"/><geometry><sphere radius="{visual}"/></geometry></visual></link></robot>"""


def robot_of(shape: str, z: float = 0.0, roll: float = 0.0, visual: float = 0.01) -> RobotDescription:
    """Return a robot of one link with a collision shape and a visual sphere."""
    return load_description(BODY.format(shape=shape, z=z, roll=roll, visual=visual))


@pytest.mark.parametrize(
    ("shape", "roll", "reach"),
    [
        ('<box size="0.2 0.4 0.6"/>', 0.3, 0.2 * np.sin(0.3) + 0.3 * np.cos(0.3)),
        ('<sphere radius="0.25"/>', 0.5, 0.25),
        ('<cylinder radius="0.1" length="0.6"/>', 0.7, 0.3 * np.cos(0.7) + 0.1 * np.sin(0.7)),
    ],
)
@pytest.mark.parametrize("z", [-0.4, 0.0, 0.9])
def test_the_lowest_point_is_put_on_the_floor(shape: str, roll: float, reach: float, z: float) -> None:
    """The expected height is by trigonometry."""
    world = World()
    world.add_plane()
    robot = add_robot(world, robot_of(shape, z, roll))
    np.testing.assert_allclose(robot.position, [0.0, 0.0, reach - z], atol=1e-6)
    assert lowest_point(robot) == pytest.approx(0.0, abs=1e-6)


def test_visual_shapes_count_in_a_world_without_them() -> None:
    """The visual sphere is larger than the collision sphere."""
    world = World(visual_geoms=False)
    world.add_plane()
    robot = add_robot(world, robot_of('<sphere radius="0.1"/>', visual=0.15))
    assert robot.position[2] == pytest.approx(0.15, abs=1e-3)  # of the sphere's triangles


def test_a_robot_in_the_air_keeps_its_pose_unless_it_is_asked_down() -> None:
    """A position above the floor is the root frame's, as it is where `on_floor` is False."""
    robot = robot_of('<sphere radius="0.1"/>')
    heights = []
    for z, on_floor in ((0.5, None), (0.5, True), (0.05, None), (0.0, False)):
        world = World()
        world.add_plane()
        heights.append(add_robot(world, robot, (0, 0, z), on_floor=on_floor).position[2])
    np.testing.assert_allclose(heights, [0.5, 0.1, 0.1, 0.0], atol=1e-6)


def test_the_floor_is_found_below_a_robot_that_starts_inside_it() -> None:
    """A ray from the root frame must not stop at the robot's own base, which reaches below the floor."""
    world = World()
    world.add_box((0.5, 0.5, 0.1), (0, 0, 0.15), mass=0.0)
    robot = add_robot(world, robot_of('<box size="0.4 0.4 0.3"/>', -0.1), (0, 0, 0.2))
    assert robot.position[2] == pytest.approx(0.2 + 0.25, abs=1e-6)


def test_a_fixed_robot_is_lifted_in_a_scene_with_sleeping() -> None:
    """In such a scene MuJoCo takes fixed bodies for unmoved; the shapes have to move with the pose."""
    scene = load_scene("tabletop")
    robot = add_robot(scene.world, robot_of('<box size="0.2 0.2 0.2"/>', -0.4), scene.spawn)
    assert robot.body.is_fixed
    scene.world.step(3)
    assert lowest_point(robot) == pytest.approx(scene.spawn[2], abs=1e-6)
    assert robot.body.bounds[1, 2] > 0.19


MOUNTED = """<robot name="arm"><link name="base">{shape}</link>
<link name="l"><inertial><mass value="1"/>
<inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.1"/></inertial>
<collision><origin xyz="0 0 {z}"/><geometry><box size="0.1 0.1 0.4"/></geometry></collision></link>
<joint name="j" type="revolute"><parent link="base"/><child link="l"/><axis xyz="0 0 1"/>
<limit lower="-1" upper="1" effort="9" velocity="1"/></joint></robot>"""
FOOT = '<collision><geometry><box size="0.1 0.1 0.02"/></geometry></collision>'


@pytest.mark.parametrize(
    ("shape", "z", "height"),
    [
        ("", 0.5, 0.0),  # the box begins 0.3 m above a base that is not drawn
        ("", -0.5, 0.7),  # it hangs from its base
        ("", 5.0, -4.8),  # the root frame is no mounting
        (FOOT, 0.5, 0.01),
        (FOOT, -0.5, 0.7),
    ],
)
def test_a_fixed_arm_without_a_drawn_base_stands_on_its_root_frame(
    shape: str, z: float, height: float
) -> None:
    world = World()
    world.add_plane()
    robot = add_robot(world, load_description(MOUNTED.format(shape=shape, z=z)))
    assert robot.position[2] == pytest.approx(height, abs=1e-6)
