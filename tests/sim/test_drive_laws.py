"""Drives, motors and collision masks against closed forms."""

from __future__ import annotations

import numpy as np
import pytest
from sim_robots import arm, pendulum, rod

from roboyard.description.model import (
    Box,
    Collision,
    Inertial,
    Joint,
    Limit,
    Link,
    Pose,
    RobotDescription,
)
from roboyard.errors import RoboyardError
from roboyard.sim import World
from roboyard.sim.joint import Joint as JointHandle
from roboyard.sim.physics_profile import BULLET

STEP = 1 / 2000
MASS, INERTIA = 2.0, 0.5


def one_joint(kind: str = "revolute", limit: Limit | None = None, **joint) -> RobotDescription:
    load = Link(name="load", inertial=Inertial(mass=MASS, inertia=(INERTIA, 0, 0, INERTIA, 0, INERTIA)))
    axis = (0, 0, 1) if kind == "prismatic" else (0, 1, 0)
    return RobotDescription(
        name="stand",
        links=(Link(name="base"), load),
        joints=(Joint(name="j", type=kind, parent="base", child="load", axis=axis, limit=limit, **joint),),  # type: ignore[arg-type]
    )


def stand(
    kind: str = "continuous", gravity: float = 0.0, limit: Limit | None = None
) -> tuple[World, JointHandle]:
    world = World(gravity=(0, 0, -gravity), timestep=STEP)
    return world, world.add_urdf(one_joint(kind, limit), fixed_base=True).joint("j")


def run(world: World, joint: JointHandle, seconds: float) -> np.ndarray:
    """(n, 2) positions and velocities after each step."""
    rows = []
    for _ in range(round(seconds / STEP)):
        world.step()
        rows.append((joint.position, joint.velocity))
    return np.array(rows)


@pytest.mark.parametrize("damping_ratio", [0.1, 0.5, 1.0, 2.0])
@pytest.mark.parametrize("kind", ["continuous", "prismatic"])
def test_a_position_drive_is_a_damped_oscillator(damping_ratio: float, kind: str) -> None:
    world, joint = stand(kind)
    inertia = MASS if kind == "prismatic" else INERTIA
    stiffness, target = 50.0, 0.3
    rate = np.sqrt(stiffness / inertia)
    joint.drive_position(
        target, stiffness=stiffness, damping=2 * damping_ratio * np.sqrt(stiffness * inertia)
    )
    times = STEP * np.arange(1, 1001)
    roots = np.roots([1, 2 * damping_ratio * rate, rate**2]).astype(complex)
    if damping_ratio == 1.0:
        expected = target * (1 - (1 + rate * times) * np.exp(-rate * times))
    else:
        a, b = roots
        expected = target * (1 - (b * np.exp(a * times) - a * np.exp(b * times)) / (b - a)).real
    np.testing.assert_allclose(run(world, joint, 0.5)[:, 0], expected, atol=0.005 * target)


def test_damping_that_is_not_given_is_critical() -> None:
    world, joint = stand()
    joint.drive_position(0.3, stiffness=50.0)
    rate, times = np.sqrt(50.0 / INERTIA), STEP * np.arange(1, 1001)
    expected = 0.3 * (1 - (1 + rate * times) * np.exp(-rate * times))
    np.testing.assert_allclose(run(world, joint, 0.5)[:, 0], expected, atol=0.002)


@pytest.mark.parametrize("damping", [1.0, 5.0])
def test_a_velocity_drive_approaches_its_target_exponentially(damping: float) -> None:
    world, joint = stand()
    joint.drive_velocity(2.0, damping=damping)
    times = STEP * np.arange(1, 401)
    expected = 2.0 * (1 - np.exp(-damping / INERTIA * times))
    np.testing.assert_allclose(run(world, joint, 0.2)[:, 1], expected, atol=0.01)


@pytest.mark.parametrize(("kind", "inertia"), [("continuous", INERTIA), ("prismatic", MASS)])
def test_an_effort_accelerates_uniformly(kind: str, inertia: float) -> None:
    world, joint = stand(kind)
    joint.drive_effort(-3.0)
    assert run(world, joint, 0.1)[-1, 1] == pytest.approx(-3.0 / inertia * 0.1, rel=1e-9)
    assert joint.applied_effort == -3.0


def test_a_spring_drive_sags_by_the_weight_over_its_stiffness() -> None:
    world, joint = stand("prismatic", gravity=9.81)
    joint.drive_position(0.0, stiffness=400.0)
    run(world, joint, 3.0)
    assert joint.position == pytest.approx(-MASS * 9.81 / 400.0, rel=1e-6)
    assert joint.applied_effort == pytest.approx(MASS * 9.81, rel=1e-6)


@pytest.mark.parametrize("bound", [1.0, 4.0])
def test_an_effort_limit_is_that_of_the_file_or_of_the_command(bound: float) -> None:
    by_file = stand("revolute", limit=Limit(effort=bound))
    by_command = stand("revolute")
    by_file[1].drive_position(100.0, stiffness=1e5, damping=0.0)
    by_command[1].drive_position(100.0, stiffness=1e5, damping=0.0, max_effort=bound)
    for world, joint in (by_file, by_command):
        assert run(world, joint, 0.05)[-1, 1] == pytest.approx(bound / INERTIA * 0.05, rel=1e-9)
        assert world.drives.effort_limit(joint) == bound


@pytest.mark.parametrize("limit", [None, Limit(lower=-1, upper=1), Limit(effort=0.0)])
def test_no_effort_or_zero_effort_is_no_effort_limit(limit: Limit | None) -> None:
    world, joint = stand("revolute", limit=limit)
    assert world.drives.effort_limit(joint) == np.inf
    joint.drive_effort(1e4)
    world.step()
    assert joint.applied_effort == 1e4


@pytest.mark.parametrize(
    ("command", "message"),
    [
        (lambda joint: joint.drive_position(np.nan), "not finite"),
        (lambda joint: joint.drive_position(0.0, velocity=np.inf), "not finite"),
        (lambda joint: joint.drive_position(0.0, stiffness=-1.0), "stiffness must be at least 0, got -1"),
        (
            lambda joint: joint.drive_position(0.0, stiffness=1.0, damping=np.nan),
            "damping must be at least 0",
        ),
        (lambda joint: joint.drive_velocity(1.0, damping=-2.0), "damping must be at least 0, got -2"),
        (lambda joint: joint.drive_effort(np.inf), "not finite"),
    ],
)
def test_wrong_commands_are_refused_and_leave_the_drive_as_it_was(command, message: str) -> None:
    world, joint = stand()
    joint.drive_effort(1.0)
    with pytest.raises(RoboyardError, match=message):
        command(joint)
    world.step()
    assert joint.applied_effort == 1.0


def test_a_drive_survives_a_recompile_with_its_gains_target_and_limit() -> None:
    worlds = [stand("revolute"), stand("revolute")]
    for changed, (world, joint) in enumerate(worlds):
        joint.drive_position(0.5, velocity=0.1, stiffness=30.0, damping=1.0, max_effort=2.0)
        run(world, joint, 0.05)
        if changed:
            world.add_box((0.1, 0.1, 0.1), (9, 9, 9))
    ends = [run(world, joint, 0.2)[-1] for world, joint in worlds]
    np.testing.assert_array_equal(ends[0], ends[1])


def test_a_joint_whose_limits_are_equal_stays_there() -> None:
    world, joint = stand("revolute", limit=Limit(lower=0.0, upper=0.0, effort=100.0))
    joint.drive_effort(5.0)
    run(world, joint, 0.2)
    assert abs(joint.position) < 1e-3


@pytest.mark.parametrize(("bound", "limited"), [(1e7, False), (1e6, True)])
def test_limits_beyond_a_million_do_not_act(bound: float, limited: bool) -> None:
    world, _ = stand("revolute", limit=Limit(lower=-bound, upper=bound))
    assert bool(world.model.jnt_limited[0]) is limited


def test_a_joint_that_no_drive_is_made_for_names_what_to_use_instead() -> None:
    joint = World(profile=BULLET).add_urdf(pendulum(), fixed_base=True).joint("hinge")
    with pytest.raises(RoboyardError, match=r"'hinge' .* has no drive in this world; set world\.motors"):
        joint.drive_position(0.0)
    (cart,) = World().add_mjcf(
        "<mujoco><worldbody><body><joint name='h'/><geom size='.1'/></body></worldbody></mujoco>"
    )
    with pytest.raises(RoboyardError, match=r"'h' .* has no drive in this world"):
        cart.joint("h").drive_effort(1.0)


# ---------------------------------------------------------------------------------------- velocity motors


@pytest.mark.parametrize(
    ("kp", "kd", "speed"), [(0.1, 1.0, 0.0), (0.3, 0.5, 0.0), (0.05, 0.2, 0.4), (1.0, 1.0, 0.0)]
)
def test_a_position_motor_follows_its_recursion(kp: float, kd: float, speed: float) -> None:
    """v' = kp (q* - q) / dt + v + kd (v* - v), q' = q + v' dt."""
    world = World(profile=BULLET, gravity=(0, 0, 0))
    joint = world.add_urdf(pendulum(), fixed_base=True).joint("hinge")
    joint.velocity = 0.3
    world.motors.set(joint, position=0.2, velocity=speed, kp=kp, kd=kd, max_force=1e9)
    q, v, dt = 0.0, 0.3, world.timestep
    for _ in range(12):
        world.step()
        v += kp * (0.2 - q) / dt + kd * (speed - v)
        q += v * dt
        assert joint.velocity == pytest.approx(v, rel=2e-3, abs=0.01)
        assert joint.position == pytest.approx(q, rel=2e-3, abs=2e-4)


def test_a_motor_moves_no_faster_than_its_largest_velocity() -> None:
    world = World(profile=BULLET, gravity=(0, 0, 0))
    joint = world.add_urdf(pendulum(), fixed_base=True).joint("hinge")
    world.motors.set(joint, position=3.0, kp=0.5, max_force=1e9, max_velocity=0.7)
    for _ in range(20):
        world.step()
        assert joint.velocity == pytest.approx(0.7, rel=1e-3)


@pytest.mark.parametrize("angle", [0.4, -1.1])
def test_a_motor_that_holds_a_pendulum_applies_the_moment_of_its_weight(angle: float) -> None:
    """A rod of 1 kg and 1 m hangs from its end: m g L / 2 sin(angle)."""
    world = World(profile=BULLET)
    joint = world.add_urdf(pendulum(), fixed_base=True).joint("hinge")
    joint.position = angle
    world.motors.set(joint, position=angle, kp=0.1, max_force=1e4)
    world.step(240)
    assert joint.position == pytest.approx(angle, abs=1e-3)
    assert abs(world.motors.applied(joint)[0]) == pytest.approx(9.81 / 2 * abs(np.sin(angle)), rel=1e-2)
    np.testing.assert_allclose(world.motors.forces(), world.motors.applied(joint))
    np.testing.assert_array_equal(world.stepping.forces.motor_forces(), world.motors.forces())


def test_a_motor_too_weak_for_the_weight_slips_with_all_its_force() -> None:
    world = World(profile=BULLET)
    joint = world.add_urdf(pendulum(), fixed_base=True).joint("hinge")
    joint.position = 1.0
    world.motors.set(joint, velocity=0.0, max_force=1.0)
    world.step(5)
    fall = (9.81 / 2 * np.sin(1.0) - 1.0) / (1 / 3) * 5 * world.timestep
    assert abs(joint.velocity) == pytest.approx(fall, rel=0.02)
    assert abs(world.motors.applied(joint)[0]) == pytest.approx(1.0, rel=1e-3)


def test_an_impulse_bound_is_a_force_over_the_time_step() -> None:
    speeds = []
    for bounds in (
        {"max_force": 0.6},
        {"max_impulse": 0.6 / 240},
        {"max_force": 0.2, "max_impulse": 0.4 / 240},
    ):
        world = World(profile=BULLET, gravity=(0, 0, 0))
        joint = world.add_urdf(pendulum(), fixed_base=True).joint("hinge")
        world.motors.set(joint, velocity=50.0, **bounds)
        world.step(24)
        speeds.append(joint.velocity)
    np.testing.assert_allclose(speeds, 0.6 / (1 / 3) * 0.1, rtol=1e-3)


@pytest.mark.parametrize("values", [{"velocity": np.nan}, {"position": np.inf}, {"kp": np.nan}])
def test_motors_refuse_what_is_not_finite(values: dict[str, float]) -> None:
    world = World(profile=BULLET)
    joint = world.add_urdf(pendulum(), fixed_base=True).joint("hinge")
    with pytest.raises(RoboyardError, match="must be finite"):
        world.motors.set(joint, **values)


def test_joints_without_one_axis_or_three_have_no_motor() -> None:
    description = RobotDescription(
        name="raft",
        links=(Link(name="base"), rod("rod")),
        joints=(Joint(name="j", type="planar", parent="base", child="rod"),),
    )
    world = World(profile=BULLET)
    joint = world.add_urdf(description, fixed_base=True).joint("j")
    with pytest.raises(RoboyardError, match="is planar and cannot have a motor"):
        world.motors.set(joint, velocity=0.0)


# ---------------------------------------------------------------------------------------- collision masks


def two_boxes(name: str) -> RobotDescription:
    shapes = (Collision(geometry=Box(size=(0.2, 0.2, 0.2))),)
    inertial = Inertial(mass=1.0, inertia=(0.01, 0, 0, 0.01, 0, 0.01))
    return RobotDescription(
        name=name,
        links=tuple(Link(name=link, inertial=inertial, collisions=shapes) for link in ("a", "b")),
        joints=(Joint(name="j", type="revolute", parent="a", child="b", origin=Pose(position=(0.1, 0, 0))),),
    )


def can_touch(model, a: int, b: int) -> bool:
    """MuJoCo's rule for two geoms."""
    kind, affinity = model.geom_contype, model.geom_conaffinity
    return bool(kind[a] & affinity[b] or kind[b] & affinity[a])


def test_masks_part_the_links_of_a_robot_and_no_others_also_after_removals() -> None:
    world = World(visual_geoms=False)
    plane = world.add_plane()
    free = [world.add_urdf(two_boxes(f"r{k}"), (3.0 * k, 0, 5)) for k in range(12)]
    bound = [world.add_urdf(two_boxes(f"s{k}"), (3.0 * k, 3, 5), self_collision=True) for k in range(2)]
    for robot in free[2:9:2]:
        world.remove(robot)
    free = [robot for robot in free if not robot.is_removed]
    free += [world.add_urdf(two_boxes(f"t{k}"), (3.0 * k, 6, 5)) for k in range(6)]
    world.step()
    model = world.model
    geoms = {body.id: [g for g in range(model.ngeom) if model.geom_bodyid[g] in body.mujoco_ids]
             for body in (*free, *bound)}  # fmt: skip
    ground = [g for g in range(model.ngeom) if model.geom_bodyid[g] in plane.mujoco_ids]
    for robot in free:
        first, second = geoms[robot.id]
        assert not can_touch(model, first, second)
        for other in (*free, *bound):
            if other is not robot:
                assert all(can_touch(model, a, b) for a in geoms[robot.id] for b in geoms[other.id])
        assert can_touch(model, first, ground[0])
    for robot in bound:
        assert can_touch(model, *geoms[robot.id])


def test_a_pair_that_is_switched_off_stays_off_until_its_body_is_removed() -> None:
    world = World(gravity=(0, 0, 0))
    a, b, c = (world.add_box((0.2, 0.2, 0.2), (0.15 * k, 0, 0)) for k in range(3))
    world.filters.set(a.links[0], b.links[0], collide=False)
    assert not world.filters.collides(b.links[0], a.links[0])
    world.detect_contacts()
    pairs = {frozenset((contact.body_a.id, contact.body_b.id)) for contact in world.contacts()}
    assert pairs == {frozenset((b.id, c.id))}
    world.remove(b)
    d = world.add_box((0.2, 0.2, 0.2), (0.15, 0, 0))
    world.detect_contacts()
    pairs = {frozenset((contact.body_a.id, contact.body_b.id)) for contact in world.contacts()}
    assert pairs == {frozenset((a.id, d.id)), frozenset((c.id, d.id))}


# ------------------------------------------------------------------------------------------- saved states


@pytest.mark.parametrize("profile", ["plain", "bullet"])
def test_a_state_with_contacts_constraints_and_drives_comes_back_bit_for_bit(profile: str) -> None:
    world = World() if profile == "plain" else World(profile=BULLET)
    world.add_plane()
    boxes = [
        world.add_box((0.2, 0.2, 0.2), (0.02 * k, 0, 0.12 + 0.21 * k), (0, 0, 0.1 * k, 1)) for k in range(3)
    ]
    hung = world.add_sphere(0.1, (2, 0, 1.2))
    world.constraints.add_point(hung.links[0], None, position_a=(0.5, 0, 0), position_b=(2.5, 0, 1.2))
    swing = world.add_urdf(arm(), (4, 0, 3), fixed_base=True)
    if profile == "bullet":
        world.motors.set(swing.joint("shoulder"), velocity=0.5, max_force=20.0)
    else:
        swing.joint("elbow").drive_position(0.5)
        swing.joint("shoulder").drive_velocity(0.5)
    world.step(60)
    saved = world.save_state()

    def record() -> list[np.ndarray]:
        rows = []
        for _ in range(40):
            world.step(2)
            forces = [contact.normal_force for contact in world.contacts()]
            rows.append(np.hstack([world.data.qpos, world.data.qvel, world.time, np.ravel(forces)]))
        return rows

    first = record()
    boxes[0].set_pose((5, 5, 5))
    swing.joint_positions = np.zeros(4)
    world.step(7)
    world.restore_state(saved)
    for before, after in zip(first, record(), strict=True):
        np.testing.assert_array_equal(after, before)


def test_a_restored_state_moves_fixed_bodies_back_also_after_a_recompile() -> None:
    world = World()
    table = world.add_box((1, 1, 0.1), (0, 0, 1), mass=0.0)
    ball = world.add_sphere(0.1, (0, 0, 1.2))
    saved = world.save_state()
    table.set_pose((0, 0, 0.3))
    world.step(100)
    world.restore_state(saved)
    np.testing.assert_allclose(table.position, (0, 0, 1))
    world.add_sphere(0.1, (9, 9, 9))
    world.step(240)
    np.testing.assert_allclose(table.position, (0, 0, 1))
    assert ball.position[2] == pytest.approx(1.15, abs=5e-3)
