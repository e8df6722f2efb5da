"""Sliding, rolling and wedging in a plain world with its default time step, against closed forms."""

import numpy as np
import pytest

from roboyard.description.model import Box, Collision, Inertial, Joint, Link, Pose, RobotDescription, Sphere
from roboyard.sim import World
from roboyard.transforms import quaternion_from_rpy

G = 9.81


def sliding_box(speed: float, mu: float, direction: float = 0.0, **options) -> tuple[World, list[np.ndarray]]:
    world = World(**options)
    world.add_plane(friction=mu)
    box = world.add_box((0.2, 0.2, 0.1), (0, 0, 0.05), friction=mu)
    world.step(240)
    start = box.position.copy()
    box.set_velocity((speed * np.cos(direction), speed * np.sin(direction), 0))
    path = []
    for _ in range(int((speed / (mu * G) + 0.2) / world.timestep)):
        world.step()
        path.append(box.position - start)
    return world, path


@pytest.mark.parametrize("solver", ["newton", "cg"])
@pytest.mark.parametrize("mu", [0.3, 0.5, 1.0])
@pytest.mark.parametrize("speed", [1.0, 2.0, 4.0])
def test_a_sliding_box_stays_on_the_floor_and_stops_where_friction_stops_it(speed, mu, solver):
    world, path = sliding_box(speed, mu, 0.6, solver=solver)
    heights = np.array(path)[:, 2]
    assert heights.max() < 1e-3 and heights.min() > -1e-3
    distance = np.linalg.norm(path[-1][:2])
    # the semi-implicit step is short of half a step's way
    assert distance == pytest.approx(speed**2 / (2 * mu * G) - speed * world.timestep / 2, rel=0.02)


@pytest.mark.parametrize("speed", [2.0, 4.0])
def test_the_boxes_of_a_world_as_large_as_a_pile_stay_on_the_floor(speed: float) -> None:
    """The solver of piles stops early; corrections of what it had found threw boxes up by 33 mm."""
    world = World()
    world.add_plane()
    boxes = [world.add_box((0.1, 0.1, 0.1), (0.5 * i, 0, 0.05)) for i in range(60)]
    world.step(20)
    start = np.array([box.position for box in boxes])
    for box in boxes:
        box.set_velocity((0, speed, 0))
    heights = []
    for _ in range(int((speed / G + 0.2) / world.timestep)):
        world.step()
        heights.append([box.position[2] for box in boxes] - start[:, 2])
    assert world.solver == "cg"
    assert np.max(heights) < 1e-3 and np.min(heights) > -3e-3
    way = np.array([box.position for box in boxes])[:, 1] - start[:, 1]
    np.testing.assert_allclose(way, speed**2 / (2 * G) - speed * world.timestep / 2, rtol=0.02)


def test_a_box_that_lands_sliding_is_not_thrown_up():
    world = World()
    world.add_plane(friction=0.5)
    box = world.add_box((0.2, 0.2, 0.1), (0, 0, 0.10), friction=0.5)
    box.set_velocity((4, 0, 0))
    world.step(int(0.12 / world.timestep))  # falls 5 cm in 0.1 s
    heights = []
    for _ in range(60):
        world.step()
        heights.append(box.position[2])
    assert max(heights) < 0.052


def test_many_steps_at_once_are_the_same_steps():
    single, several = (World(), World())
    for world in (single, several):
        world.add_plane()
        world.add_box((0.2, 0.2, 0.1), (0, 0, 0.05))
        world.bodies[1].set_velocity((2, 1, 0))
    several.step(120)
    for _ in range(120):
        single.step()
    np.testing.assert_array_equal(several.data.qpos, single.data.qpos)


def test_a_sliding_sphere_rolls_at_five_sevenths_of_its_speed():
    world = World()
    world.add_plane(friction=0.5)
    ball = world.add_sphere(0.1, (0, 0, 0.1), friction=0.5)
    world.step(60)
    ball.set_velocity((4, 0, 0))
    heights = []
    for _ in range(int(0.6 / world.timestep)):  # 2/7 v / (mu g) = 0.23 s
        world.step()
        heights.append(ball.position[2])
    linear, angular = ball.velocity
    assert linear[0] == pytest.approx(4 * 5 / 7, rel=0.01)
    assert angular[1] == pytest.approx(linear[0] / 0.1, rel=0.01)
    assert max(heights) < 0.101


@pytest.mark.parametrize("slope", [0.3, 0.6])
def test_a_box_on_a_slope_slides_by_the_excess_over_friction_or_stays(slope):
    mu = 0.5
    world = World()
    turn = quaternion_from_rpy((0, slope, 0))
    down = np.array([np.cos(slope), 0, -np.sin(slope)])
    normal = np.array([np.sin(slope), 0, np.cos(slope)])
    world.add_box((20, 4, 1), tuple(-0.5 * normal), turn, mass=0, friction=mu)
    box = world.add_box((0.2, 0.2, 0.1), tuple(0.05 * normal - 5 * down), turn, friction=mu)
    world.step(24)
    start = box.position.copy()
    speed = float(box.velocity[0] @ down)
    world.step(240)
    way = float((box.position - start) @ down)
    pull = G * (np.sin(slope) - mu * np.cos(slope))
    assert way == pytest.approx(speed + max(pull, 0) / 2, abs=0.02)
    assert float((box.position - start) @ normal) == pytest.approx(0, abs=1e-3)


def test_a_pushed_stack_keeps_its_height():
    world = World()
    world.add_plane(friction=0.4)
    boxes = [world.add_box((0.4, 0.4, 0.2), (0, 0, 0.1 + 0.2 * k), friction=0.4) for k in range(3)]
    world.step(240)
    for box in boxes:
        box.set_velocity((2, 0, 0))
    for _ in range(120):
        world.step()
        assert boxes[2].position[2] == pytest.approx(0.5, abs=1.5e-3)


def test_a_sphere_in_a_wedge_is_carried_by_both_walls():
    world = World()
    tilt, radius = 0.7, 0.2
    for side in (1, -1):
        normal = np.array([-side * np.sin(tilt), 0, np.cos(tilt)])
        world.add_box(
            (4, 4, 1), tuple(-0.5 * normal), quaternion_from_rpy((0, -side * tilt, 0)), mass=0, friction=0.2
        )
    ball = world.add_sphere(radius, (0.0, 0, radius / np.cos(tilt) + 0.02), mass=2.0, friction=0.2)
    world.step(480)
    assert ball.position == pytest.approx([0, 0, radius / np.cos(tilt)], abs=1e-3)
    force = sum((c.normal_force for c in world.contacts(ball)), 0.0)
    assert force * np.cos(tilt) == pytest.approx(2.0 * G, rel=0.15)


def sled() -> RobotDescription:
    """A box with a driven arm, which carries no shape."""
    body = Inertial(mass=1.0, origin=Pose(), inertia=(0.01, 0, 0, 0.01, 0, 0.01))
    base = Link(name="base", inertial=body, collisions=(Collision(geometry=Box(size=(0.2, 0.2, 0.1))),))
    arm = Link(name="arm", inertial=Inertial(mass=0.2, origin=Pose(), inertia=(1e-3, 0, 0, 1e-3, 0, 1e-3)))
    joint = Joint(name="j", type="continuous", parent="base", child="arm", axis=(0.0, 0.0, 1.0))
    return RobotDescription(name="sled", links=(base, arm), joints=(joint,))


@pytest.mark.parametrize("speed", [1.0, 4.0])
def test_a_robot_that_slides_on_its_base_stays_on_the_floor(speed):
    """Also after it was at rest, and after a body came and went."""
    world = World()
    world.add_plane(friction=0.5)
    robot = world.add_urdf(sled(), (0, 0, 0.05))
    robot.links[0].friction = 0.5
    world.step(240)
    start = robot.position.copy()
    for _ in range(2):
        robot.set_velocity((speed, 0, 0))
        heights = []
        for _ in range(int((speed / (0.5 * G) + 0.2) / world.timestep)):
            world.step()
            heights.append(robot.position[2] - start[2])
        assert max(heights) < 1e-3 and min(heights) > -1e-3
        world.remove(world.add_box((0.1, 0.1, 0.1), (0, 9, 0.05)))
    expected = 2 * (speed**2 / (2 * 0.5 * G) - speed * world.timestep / 2)
    assert robot.position[0] - start[0] == pytest.approx(expected, rel=0.02)


def cart() -> RobotDescription:
    wheel = Collision(geometry=Sphere(radius=0.1))
    box = Inertial(mass=20.0, inertia=(0.3, 0.0, 0.0, 0.6, 0.0, 0.8))
    round_ = Inertial(mass=1.0, inertia=(0.005, 0.0, 0.0, 0.005, 0.0, 0.005))
    places = [(x, y) for x in (0.25, -0.25) for y in (0.3, -0.3)]
    return RobotDescription(
        name="cart",
        links=(
            Link(name="base", inertial=box),
            *(Link(name=f"wheel_{k}", inertial=round_, collisions=(wheel,)) for k in range(4)),
        ),
        joints=tuple(
            Joint(name=f"axle_{k}", type="continuous", parent="base", child=f"wheel_{k}", axis=(0, 1, 0),
                  origin=Pose(position=(*place, 0.0)))
            for k, place in enumerate(places)
        ),
    )  # fmt: skip


@pytest.mark.parametrize("speed", [1.0, 2.0])
def test_wheels_that_slide_sideways_stay_on_the_floor(speed: float) -> None:
    world = World()
    world.add_plane()  # friction 1, as that of the wheels
    body = world.add_description(cart(), (0, 0, 0.1), drives=False)
    world.step(240)
    low, start = float(body.position[2]), float(body.position[1])
    body.set_velocity((0, speed, 0))
    heights = []
    for _ in range(int((speed / G + 0.2) / world.timestep)):
        world.step()
        heights.append(float(body.position[2]))
    assert max(heights) - low < 1e-3
    assert body.position[1] - start == pytest.approx(speed**2 / (2 * G), abs=speed * world.timestep)
