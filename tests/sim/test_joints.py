"""Joints, drives, mimic, limits, wrenches, against closed forms."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest
from sim_robots import arm, pendulum, rod

from roboyard.description.model import Joint, Limit, Link, Pose, RobotDescription
from roboyard.errors import RoboyardError
from roboyard.sim import World
from roboyard.sim.physics_profile import BULLET


def test_a_small_pendulum_swings_with_the_period_of_a_rod():
    world = World(timestep=1e-3)
    swing = world.add_urdf(pendulum(), (0, 0, 2), fixed_base=True)
    hinge = swing.joint("hinge")
    hinge.position = 0.05
    signs = []
    for _ in range(4000):
        world.step()
        signs.append(np.sign(hinge.position))
    crossings = np.flatnonzero(np.diff(signs))
    half_period = np.diff(crossings).mean() * 1e-3
    assert half_period == pytest.approx(np.pi * np.sqrt(2 / 3 / 9.81), rel=2e-3)


def test_joint_vectors_are_depth_first_and_named():
    body = World().add_urdf(arm(), fixed_base=True)
    assert body.joint_names == ("shoulder", "elbow", "left_finger", "right_finger")
    body.joint_positions = [0.1, 0.2, 0.03, 0.03]
    np.testing.assert_allclose(body.joint_positions, [0.1, 0.2, 0.03, 0.03])
    np.testing.assert_allclose(body.joint_limits[0], [-2, 2])
    with pytest.raises(RoboyardError, match="4 joint positions"):
        body.joint_positions = [0.0, 1.0]


def test_link_poses_follow_joint_positions_at_once():
    body = World().add_urdf(arm(), (0, 0, 3), fixed_base=True)
    body.joint("shoulder").position = np.pi / 2
    position, _ = body.link("lower").pose
    np.testing.assert_allclose(position, [-1, 0, 3], atol=1e-12)
    body.joint("elbow").velocity = 2.0
    linear, angular = body.link("left").velocity
    np.testing.assert_allclose(angular, [0, 2, 0], atol=1e-12)
    np.testing.assert_allclose(linear, [0, 0, 2], atol=1e-12)


def test_position_drives_hold_an_arm_against_gravity():
    world = World()
    body = world.add_urdf(arm(), (0, 0, 3), fixed_base=True)
    targets = {"shoulder": 1.0, "elbow": -0.5, "left_finger": 0.02}
    for name, target in targets.items():
        body.joint(name).drive_position(target)
    world.step(960)
    for name, target in targets.items():
        assert body.joint(name).position == pytest.approx(target, abs=6e-3)
    assert body.joint("right_finger").position == pytest.approx(body.joint("left_finger").position, abs=1e-4)


def test_effort_limits_bound_the_drive():
    world = World()
    weak = Limit(lower=-2, upper=2, effort=3.0, velocity=5)
    body = world.add_urdf(arm(weak), (0, 0, 3), fixed_base=True)
    body.joint("shoulder").drive_position(1.5)
    world.step(300)
    assert abs(body.joint("shoulder").applied_effort) <= 3.0 + 1e-9
    assert body.joint("shoulder").position < 1.0


def test_velocity_and_effort_drives():
    world = World(gravity=(0, 0, 0))
    swing = world.add_urdf(pendulum(), fixed_base=True)
    hinge = swing.joint("hinge")
    hinge.drive_velocity(2.0)
    world.step(240)
    assert hinge.velocity == pytest.approx(2.0, rel=1e-3)
    hinge.velocity = 0.0
    hinge.drive_effort(0.5)
    world.step(24)
    assert hinge.velocity == pytest.approx(0.5 / (1 / 3) * 0.1, rel=1e-3)
    hinge.disable_drive()
    world.step(24)
    assert hinge.velocity == pytest.approx(0.15, rel=1e-3)


def test_fixed_and_mimic_joints_reject_drives():
    body = World().add_urdf(arm(), fixed_base=True)
    with pytest.raises(RoboyardError, match="mimics"):
        body.joint("right_finger").drive_position(0.0)
    fixed = RobotDescription(
        name="two",
        links=(Link(name="a"), rod("b")),
        joints=(Joint(name="weld", type="fixed", parent="a", child="b"),),
    )
    with pytest.raises(RoboyardError, match="is fixed"):
        World().add_urdf(fixed, fixed_base=True).joint("weld").drive_velocity(1.0)


def test_joints_stop_at_their_limits():
    world = World()
    body = world.add_urdf(arm(Limit(lower=-0.3, upper=0.3)), (0, 0, 3), fixed_base=True)
    body.joint("shoulder").drive_effort(200.0)
    world.step(480)
    assert body.joint("shoulder").position == pytest.approx(0.3, abs=5e-3)


@pytest.mark.parametrize(("kind", "size"), [("spherical", 4), ("planar", 3), ("floating", 7)])
def test_joints_of_several_degrees_of_freedom(kind, size):
    description = RobotDescription(
        name="multi",
        links=(Link(name="base"), rod("rod")),
        joints=(
            Joint(
                name="j",
                type=kind,
                parent="base",
                child="rod",
                origin=Pose(position=(0, 0, 1)),
                axis=(0, 0, 1),
            ),
        ),
    )
    world = World(gravity=(0, 0, 0))
    body = world.add_urdf(description, fixed_base=True)
    joint = body.joint("j")
    assert joint.position.shape == (size,)
    turn = np.array([0, 0, np.sin(0.2), np.cos(0.2)])
    value = {
        "spherical": turn,
        "planar": np.array([0.1, 0.2, 0.4]),
        "floating": np.concatenate([[0.1, 0.2, 0.3], turn]),
    }[kind]
    joint.position = value
    np.testing.assert_allclose(joint.position, value, atol=1e-12)
    position, quaternion = body.link("rod").pose
    np.testing.assert_allclose(np.abs(quaternion), np.abs(turn), atol=1e-9)
    shift = {"spherical": (0, 0, 0), "planar": (0.1, 0.2, 0), "floating": (0.1, 0.2, 0.3)}[kind]
    np.testing.assert_allclose(position, np.array([0, 0, 1]) + shift, atol=1e-9)


def test_wrenches_act_for_one_step():
    world = World(gravity=(0, 0, 0), timestep=0.01)
    ball = world.add_sphere(0.1, mass=2.0)
    ball.links[0].apply_wrench((4, 0, 0))
    ball.links[0].apply_wrench((0, 2, 0), point=(0.1, 0, 0))
    world.step(5)
    linear, angular = ball.velocity
    np.testing.assert_allclose(linear, [0.02, 0.01, 0], atol=1e-9)
    np.testing.assert_allclose(angular, [0, 0, 0.1 * 2 * 0.01 / (0.4 * 2 * 0.01)], atol=1e-6)


def test_motors_correct_a_tenth_of_the_error_in_a_step():
    world = World(profile=BULLET, gravity=(0, 0, 0))
    hinge = world.add_urdf(pendulum(), fixed_base=True).joint("hinge")
    world.motors.set(hinge, position=1.0, kp=0.1, kd=1.0, max_force=1e6)
    for k in range(1, 6):
        world.step()
        assert hinge.position == pytest.approx(1 - 0.9**k, abs=1e-3)


def test_motors_reach_a_velocity_within_their_force_bound():
    world = World(profile=BULLET, gravity=(0, 0, 0))
    hinge = world.add_urdf(pendulum(), fixed_base=True).joint("hinge")
    world.motors.set(hinge, velocity=2.0, kd=0.1, max_force=1e6)
    reached = []
    for _ in range(3):
        world.step()
        reached.append(hinge.velocity)
    np.testing.assert_allclose(reached, [0.2, 0.38, 0.542], rtol=1e-3)
    hinge.velocity = 0.0
    world.motors.set(hinge, velocity=50.0, kd=1.0, max_force=0.4)
    world.step(10)
    assert hinge.velocity == pytest.approx(0.4 / (1 / 3) * 10 / 240, rel=1e-3)
    assert world.motors.applied(hinge)[0] == pytest.approx(0.4, rel=1e-3)
    world.motors.clear(hinge)
    speed = hinge.velocity
    world.step(10)
    assert hinge.velocity == pytest.approx(speed)


def test_motors_survive_a_recompile():
    world = World(profile=BULLET, gravity=(0, 0, 0))
    hinge = world.add_urdf(pendulum(), fixed_base=True).joint("hinge")
    world.motors.set(hinge, velocity=2.0, max_force=1e6)
    world.step()
    world.add_sphere(0.1, (9, 9, 9))
    hinge.velocity = 0.0
    world.step()
    assert hinge.velocity == pytest.approx(2.0, rel=1e-3)


def test_a_ball_joint_motor_turns_to_its_target():
    ball = RobotDescription(
        name="ball",
        links=(Link(name="base"), rod("rod")),
        joints=(Joint(name="j", type="spherical", parent="base", child="rod"),),
    )
    world = World(profile=BULLET, gravity=(0, 0, 0))
    joint = world.add_urdf(ball, fixed_base=True).joint("j")
    target = np.array([0.3, 0.2, 0.1, 0.9])
    target /= np.linalg.norm(target)
    world.motors.set(joint, position=target, kp=0.1, kd=1.0, max_force=1e6)
    world.step(200)
    np.testing.assert_allclose(joint.position, target, atol=1e-4)


@pytest.mark.parametrize("speed", [3.0, 12.0, 40.0])
@pytest.mark.parametrize("extra", ["", "box", "drag"])
def test_a_fast_joint_stops_at_its_limit(speed: float, extra: str) -> None:
    """Without the stop in sight it would be speed times time step further on: 0.17 rad at 40 rad/s."""
    world = World(gravity=(0, 0, 0))
    body = world.add_urdf(arm(), (0, 0, 3), fixed_base=True)
    if extra == "box":
        world.add_box((0.1, 0.1, 0.1), (3, 0, 1))
    if extra == "drag":
        body.link("lower").set_damping(linear=0.1)
    shoulder = body.joint("shoulder")
    shoulder.velocity = speed
    furthest = 0.0
    for _ in range(240):
        world.step()
        furthest = max(furthest, shoulder.position)
    assert 1.99 < furthest < 2.01


def test_a_limb_thrown_against_the_floor_keeps_its_limits() -> None:
    """A blow speeds a joint up within one step, so that its speed before says nothing."""
    world = World()
    world.add_plane()
    links = (rod("base", 2.0, 0.2), *arm().links[1:])
    body = world.add_urdf(replace(arm(), links=links), (0, 0, 2.5), (0.5, 0.5, 0.5, 0.5))
    rng = np.random.default_rng(0)
    names = ("shoulder", "elbow")
    limits = np.array([body.joint_limits[body.joint_names.index(name)] for name in names])
    beyond = 0.0
    for k in range(1200):
        if k % 200 == 0:
            body.set_pose((0, 0, 2.5), rng.normal(size=4))
            body.set_velocity((0, 0, -12), rng.normal(size=3) * 8)
        world.step()
        q = np.array([body.joint(name).position for name in names])
        beyond = max(beyond, float((q - limits[:, 1]).max()), float((limits[:, 0] - q).max()))
    assert beyond < 0.01


def test_stops_do_not_change_steps_that_pass_none() -> None:
    """A pendulum within its limits moves as MuJoCo moves it, to the last bit."""
    world = World()
    body = world.add_urdf(arm(), (0, 0, 3), fixed_base=True)
    body.joint("shoulder").position = 0.4
    world.step(1)
    other = mujoco.MjData(world.model)
    other.qpos[:], other.qvel[:], other.qacc_warmstart[:] = (
        world.data.qpos,
        world.data.qvel,
        world.data.qacc_warmstart,
    )
    world.step(50)
    for _ in range(50):
        mujoco.mj_step(world.model, other)
    np.testing.assert_array_equal(world.data.qpos, other.qpos)


@pytest.mark.parametrize("torque", [0.5, 2.0])
def test_a_light_link_pressed_against_its_stop_stays_within_a_milliradian(torque: float):
    """Other limbs press wrists of 1e-4 kg m² as hard; a limit as soft as contacts gives way by 13 mrad."""
    text = """<robot name="wrist"><link name="base"/><link name="hand"><inertial><mass value="0.05"/>
      <inertia ixx="1e-4" ixy="0" ixz="0" iyy="1e-4" iyz="0" izz="1e-4"/></inertial></link>
      <joint name="roll" type="revolute"><parent link="base"/><child link="hand"/><axis xyz="0 0 1"/>
      <limit lower="-0.5" upper="0.5" effort="1" velocity="9"/></joint></robot>"""
    world = World()
    body = world.add_urdf(text, fixed_base=True)
    body.joint("roll").position = 0.5
    worst = 0.0
    for _ in range(240):
        body.link("hand").apply_wrench((0, 0, 0), (0, 0, torque))
        world.step()
        worst = max(worst, body.joint("roll").position - 0.5)
    assert 0.0 < worst < 1e-3


@pytest.mark.parametrize(
    ("stiffness", "damping", "seed"), [(2000, 200, 1), (10000, 1000, 1), (100, 300, 2), (3000, 2000, 1)]
)
def test_weak_stiff_drives_under_a_heavy_torso_keep_their_limits(
    stiffness: float, damping: float, seed: int
) -> None:
    """Stops of three joints in a row act on each other and on drives; one was passed by up to 0.28 rad."""
    ranges, masses = ((0.0, 1.4), (-2.3, 0.0), (0.0, 2.3)), (6.0, 6.0, 45.0)
    parts = ['<robot name="torso"><link name="l0"/>']
    for k, ((low, high), mass) in enumerate(zip(ranges, masses, strict=True)):
        tensor = f'ixx="{mass / 30}" iyy="{mass / 30}" izz="{mass / 30}" ixy="0" ixz="0" iyz="0"'
        parts.append(
            f'<link name="l{k + 1}"><inertial><origin xyz="0.05 0 0.2"/><mass value="{mass}"/>'
            f"<inertia {tensor}/></inertial></link>"
            f'<joint name="j{k}" type="revolute"><parent link="l{k}"/><child link="l{k + 1}"/>'
            f'<origin xyz="0 0 {0.3 if k else 0.0}"/><axis xyz="0 1 0"/>'
            f'<limit lower="{low}" upper="{high}" effort="100" velocity="6"/></joint>'
        )
    world = World()
    body = world.add_urdf("".join(parts) + "</robot>", fixed_base=True)
    joints, limits = [body.joint(f"j{k}") for k in range(3)], np.array(ranges)
    rng = np.random.default_rng(seed)
    beyond = 0.0
    for k in range(2400):
        if k % 60 == 0:
            for joint, goal in zip(joints, rng.uniform(limits[:, 0], limits[:, 1]), strict=True):
                joint.drive_position(goal, stiffness=stiffness, damping=damping, max_effort=100.0)
        world.step()
        q = np.array([joint.position for joint in joints])
        beyond = max(beyond, float((q - limits[:, 1]).max()), float((limits[:, 0] - q).max()))
    assert beyond < 0.006
