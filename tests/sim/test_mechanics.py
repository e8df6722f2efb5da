"""Bodies of a world against closed forms of classical mechanics."""

from __future__ import annotations

import numpy as np
import pytest

from roboyard.description.model import (
    Box,
    Collision,
    Inertial,
    Joint,
    Limit,
    Link,
    Mimic,
    Pose,
    RobotDescription,
    Sphere,
)
from roboyard.errors import RoboyardError
from roboyard.sim import World
from roboyard.sim.physics_profile import BULLET
from roboyard.transforms import multiply, quaternion_from_axis_angle, rotate

G = 9.81
STEP = 1 / 1000


def weightless(**options) -> World:
    return World(gravity=(0, 0, 0), timestep=STEP, **options)


def point(name: str, mass: float, moment: float = 1e-3, **extra) -> Link:
    return Link(name=name, inertial=Inertial(mass=mass, inertia=(moment, 0, 0, moment, 0, moment)), **extra)


def on_one_joint(joint: Joint, mass: float = 2.0, moment: float = 0.5) -> RobotDescription:
    return RobotDescription(
        name="stand", links=(Link(name="base"), point("load", mass, moment)), joints=(joint,)
    )


def energy(world: World, bodies) -> float:
    """Kinetic and potential energy (J) of single bodies of isotropic inertia, from their public state."""
    total = 0.0
    for body, mass, moment in bodies:
        linear, angular = body.velocity
        total += 0.5 * mass * linear @ linear + 0.5 * moment * angular @ angular
        total -= mass * world.gravity @ body.position
    return total


# ----------------------------------------------------------------------------------------- free bodies


@pytest.mark.parametrize("velocity", [(3.0, 0.0, 4.0), (-1.0, 2.0, 0.0), (0.0, 0.0, -5.0)])
def test_a_thrown_body_follows_its_parabola(velocity: tuple[float, float, float]) -> None:
    world = World(timestep=STEP)
    ball = world.add_sphere(0.1, mass=0.5, position=(0, 0, 10))
    ball.set_velocity(velocity)
    world.step(500)
    t = world.time
    expected = np.array([0, 0, 10.0]) + np.array(velocity) * t - np.array([0, 0, 0.5 * G * t * t])
    np.testing.assert_allclose(ball.position, expected, atol=0.5 * G * t * STEP + 1e-9)


def test_gravity_may_point_anywhere_and_change() -> None:
    world = weightless()
    ball = world.add_sphere(0.1, mass=1.0)
    world.gravity = (1.0, -2.0, 0.0)
    world.step(1000)
    np.testing.assert_allclose(ball.velocity[0], [1.0, -2.0, 0.0], atol=1e-9)
    world.gravity = (0.0, 0.0, 0.0)
    world.step(100)
    np.testing.assert_allclose(ball.velocity[0], [1.0, -2.0, 0.0], atol=1e-9)


def test_a_spinning_cube_turns_by_rate_times_time() -> None:
    world = weightless()
    cube = world.add_box((0.2, 0.2, 0.2), mass=1.0)
    spin = np.array([0.3, -0.8, 1.1])
    cube.set_velocity((0, 0, 0), spin)
    world.step(1500)
    angle = np.linalg.norm(spin) * world.time
    expected = quaternion_from_axis_angle(spin / np.linalg.norm(spin), angle)
    assert abs(cube.orientation @ expected) == pytest.approx(1.0, abs=1e-6)


def test_a_free_top_keeps_its_angular_momentum_and_energy() -> None:
    world = weightless()
    size, mass = np.array([0.3, 0.2, 0.1]), 2.0
    moments = (
        mass
        / 12
        * np.array([size[1] ** 2 + size[2] ** 2, size[0] ** 2 + size[2] ** 2, size[0] ** 2 + size[1] ** 2])
    )
    top = world.add_box(tuple(size), mass=mass)
    top.set_velocity((0, 0, 0), (0.2, 3.0, 0.1))  # about the middle axis: it tumbles

    def state() -> tuple[np.ndarray, float]:
        turn = top.orientation
        inverse = turn * np.array([-1, -1, -1, 1])
        own = rotate(inverse, top.velocity[1])
        return rotate(turn, moments * own), 0.5 * float(own @ (moments * own))

    before = state()
    world.step(4000)
    after = state()
    np.testing.assert_allclose(after[0], before[0], rtol=0.02, atol=0.01 * np.linalg.norm(before[0]))
    assert after[1] == pytest.approx(before[1], rel=0.02)


def test_a_box_has_the_moments_of_a_solid_cuboid() -> None:
    world = weightless()
    size, mass = (0.4, 0.6, 1.0), 3.0
    box = world.add_box(size, mass=mass)
    for axis in range(3):
        torque = np.zeros(3)
        torque[axis] = 0.7
        box.set_pose((0, 0, 0), (0, 0, 0, 1))
        box.set_velocity((0, 0, 0), (0, 0, 0))
        box.links[0].apply_wrench(torque=torque)
        world.step()
        u, v = (size[k] for k in range(3) if k != axis)
        assert box.velocity[1][axis] == pytest.approx(0.7 * STEP / (mass / 12 * (u * u + v * v)), rel=1e-6)


@pytest.mark.parametrize("make", ["sphere", "cylinder", "capsule"])
def test_round_bodies_have_the_moments_of_their_solids(make: str) -> None:
    world = weightless()
    radius, length, mass = 0.3, 0.8, 2.0
    if make == "sphere":
        body, expected = world.add_sphere(radius, mass=mass), 0.4 * mass * radius**2
    elif make == "cylinder":
        body, expected = world.add_cylinder(radius, length, mass=mass), 0.5 * mass * radius**2
    else:
        body = world.add_capsule(radius, length, mass=mass)
        tube, caps = np.pi * radius**2 * length, 4 / 3 * np.pi * radius**3
        part = mass / (tube + caps)
        expected = part * (0.5 * tube + 0.4 * caps) * radius**2
    body.links[0].apply_wrench(torque=(0, 0, 1.0))
    world.step()
    assert body.velocity[1][2] == pytest.approx(STEP / expected, rel=1e-6)


# ------------------------------------------------------------------------------------ forces, impulses


def test_a_force_beside_the_centre_pushes_and_turns() -> None:
    world = weightless()
    ball = world.add_sphere(0.5, mass=2.0)
    force, at = np.array([0.0, 4.0, 0.0]), np.array([0.3, 0.0, 0.0])
    ball.links[0].apply_wrench(force=force, point=at)
    world.step()
    np.testing.assert_allclose(ball.velocity[0], force / 2.0 * STEP, atol=1e-12)
    np.testing.assert_allclose(ball.velocity[1], np.cross(at, force) / (0.4 * 2.0 * 0.25) * STEP, atol=1e-9)


def test_a_local_force_turns_with_the_link() -> None:
    world = weightless()
    turn = quaternion_from_axis_angle((0, 0, 1), np.pi / 2)
    box = world.add_box((0.2, 0.2, 0.2), mass=1.0, orientation=turn)
    box.links[0].apply_wrench(force=(1.0, 0, 0), local=True)
    world.step()
    np.testing.assert_allclose(box.velocity[0], [0.0, STEP, 0.0], atol=1e-9)


def test_forces_of_one_step_add_up() -> None:
    world = weightless()
    ball = world.add_sphere(0.1, mass=1.0)
    for force in ((1.0, 0, 0), (0, 2.0, 0), (-1.0, 0, 3.0)):
        ball.links[0].apply_wrench(force=force)
    world.step()
    np.testing.assert_allclose(ball.velocity[0] / STEP, [0.0, 2.0, 3.0], atol=1e-9)


def test_equal_and_opposite_forces_leave_the_centre_of_mass_at_rest() -> None:
    world = weightless()
    a = world.add_sphere(0.1, mass=1.0, position=(-1, 0, 0))
    b = world.add_sphere(0.1, mass=3.0, position=(1, 0, 0))
    for _ in range(200):
        a.links[0].apply_wrench(force=(0, 1.5, 0))
        b.links[0].apply_wrench(force=(0, -1.5, 0))
        world.step()
    momentum = 1.0 * a.velocity[0] + 3.0 * b.velocity[0]
    np.testing.assert_allclose(momentum, 0.0, atol=1e-9)
    assert a.velocity[0][1] == pytest.approx(1.5 * world.time, rel=1e-6)


@pytest.mark.parametrize(("m1", "m2"), [(1.0, 1.0), (1.0, 4.0), (5.0, 0.5)])
def test_a_collision_keeps_momentum_and_bounces_by_the_product_of_coefficients(m1: float, m2: float) -> None:
    world = weightless()
    e, speed = 0.6, 1.0
    a = world.add_sphere(0.1, mass=m1, position=(0, 0, 0))
    b = world.add_sphere(0.1, mass=m2, position=(0.35, 0, 0))
    for ball in (a, b):
        ball.links[0].restitution = e
    a.set_velocity((speed, 0, 0))
    world.step(600)
    v1, v2 = a.velocity[0][0], b.velocity[0][0]
    assert m1 * v1 + m2 * v2 == pytest.approx(m1 * speed, rel=1e-6)
    assert v2 - v1 == pytest.approx(e**2 * speed, rel=0.01)  # a pair bounces by the product of both


# -------------------------------------------------------------------------------------------- friction


@pytest.mark.parametrize(("angle", "mu"), [(0.2, 0.5), (0.35, 0.6)])
def test_a_block_holds_on_a_slope_below_the_friction_angle(angle: float, mu: float) -> None:
    block = _block_on_slope(angle, mu)
    block[0].step(1000)
    assert np.linalg.norm(block[1].velocity[0]) < 0.02


@pytest.mark.parametrize(("angle", "mu"), [(0.5, 0.2), (0.7, 0.4)])
def test_a_block_slides_down_a_slope_at_the_expected_rate(angle: float, mu: float) -> None:
    world, block = _block_on_slope(angle, mu)
    world.step(200)
    start, begin = np.linalg.norm(block.velocity[0]), world.time
    world.step(400)
    rate = (np.linalg.norm(block.velocity[0]) - start) / (world.time - begin)
    assert rate == pytest.approx(G * (np.sin(angle) - mu * np.cos(angle)), rel=0.06)


def _block_on_slope(angle: float, mu: float):
    """Gravity leans instead of the floor; x points downhill."""
    world = World(gravity=(G * np.sin(angle), 0, -G * np.cos(angle)), timestep=STEP)
    floor = world.add_plane()
    block = world.add_box((0.4, 0.4, 0.1), mass=2.0, position=(0, 0, 0.05))
    for body in (floor, block):
        body.links[0].friction = mu
    return world, block


def test_a_sphere_rolls_down_a_slope_by_five_sevenths() -> None:
    angle = 0.2
    world = World(gravity=(G * np.sin(angle), 0, -G * np.cos(angle)), timestep=STEP)
    world.add_plane().links[0].friction = 1.0
    ball = world.add_sphere(0.2, mass=1.0, position=(0, 0, 0.2))
    ball.links[0].friction = 1.0
    world.step(1000)
    assert ball.velocity[0][0] == pytest.approx(5 / 7 * G * np.sin(angle) * world.time, rel=0.03)
    assert ball.velocity[1][1] * 0.2 == pytest.approx(ball.velocity[0][0], rel=0.03)


def test_the_floor_carries_the_mass_of_a_stack() -> None:
    world = World(timestep=STEP)
    floor = world.add_plane()
    masses = (3.0, 2.0, 1.0)
    for k, mass in enumerate(masses):
        world.add_box((0.4, 0.4, 0.2), mass=mass, position=(0, 0, 0.1 + 0.2 * k))
    world.step(1500)
    force = sum(c.normal_force for c in world.contacts(floor))
    assert force == pytest.approx(sum(masses) * G, rel=0.01)


# ---------------------------------------------------------------------------------------------- joints


def test_a_prismatic_load_falls_freely_and_its_damping_sets_the_final_speed() -> None:
    slide = Joint(name="slide", type="prismatic", parent="base", child="load", axis=(0, 0, 1))
    world = World(timestep=STEP)
    body = world.add_description(on_one_joint(slide, mass=2.0), fixed_base=True, drives=False)
    body.joint("slide").damping = 10.0
    world.step(3000)
    assert body.joint("slide").velocity == pytest.approx(-2.0 * G / 10.0, rel=1e-3)


def test_a_damped_hinge_slows_exponentially() -> None:
    hinge = Joint(name="hinge", type="continuous", parent="base", child="load", axis=(0, 0, 1))
    world = weightless()
    body = world.add_description(on_one_joint(hinge, moment=0.5), fixed_base=True, drives=False)
    body.joint("hinge").damping = 0.8
    body.joint("hinge").velocity = 3.0
    world.step(1000)
    assert body.joint("hinge").velocity == pytest.approx(3.0 * np.exp(-0.8 / 0.5 * world.time), rel=5e-3)


def test_armature_adds_to_the_inertia_of_a_hinge() -> None:
    hinge = Joint(name="hinge", type="continuous", parent="base", child="load", axis=(0, 0, 1))
    speeds = []
    for armature in (0.0, 0.5):
        world = weightless()
        body = world.add_description(on_one_joint(hinge, moment=0.5), fixed_base=True)
        body.joint("hinge").armature = armature
        body.joint("hinge").drive_effort(1.0)
        world.step(100)
        speeds.append(body.joint("hinge").velocity)
    assert speeds[0] == pytest.approx(2 * speeds[1], rel=1e-3)


def test_masses_set_at_run_time_equal_those_set_before() -> None:
    """All that MuJoCo derives from masses, without a new compilation; pooled rows do not count."""
    hinge = Joint(name="hinge", type="continuous", parent="base", child="load", axis=(0, 0, 1))
    links = (point("base", 1.0, 0.25), point("load", 1.0, 0.5))
    new = Inertial(mass=3.0, inertia=(0.7, 0, 0, 0.6, 0, 0.5))
    worlds = []
    for live in (True, False):
        world = weightless()
        body = world.add_description(RobotDescription(name="pair", links=links, joints=(hinge,)))
        world.add_sphere(0.1, mass=0.5, position=(2, 0, 0))
        if live:
            body.set_velocity((0.5, 0.0, 0.0), (0.0, 0.0, 1.0))
            world.step()
        compiled = world.live_model if live else None
        body.link("load").set_inertial(new)
        assert compiled is None or world.live_model is compiled
        speed = body.link("load").com_velocity[0]
        assert not live or speed == pytest.approx((0.5, 0.0, 0.0), abs=1e-2)
        world.step()
        worlds.append(world)
    running, fresh = (world.model for world in worlds)
    for name in ("body_mass", "body_inertia", "body_subtreemass", "body_invweight0", "dof_M0"):
        np.testing.assert_allclose(getattr(running, name), getattr(fresh, name), rtol=1e-9, err_msg=name)
    np.testing.assert_allclose(running.dof_invweight0, fresh.dof_invweight0, rtol=1e-9)
    assert running.stat.meaninertia == pytest.approx(fresh.stat.meaninertia)


def test_a_new_centre_of_mass_or_no_mass_compiles_again() -> None:
    world = weightless()
    body = world.add_box((0.2, 0.2, 0.2), (0, 0, 1))
    world.step()
    moved = Inertial(mass=2.0, origin=Pose(position=(0.05, 0, 0)), inertia=(0.1, 0, 0, 0.1, 0, 0.1))
    body.links[0].set_inertial(moved)
    world.step()
    np.testing.assert_array_equal(world.model.body_ipos[body.mujoco_ids[0]], (0.05, 0, 0))
    assert world.model.body_simple[body.mujoco_ids[0]] == 0


def test_totals_are_right_where_a_body_of_another_mass_is_removed() -> None:
    world = weightless()
    boxes = [world.add_box((0.2, 0.2, 0.2), (k, 0, 1), mass=1.0) for k in range(4)]
    world.step()
    boxes[1].links[0].set_inertial(Inertial(mass=5.0, inertia=(0.1, 0, 0, 0.1, 0, 0.1)))
    world.step()
    world.remove(boxes[1])
    world.step()
    assert world.live_model.body_subtreemass[0] == pytest.approx(3.0)


def test_effort_on_a_hinge_reacts_on_a_free_base() -> None:
    hinge = Joint(name="hinge", type="continuous", parent="base", child="load", axis=(0, 0, 1))
    links = (point("base", 1.0, 0.25), point("load", 1.0, 0.5))
    world = weightless()
    body = world.add_description(RobotDescription(name="pair", links=links, joints=(hinge,)))
    body.joint("hinge").drive_effort(0.3)
    world.step(500)
    base, load = body.link("base").velocity[1][2], body.link("load").velocity[1][2]
    assert 0.25 * base + 0.5 * load == pytest.approx(0.0, abs=1e-6)
    assert load == pytest.approx(0.3 / 0.5 * world.time, rel=1e-3)


@pytest.mark.parametrize(("multiplier", "offset"), [(2.0, 0.1), (-0.5, 0.0), (1.0, -0.3)])
def test_a_mimic_joint_keeps_its_ratio_while_its_leader_moves(multiplier: float, offset: float) -> None:
    def hinge(name: str, child: str, mimic: Mimic | None = None) -> Joint:
        return Joint(name=name, type="revolute", parent="base", child=child, axis=(0, 0, 1), mimic=mimic,
                     limit=Limit(lower=-3, upper=3, effort=10, velocity=5))  # fmt: skip

    links = (Link(name="base"), point("a", 1.0, 0.1), point("b", 1.0, 0.1))
    joints = (
        hinge("leader", "a"),
        hinge("follower", "b", Mimic(joint="leader", multiplier=multiplier, offset=offset)),
    )
    world = weightless()
    body = world.add_description(RobotDescription(name="pair", links=links, joints=joints), fixed_base=True)
    body.joint("leader").drive_position(0.8)
    world.step(2000)
    leader, follower = body.joint("leader").position, body.joint("follower").position
    assert leader == pytest.approx(0.8, abs=0.02)
    assert follower == pytest.approx(multiplier * leader + offset, abs=0.02)


@pytest.mark.parametrize("bound", [0.5, 1.2])
def test_a_driven_joint_stops_at_the_limit_that_was_set(bound: float) -> None:
    hinge = Joint(name="hinge", type="revolute", parent="base", child="load", axis=(0, 0, 1),
                  limit=Limit(lower=-2, upper=2, effort=5, velocity=5))  # fmt: skip
    world = weightless()
    body = world.add_description(on_one_joint(hinge), fixed_base=True)
    body.joint("hinge").set_limits(-bound, bound)
    body.joint("hinge").drive_effort(2.0)
    world.step(4000)
    assert body.joint("hinge").position == pytest.approx(bound, abs=0.03)


def test_a_limit_that_was_removed_has_no_place_once_bodies_come() -> None:
    hinge = Joint(name="hinge", type="revolute", parent="base", child="load", axis=(0, 0, 1),
                  limit=Limit(lower=-0.2, upper=0.2, effort=5, velocity=5))  # fmt: skip
    world = World(profile=BULLET)
    body = world.add_description(on_one_joint(hinge), fixed_base=True)
    world.motors.set(body.joints[0], velocity=1.0, max_impulse=1.0)
    world.step()
    in_turn = world.stepping.in_turn
    assert [len(parts.limits) for parts in (in_turn._parts or {}).values()] == [1]
    body.joints[0].set_limits(1.0, -1.0)
    in_turn.note_bodies()
    world.step()
    assert [(len(parts.limits), len(parts.motors)) for parts in (in_turn._parts or {}).values()] == [(0, 1)]


def test_limits_can_be_removed_and_only_of_joints_that_have_them() -> None:
    hinge = Joint(name="hinge", type="revolute", parent="base", child="load", axis=(0, 0, 1),
                  limit=Limit(lower=-0.2, upper=0.2, effort=5, velocity=5))  # fmt: skip
    world = weightless()
    body = world.add_description(on_one_joint(hinge), fixed_base=True)
    body.joint("hinge").set_limits(1.0, -1.0)
    body.joint("hinge").drive_effort(2.0)
    world.step(1500)
    assert body.joint("hinge").position > 1.0
    fixed = Joint(name="weld", type="fixed", parent="base", child="load")
    other = world.add_description(on_one_joint(fixed), fixed_base=True)
    with pytest.raises(RoboyardError, match="weld"):
        other.joint("weld").set_limits(-1, 1)


def test_an_applied_effort_is_what_holds_the_load() -> None:
    slide = Joint(name="lift", type="prismatic", parent="base", child="load", axis=(0, 0, 1),
                  limit=Limit(lower=-1, upper=1, effort=500, velocity=5))  # fmt: skip
    world = World(timestep=STEP)
    body = world.add_description(on_one_joint(slide, mass=3.0), fixed_base=True)
    body.joint("lift").drive_position(0.2)
    world.step(3000)
    assert body.joint("lift").applied_effort == pytest.approx(3.0 * G, rel=1e-2)


# ------------------------------------------------------------------------------------ poses and bounds


def test_links_of_a_turned_body_move_as_one_rigid_frame() -> None:
    offset = Pose(position=(0.3, -0.2, 0.5))
    joint = Joint(name="weld", type="fixed", parent="base", child="load", origin=offset)
    world = weightless()
    body = world.add_description(
        RobotDescription(name="pair", links=(point("base", 1.0), point("load", 1.0)), joints=(joint,))
    )
    turn = quaternion_from_axis_angle(np.array([1.0, 2.0, 3.0]) / np.sqrt(14), 0.9)
    body.set_pose((1.0, 2.0, 3.0), turn)
    position, orientation = body.link("load").pose
    np.testing.assert_allclose(
        position, np.array([1.0, 2.0, 3.0]) + rotate(turn, offset.position), atol=1e-12
    )
    assert abs(orientation @ turn) == pytest.approx(1.0)


def test_velocity_of_a_point_away_from_the_centre_includes_the_spin() -> None:
    joint = Joint(name="weld", type="fixed", parent="base", child="load", origin=Pose(position=(0.5, 0, 0)))
    world = weightless()
    body = world.add_description(
        RobotDescription(name="pair", links=(point("base", 1.0), point("load", 1.0)), joints=(joint,))
    )
    body.set_velocity((0.1, 0.2, 0.3), (0, 0, 2.0))
    base, load = body.link("base").velocity, body.link("load").velocity
    np.testing.assert_allclose(load[0] - base[0], np.cross([0, 0, 2.0], [0.5, 0, 0]), atol=1e-9)
    np.testing.assert_allclose(load[1], base[1], atol=1e-12)


@pytest.mark.parametrize("angle", [0.0, 0.4, np.pi / 4, 1.3])
def test_bounds_of_a_turned_box_are_those_of_its_corners(angle: float) -> None:
    world = weightless()
    size = np.array([0.6, 0.2, 0.4])
    turn = multiply(quaternion_from_axis_angle((0, 0, 1), angle), quaternion_from_axis_angle((1, 0, 0), 0.3))
    box = world.add_box(tuple(size), mass=1.0, position=(1, -1, 2), orientation=turn)
    signs = np.array(np.meshgrid([-1, 1], [-1, 1], [-1, 1])).reshape(3, -1).T
    corners = np.array([1, -1, 2]) + rotate(turn, 0.5 * size * signs)
    np.testing.assert_allclose(box.bounds, [corners.min(axis=0), corners.max(axis=0)], atol=1e-9)


def test_the_centre_of_mass_is_the_mean_of_the_links_by_mass() -> None:
    joint = Joint(name="weld", type="fixed", parent="base", child="load", origin=Pose(position=(1.0, 0, 0)))
    links = (point("base", 1.0), point("load", 3.0))
    world = weightless()
    body = world.add_description(RobotDescription(name="pair", links=links, joints=(joint,)))
    body.set_pose((0, 5.0, 0), (0, 0, 0, 1))
    np.testing.assert_allclose(body.center_of_mass, [0.75, 5.0, 0.0], atol=1e-12)
    assert body.mass == pytest.approx(4.0)


def test_energy_of_a_bouncing_ball_never_grows() -> None:
    world = World(timestep=STEP)
    world.add_plane().links[0].restitution = 0.8
    ball = world.add_sphere(0.1, mass=0.5, position=(0, 0, 1.0))
    ball.links[0].restitution = 0.8
    found = []
    for _ in range(150):
        world.step(20)
        found.append(energy(world, [(ball, 0.5, 0.4 * 0.5 * 0.01)]))
    assert max(np.diff(found)) < 0.02 * found[0]
    assert found[-1] < 0.5 * found[0]


# ------------------------------------------------------------------------------------- collision masks


def bar(name: str, at: float) -> RobotDescription:
    shape = Collision(geometry=Sphere(radius=0.2))
    return RobotDescription(name=name, links=(point(name, 1.0, 0.02, collisions=(shape,)),), joints=())


def test_bodies_pass_through_where_their_pair_is_switched_off() -> None:
    world = weightless()
    a = world.add_description(bar("a", 0.0))
    b = world.add_description(bar("b", 0.0), position=(0.5, 0, 0))
    a.set_velocity((1.0, 0, 0))
    world.filters.set(a.links[0], b.links[0], collide=False)
    world.step(1000)
    assert a.velocity[0][0] == pytest.approx(1.0) and np.allclose(b.velocity[0], 0.0)


def test_boxes_of_one_link_collide_as_one_body() -> None:
    shapes = tuple(
        Collision(geometry=Box(size=(0.2, 0.2, 0.2)), origin=Pose(position=(x, 0, 0))) for x in (-0.3, 0.3)
    )
    dumbbell = RobotDescription(
        name="dumbbell", links=(point("bar", 2.0, 0.1, collisions=shapes),), joints=()
    )
    world = World(timestep=STEP)
    floor = world.add_plane()
    body = world.add_description(dumbbell, position=(0, 0, 0.12))
    world.step(800)
    assert body.position[2] == pytest.approx(0.1, abs=2e-3)
    assert sum(c.normal_force for c in world.contacts(floor)) == pytest.approx(2.0 * G, rel=0.01)
