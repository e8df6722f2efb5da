"""Controllers alone: arrays in, drive targets out, against their formulas worked by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from roboyard.assets import asset_path
from roboyard.description import load_description
from roboyard.errors import ConfigError, RoboyardError
from roboyard.kinematics import forward_kinematics, from_description, jacobian
from roboyard.robots import add_robot
from roboyard.robots.control import (
    REGISTERED_CONTROLLERS,
    GroupLimits,
    GroupState,
    NullJointController,
    register_controller,
)
from roboyard.robots.control.rotations import matrix_of_vector, vector_of_matrix
from roboyard.robots.definition.schema import ADDED_CONTROLLERS
from roboyard.sim import World

DT = 1 / 30


def limits(n: int = 2, **changed) -> GroupLimits:
    values = {
        "lower": np.full(n, -2.0),
        "upper": np.full(n, 2.0),
        "velocity": np.full(n, 3.0),
        "effort": np.full(n, 10.0),
    }
    return GroupLimits(**{**values, **{k: np.asarray(v, float) for k, v in changed.items()}})


def make(name: str, bounds: GroupLimits | None = None, **keys):
    cls = REGISTERED_CONTROLLERS[name]
    return cls(bounds or limits(), cls.Settings(**keys))


def state(q=(0.0, 0.0), v=(0.0, 0.0), **more) -> GroupState:
    return GroupState(q=np.array(q, float), v=np.array(v, float), dt=DT, **more)


def settle(controller, now: GroupState, steps: int = 200):
    for _ in range(steps):
        control = controller.step(now)
    return control


# ---------------------------------------------------------------------------------------------------- joints


def test_positions_are_scaled_from_unit_commands_to_limits() -> None:
    controller = make("JointController", limits(2, lower=[-1, 0], upper=[3, 1]))
    controller.update_goal([0.5, -1.0], state())
    assert settle(controller, state()).value == pytest.approx([2.0, 0.0])
    controller.update_goal([7.0, 7.0], state())
    assert settle(controller, state()).value == pytest.approx([3.0, 1.0])


def test_a_reference_respects_velocity_and_acceleration_limits() -> None:
    controller = make("JointController", command_output_limits=None, command_input_limits=None)
    now = state()
    now.inertia = np.array([1.0, 0.01])
    controller.update_goal([1.9, 1.9], now)
    way = np.array([controller.step(now).value for _ in range(60)])
    speed = np.diff(way, axis=0, prepend=0.0) / DT
    assert speed.max() <= 3.0 + 1e-9
    change = np.diff(speed, axis=0, prepend=0.0) / DT
    assert change[:, 0].max() == pytest.approx(4.0)  # 0.4 · 10 N m / 1 kg m²
    assert change[:, 1].max() == pytest.approx(15.0)  # 3 rad/s in 0.2 s
    assert way[-1] == pytest.approx([1.9, 1.9])
    assert way.max() <= 1.9 + 1e-12


def test_changes_are_relative_to_the_measured_joint_and_zero_ones_keep_the_goal() -> None:
    controller = make("JointController", use_delta_commands=True, command_output_limits=None)
    controller.update_goal([0.5, 0.0], state((0.2, 0.3)))
    assert controller.goal == pytest.approx([0.7, 0.3])
    controller.update_goal([0.1, 0.0], state((0.6, 0.1)))  # the second joint sags: its goal stays
    assert controller.goal == pytest.approx([0.7, 0.3])


def test_changes_in_rotation_space_are_composed_as_rotations() -> None:
    bounds = limits(3, lower=[-4] * 3, upper=[4] * 3)
    controller = make(
        "JointController",
        bounds,
        use_delta_commands=True,
        command_output_limits=None,
        command_input_limits=None,
        compute_delta_in_quat_space=[[0, 1, 2]],
    )
    q, change = np.array([0.3, -0.4, 1.2]), np.array([0.2, 0.5, -0.1])
    controller.update_goal(change, GroupState(q=q, v=np.zeros(3), dt=DT))
    wanted = Rotation.from_euler("xyz", change) * Rotation.from_euler("xyz", q)
    assert (Rotation.from_euler("xyz", controller.goal).inv() * wanted).magnitude() == pytest.approx(
        0, abs=1e-9
    )


def test_positions_are_held_once_velocities_are_zero() -> None:
    controller = make("JointController", motor_type="velocity")
    controller.update_goal([1.0, 0.5], state())
    control = controller.step(state())
    assert control.kind == "velocity"
    assert control.value == pytest.approx([3.0, 1.5 + 5 * DT * 1.5])  # with the integral; limited
    controller.update_goal([0.0, 0.0], state())
    assert controller.step(state(v=(1.0, 0.0))).kind == "velocity"
    control = controller.step(state((0.4, 0.5), (0.001, 0.0)))
    assert control.kind == "position"
    assert control.value == pytest.approx([0.4, 0.5])
    assert controller.step(state((0.9, 0.9), (2.0, 0.0))).value == pytest.approx([0.4, 0.5])


def test_impedance_is_mass_times_acceleration_plus_bias() -> None:
    controller = make("JointController", use_impedances=True, pos_kp=40.0, pos_damping_ratio=0.5)
    mass, bias = np.array([[2.0, 0.3], [0.3, 1.0]]), np.array([0.5, -0.25])
    now = state((0.1, -0.2), (0.3, 0.1), mass_matrix=mass, bias=bias)
    controller.goal = now.q.copy()
    effort = controller.step(now).value
    kd = 2 * math.sqrt(40.0) * 0.5
    assert effort == pytest.approx(mass @ (-kd * now.v) + bias)
    assert controller.control_type == "effort"


def test_efforts_are_passed_on_and_limited() -> None:
    controller = make("JointController", motor_type="effort")
    controller.update_goal([0.3, 1.0], state())
    assert controller.step(state()).value == pytest.approx([3.0, 10.0])


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ({"motor_type": "velocity", "pos_kp": 1.0}, r"pos_kp=1\.0 has no effect"),
        ({"motor_type": "effort", "vel_kp": 1.0}, r"vel_kp=1\.0 has no effect"),
        ({"use_delta_commands": True}, "command_output_limits must be null"),
        ({"motor_type": "fast"}, "motor_type"),
        ({"colour": 1}, "colour"),
    ],
)
def test_contradictory_settings_are_refused(keys: dict, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        make("JointController", **keys)


@pytest.mark.parametrize(
    ("name", "keys", "message"),
    [
        (
            "JointController",
            {"motor_type": "effort", "isaac_kd": 1.0},
            r"isaac_kd=1\.0 has no effect for joints",
        ),
        (
            "JointController",
            {"hold_position": False},
            "hold_position=False has no effect with",
        ),
        (
            "HolonomicBaseJointController",
            {"motor_type": "position", "max_acceleration": [1, 1, 1]},
            "max_acc",
        ),
    ],
)
def test_keys_without_effect_are_refused(name: str, keys: dict, message: str) -> None:
    with pytest.raises((ValueError, ConfigError), match=message):
        make(name, limits(3) if name.startswith("Holo") else fingers(), **keys)


@pytest.mark.parametrize(
    ("name", "keys", "message"),
    [
        ("JointController", {"pos_kp": 150.0, "use_impedances": False}, "pos_kp has no effect without"),
        ("JointController", {"use_cc_compensation": False}, "use_cc_compensation has no effect"),
        ("MultiFingerGripperController", {"mode": "smooth", "open_qpos": [1, 1]}, "open_qpos has no effect"),
    ],
)
def test_unused_keys_of_omnigibson_configurations_are_warned_of(name: str, keys: dict, message: str) -> None:
    """Published configurations carry them, `pos_kp: 150` without impedances for one."""
    with pytest.warns(UserWarning, match=message):
        make(name, fingers(), **keys)


def test_commands_of_another_length_or_not_finite_are_refused() -> None:
    controller = make("JointController")
    with pytest.raises(RoboyardError, match="a command must have 2 numbers"):
        controller.update_goal([1.0], state())
    with pytest.raises(RoboyardError, match="not finite"):
        controller.update_goal([1.0, math.nan], state())


def test_no_op_commands_keep_all_goals() -> None:
    controller = make("JointController")
    controller.update_goal([0.5, 0.25], state())
    assert controller.noop_command(state((0.9, 0.9))) == pytest.approx([0.5, 0.25])


def test_null_controllers_have_no_command_and_keep_their_goal() -> None:
    controller = make("NullJointController", default_goal=(0.5, -0.5))
    assert controller.command_dim == 0
    assert settle(controller, state()).value == pytest.approx([0.5, -0.5])
    controller.set_default_goal([0.1, 0.2])
    assert settle(controller, state()).value == pytest.approx([0.1, 0.2])
    with pytest.raises(ConfigError, match="default_goal"):
        controller.set_default_goal([1.0])


# ------------------------------------------------------------------------------------------------------ bases


def mount(yaw: float, x: float = 0.0, y: float = 0.0) -> np.ndarray:
    T = np.eye(4)
    T[:3, :3] = Rotation.from_euler("z", yaw).as_matrix()
    T[:2, 3] = x, y
    return T


def test_holonomic_velocities_are_in_the_frame_of_the_base() -> None:
    bounds = limits(3, velocity=[1.5, 1.5, 3.0])
    controller = make(
        "HolonomicBaseJointController", bounds, max_acceleration=None, command_input_limits=None
    )
    controller.update_goal([1.0, 0.0, 0.0], GroupState(q=np.zeros(3), v=np.zeros(3), dt=DT, mount=mount(0.0)))
    moving = GroupState(q=np.zeros(3), v=np.array([0.0, 1.0, 0.0]), dt=DT, mount=mount(np.pi / 2))
    assert controller.step(moving).value == pytest.approx([0.0, 1.0, 0.0], abs=1e-12)


def test_holonomic_turning_leads_by_half_a_step() -> None:
    bounds = limits(3, velocity=[1.5, 1.5, 3.0])
    controller = make(
        "HolonomicBaseJointController", bounds, max_acceleration=None, command_input_limits=None
    )
    w = 3.0
    v = np.array([np.cos(w * DT / 2), np.sin(w * DT / 2), w])
    now = GroupState(q=np.zeros(3), v=v, dt=DT, mount=mount(0.0))
    controller.update_goal([1.0, 0.0, w], now)
    assert controller.step(now).value == pytest.approx(v, abs=1e-12)


def test_holonomic_positions_are_relative() -> None:
    bounds = limits(3, lower=[-9] * 3, upper=[9] * 3)
    controller = make(
        "HolonomicBaseJointController", bounds, motor_type="position", command_input_limits=None
    )
    now = GroupState(q=np.array([1.0, 2.0, 0.5]), v=np.zeros(3), dt=DT, mount=mount(0.5, 1.0, 2.0))
    controller.update_goal([1.0, 0.0, 0.1], now)
    assert controller.goal == pytest.approx([1 + np.cos(0.5), 2 + np.sin(0.5), 0.6])


def test_differential_drive_formula_and_inverse() -> None:
    controller = make(
        "DifferentialDriveController",
        limits(2, velocity=[20, 20]),
        wheel_radius=0.1,
        wheel_axle_length=0.4,
        command_input_limits=None,
        max_acceleration=None,
    )
    controller.update_goal([0.6, 1.0], state())
    wheels = controller.step(state(v=(4.0, 8.0))).value
    assert wheels == pytest.approx([(0.6 - 0.2) / 0.1, (0.6 + 0.2) / 0.1])
    assert controller.odometry(wheels) == pytest.approx((0.6, 1.0))


def test_differential_drive_stays_on_its_curve_when_wheels_saturate() -> None:
    controller = make(
        "DifferentialDriveController", limits(2, velocity=[20, 20]), wheel_radius=0.1, wheel_axle_length=0.4
    )
    controller.update_goal([1.0, 1.0], state())
    v, w = controller.goal
    assert np.abs(controller.wheel_speeds(controller.goal)).max() == pytest.approx(20.0)
    assert v / w == pytest.approx(2.0 / 10.0)


def test_differential_drive_accelerates_along_its_curve_and_holds_at_rest() -> None:
    controller = make(
        "DifferentialDriveController",
        limits(2, velocity=[20, 20]),
        wheel_radius=0.1,
        wheel_axle_length=0.4,
        command_input_limits=None,
        max_acceleration=(1.5, 3.0),
    )
    controller.update_goal([0.5, 0.25], state())
    led = [controller.odometry(controller.step(state()).led) for _ in range(15)]
    assert led[0] == pytest.approx((1.5 * DT, 0.75 * DT))  # both grow as they stand to one another
    assert led[-1] == pytest.approx((0.5, 0.25))
    controller.update_goal([0.0, 0.0], state())
    for _ in range(15):
        control = controller.step(state((0.3, 0.4)))
    assert control.kind == "position"
    assert control.value == pytest.approx([0.3, 0.4])


# --------------------------------------------------------------------------------------------------- grippers


def fingers() -> GroupLimits:
    return limits(2, lower=[0, 0], upper=[0.05, 0.05], velocity=[0.2, 0.2])


def test_binary_grippers_open_and_close() -> None:
    controller = make("MultiFingerGripperController", fingers())
    for command, wanted in ((1.0, 0.05), (0.0, 0.05), (-0.1, 0.0)):
        controller.update_goal([command], state())
        assert controller.step(state()).value == pytest.approx([wanted, wanted])
    inverted = make("MultiFingerGripperController", fingers(), inverted=True)
    inverted.update_goal([1.0], state())
    assert inverted.step(state()).value == pytest.approx([0.0, 0.0])
    assert inverted.noop_command(state()) == pytest.approx([1.0])


def test_smooth_and_independent_grippers() -> None:
    smooth = make("MultiFingerGripperController", fingers(), mode="smooth")
    smooth.update_goal([0.0], state())
    assert smooth.step(state()).value == pytest.approx([0.025, 0.025])
    alone = make("MultiFingerGripperController", fingers(), mode="independent")
    alone.update_goal([-1.0, 0.5], state())
    assert alone.step(state()).value == pytest.approx([0.0, 0.0375])


def test_velocity_grippers_stop_at_limits() -> None:
    controller = make("MultiFingerGripperController", fingers(), motor_type="velocity")
    controller.update_goal([1.0], state())
    assert controller.step(state((0.02, 0.0495))).value == pytest.approx([0.2, 0.0])


def test_grasping_is_detected_by_fingers_at_rest_before_their_target() -> None:
    controller = make("MultiFingerGripperController", fingers())
    assert controller.is_grasping() is False
    controller.update_goal([-1.0], state())
    for _ in range(6):
        controller.step(state((0.02, 0.02)))
    assert controller.is_grasping() is True
    for _ in range(6):
        controller.step(state((0.02, 0.02), (-0.1, -0.1)))
    assert controller.is_grasping() is False
    controller.step(state((0.0, 0.0)))
    assert controller.is_grasping() is None


# ------------------------------------------------------------------------------------------------------- arms


@pytest.fixture(scope="module")
def arm():
    chain = from_description(load_description(asset_path("arm7")), "tool")
    bounds = GroupLimits(
        lower=chain.lower, upper=chain.upper, velocity=chain.velocity, effort=np.full(7, 80.0)
    )
    return chain, bounds, np.array([0.1, 0.5, 0.0, -1.2, 0.0, 0.8, 0.2])


def make_arm(arm, name: str = "InverseKinematicsController", **keys):
    chain, bounds, rest = arm
    cls = REGISTERED_CONTROLLERS[name]
    return cls(bounds, cls.Settings(**keys), chain=chain, rest=rest)


def arm_state(q, v=None, **more) -> GroupState:
    return GroupState(q=np.array(q), v=np.zeros(7) if v is None else v, dt=DT, **more)


@pytest.mark.parametrize(
    "mode", ["pose_delta_ori", "pose_absolute_ori", "position_fixed_ori", "position_compliant_ori"]
)
def test_inverse_kinematics_moves_the_tip_as_commanded(arm, mode: str) -> None:
    chain, bounds, rest = arm
    controller = make_arm(arm, mode=mode, command_input_limits=None, command_output_limits=None)
    start = forward_kinematics(chain, rest)
    turn = np.array([0.1, -0.2, 0.15])
    if mode == "pose_absolute_ori":
        turn = vector_of_matrix(matrix_of_vector(turn) @ start[:3, :3])
    command = np.array([0.05, -0.03, 0.04, *(turn if mode.startswith("pose") else ())])
    controller.update_goal(command, arm_state(rest))
    q = settle(controller, arm_state(rest), 120).value
    end = forward_kinematics(chain, q)
    assert end[:3, 3] - start[:3, 3] == pytest.approx(command[:3], abs=1e-4)
    turned = Rotation.from_matrix(end[:3, :3] @ start[:3, :3].T).as_rotvec()
    if mode.startswith("pose"):
        assert turned == pytest.approx([0.1, -0.2, 0.15], abs=1e-3)
    if mode == "position_fixed_ori":
        assert turned == pytest.approx(np.zeros(3), abs=1e-3)
    assert (q >= bounds.lower).all()
    assert (q <= bounds.upper).all()


def test_absolute_poses_need_unscaled_commands(arm) -> None:
    with pytest.raises(ValueError, match="absolute_pose"):
        make_arm(arm, mode="absolute_pose")
    chain, _, rest = arm
    controller = make_arm(arm, mode="absolute_pose", command_input_limits=None, command_output_limits=None)
    goal = forward_kinematics(chain, rest + 0.2)
    controller.update_goal([*goal[:3, 3], *vector_of_matrix(goal[:3, :3])], arm_state(rest))
    q = settle(controller, arm_state(rest), 200).value
    assert np.abs(forward_kinematics(chain, q) - goal).max() < 1e-3
    assert controller.noop_command(arm_state(q))[:3] == pytest.approx(goal[:3, 3])


def test_references_never_exceed_velocity_limits(arm) -> None:
    _, bounds, rest = arm
    controller = make_arm(arm, command_input_limits=None, command_output_limits=None)
    controller.update_goal([0.3, 0.3, -0.3, 0.5, 0.5, 0.5], arm_state(rest))
    way = np.array([rest, *(controller.step(arm_state(rest)).value for _ in range(60))])
    assert (np.abs(np.diff(way, axis=0)) <= bounds.velocity * DT + 1e-9).all()


def test_an_arm_that_sags_does_not_creep_under_zero_commands(arm) -> None:
    _chain, _, rest = arm
    controller = make_arm(arm)
    controller.update_goal(np.zeros(6), arm_state(rest))
    first = controller.goal.copy()
    for _ in range(50):
        controller.update_goal(np.zeros(6), arm_state(controller.step(arm_state(rest)).value + 0.01))
    assert np.array_equal(controller.goal, first)
    # led sideways, the tip keeps the height of its goal
    controller.update_goal([0.1, 0, 0, 0, 0, 0], arm_state(rest + 0.01))
    assert controller.goal[2, 3] == pytest.approx(first[2, 3])


def test_the_null_space_moves_joints_to_the_reset_posture(arm) -> None:
    _chain, _, rest = arm
    controller = make_arm(
        arm, mode="position_compliant_ori", command_input_limits=None, command_output_limits=None
    )
    start = rest + np.array([0.0, 0.2, 0.9, 0.1, -0.5, 0.1, 0.8])
    controller.update_goal([0.1, 0.05, 0.0], arm_state(start))
    q = settle(controller, arm_state(start), 200).value
    assert np.linalg.norm(q - rest) < np.linalg.norm(start - rest)


def test_a_detour_is_found_where_steps_stall() -> None:
    chain = from_description(load_description(asset_path("arm7")), "tool", locked={"joint3": 0.0})
    bounds = GroupLimits(
        lower=chain.lower, upper=chain.upper, velocity=chain.velocity, effort=np.full(6, 80.0)
    )
    rest = np.array([0.1, 0.5, -1.2, 0.0, 0.8, 0.2])
    now = GroupState(q=rest, v=np.zeros(6), dt=DT)
    cls = REGISTERED_CONTROLLERS["InverseKinematicsController"]
    goals = forward_kinematics(chain, np.random.default_rng(3).uniform(bounds.lower, bounds.upper, (30, 6)))
    reached = {True: 0, False: 0}
    for way_round in (True, False):
        keys = {"command_input_limits": None, "command_output_limits": None, "way_round": way_round}
        for goal in goals:
            controller = cls(bounds, cls.Settings(mode="absolute_pose", **keys), chain=chain, rest=rest)
            controller.update_goal([*goal[:3, 3], *vector_of_matrix(goal[:3, :3])], now)
            q = settle(controller, now, 300).value
            reached[way_round] += int(np.abs(forward_kinematics(chain, q) - goal).max() < 2e-3)
    assert reached[True] == 30
    assert reached[False] < 30


def test_goals_move_with_the_parent_frame_of_the_arm(arm) -> None:
    _, _, rest = arm
    controller = make_arm(arm)
    before = mount(0.0)
    controller.update_goal([0.0, 0, 0, 0, 0, 0], arm_state(rest, mount=before))
    controller.step(arm_state(rest, mount=before))
    q = settle(controller, arm_state(rest, mount=mount(0.7, 1.0)), 30).value
    assert q == pytest.approx(rest, abs=1e-9)


def test_a_limiter_bounds_the_workspace(arm) -> None:
    _, _, rest = arm
    controller = make_arm(arm, workspace_pose_limiter=lambda p, q: (np.maximum(p, [-9, -9, 0.4]), q))
    for _ in range(20):
        controller.update_goal([0, 0, -1.0, 0, 0, 0], arm_state(rest))
    assert controller.goal[2, 3] >= 0.4


def test_operational_space_control_reaches_the_task_acceleration(arm) -> None:
    chain, bounds, rest = arm
    roomy = GroupLimits(
        lower=bounds.lower, upper=bounds.upper, velocity=bounds.velocity, effort=np.full(7, 1e6)
    )
    cls = REGISTERED_CONTROLLERS["OperationalSpaceController"]
    controller = cls(roomy, cls.Settings(kp=100.0), chain=chain, rest=rest)
    rng = np.random.default_rng(1)
    root = rng.normal(size=(7, 7))
    mass, bias = root @ root.T + np.eye(7), rng.normal(size=7)
    v = rng.normal(size=7) * 0.1
    now = arm_state(rest, v, mass_matrix=mass, bias=bias)
    controller.update_goal([0.5, -0.5, 0.25, 0.2, 0.0, -0.1], now)
    effort = controller.step(now).value
    J = jacobian(chain, rest)
    task = J @ np.linalg.solve(mass, effort - bias)
    error = np.array([0.1, -0.1, 0.05, 0.1, 0.0, -0.05])
    assert task == pytest.approx(100.0 * error - 20.0 * (J @ v), rel=5e-2, abs=5e-2)


def test_rotation_vectors_match_scipy() -> None:
    rng = np.random.default_rng(0)
    for vector in [*rng.normal(size=(50, 3)), np.zeros(3), np.array([np.pi, 0, 0]), np.array([1e-9, 0, 0])]:
        matrix = matrix_of_vector(vector)
        assert matrix == pytest.approx(Rotation.from_rotvec(vector).as_matrix(), abs=1e-12)
        again = vector_of_matrix(matrix)
        assert Rotation.from_rotvec(again).as_matrix() == pytest.approx(matrix, abs=1e-7)


def test_a_registered_controller_drives_any_group_and_keeps_others_names() -> None:
    class Hold(NullJointController):
        """Stays."""

    with pytest.raises(ConfigError, match="JointController is one of Roboyard's controllers"):
        register_controller(type("JointController", (NullJointController,), {}))
    try:
        assert register_controller(Hold) is Hold
        robot = add_robot(World(), "r1", controllers={"gripper_left": "Hold"})
        assert type(robot.controllers["gripper_left"]) is Hold
    finally:
        REGISTERED_CONTROLLERS.pop("Hold", None)
        ADDED_CONTROLLERS.clear()
