"""Task-space controllers on a gantry, whose Jacobian is the identity, and on the bundled arm."""

from __future__ import annotations

import numpy as np
import pytest
from controller_states import DT, limits, state
from scipy.spatial.transform import Rotation

from roboyard.assets import asset_path
from roboyard.description import load_description
from roboyard.errors import ConfigError, RoboyardError
from roboyard.kinematics import forward_kinematics, from_description, jacobian
from roboyard.robots.control import REGISTERED_CONTROLLERS, GroupLimits
from roboyard.robots.control.task import TaskController

IK, OSC = "InverseKinematicsController", "OperationalSpaceController"
RAW = {"command_input_limits": None, "command_output_limits": None}
FREE = {"mode": "position_compliant_ori", **RAW}
MASS = np.diag([2.0, 3.0, 5.0])
STEP = 1e-3
GANTRY = "<robot name='gantry'><link name='base'/>{parts}</robot>"
SLIDE = (
    "<link name='{child}'/><joint name='{axis}' type='prismatic'><parent link='{parent}'/>"
    "<child link='{child}'/><axis xyz='{vector}'/>"
    "<limit lower='-2' upper='2' effort='1e5' velocity='1e4'/></joint>"
)


@pytest.fixture(scope="module")
def gantry():
    rows = (("x", "base", "a", "1 0 0"), ("y", "a", "b", "0 1 0"), ("z", "b", "tip", "0 0 1"))
    keys = ("axis", "parent", "child", "vector")
    parts = "".join(SLIDE.format(**dict(zip(keys, row, strict=True))) for row in rows)
    chain = from_description(load_description(GANTRY.format(parts=parts)), "tip")
    return chain, limits(3, velocity=1e4, effort=1e5), np.zeros(3)


@pytest.fixture(scope="module")
def arm():
    chain = from_description(load_description(asset_path("arm7")), "tool")
    bounds = GroupLimits(
        lower=chain.lower, upper=chain.upper, velocity=chain.velocity, effort=np.full(7, 1e6)
    )
    return chain, bounds, np.array([0.1, 0.5, 0.0, -1.2, 0.0, 0.8, 0.2])


def make_task(robot, name: str, **keys) -> TaskController:
    chain, bounds, rest = robot
    cls = REGISTERED_CONTROLLERS[name]
    return cls(bounds, cls.Settings(**keys), chain=chain, rest=rest)


def inertia(seed: int, size: int = 7) -> np.ndarray:
    root = np.random.default_rng(seed).normal(size=(size, size))
    return root @ root.T + np.eye(size)


@pytest.mark.parametrize("seconds", [0.1, 0.3])
def test_an_operational_space_tip_moves_like_a_critically_damped_spring(gantry, seconds: float) -> None:
    controller = make_task(gantry, OSC, kp=100.0, kp_null=0.0, **FREE)
    goal, q, v = np.array([0.3, -0.2, 0.1]), np.zeros(3), np.zeros(3)
    controller.update_goal(goal, state(q, mass_matrix=MASS))
    for _ in range(round(seconds / STEP)):
        effort = controller.step(state(q, v, dt=STEP, mass_matrix=MASS)).value
        v = v + STEP * effort / np.diag(MASS)
        q = q + STEP * v
    assert q == pytest.approx(goal * (1 - (1 + 10 * seconds) * np.exp(-10 * seconds)), rel=0.02)


def test_stiffness_and_damping_of_an_operational_space_controller_are_set_axis_by_axis(gantry) -> None:
    kp, ratio = np.array([100.0, 25.0, 4.0, 1, 1, 1]), np.array([1.0, 0.5, 2.0, 1, 1, 1])
    controller = make_task(gantry, OSC, kp=tuple(kp), damping_ratio=tuple(ratio), kp_null=0.0, **FREE)
    v = np.array([0.5, -1.0, 0.25])
    controller.update_goal([0.2, 0.2, 0.2], state(np.zeros(3), mass_matrix=MASS))
    effort = controller.step(state(np.zeros(3), v, mass_matrix=MASS)).value
    expected = np.diag(MASS) * (kp[:3] * 0.2 - 2 * ratio[:3] * np.sqrt(kp[:3]) * v)
    assert effort == pytest.approx(expected, rel=1e-3)


def test_efforts_of_the_null_space_do_not_accelerate_the_tip(arm) -> None:
    chain, _, rest = arm
    start, mass = rest + np.array([0.3, -0.2, 0.5, 0.1, -0.6, 0.2, 0.4]), inertia(4)
    efforts = []
    for kp_null in (0.0, 40.0):
        controller = make_task(arm, OSC, kp_null=kp_null, **RAW)
        controller.update_goal([0.05, 0, 0, 0, 0.1, 0], state(start, mass_matrix=mass))
        efforts.append(controller.step(state(start, mass_matrix=mass)).value)
    joints = np.linalg.solve(mass, efforts[1] - efforts[0])
    tip = jacobian(chain, start) @ joints
    assert np.linalg.norm(joints) > 1.0
    unprojected = jacobian(chain, start) @ (40.0 * (rest - start))
    assert np.linalg.norm(tip) < 0.03 * np.linalg.norm(unprojected)
    assert joints @ (rest - start) > 0.0


def test_decoupled_inertias_are_those_of_position_and_orientation_alone(arm) -> None:
    chain, _, rest = arm
    mass, kp = inertia(2), 80.0
    controller = make_task(arm, OSC, kp=kp, kp_null=0.0, decouple_pos_ori=True, **RAW)
    command = np.array([0.04, -0.02, 0.03, 0.1, -0.05, 0.08])
    controller.update_goal(command, state(rest, mass_matrix=mass))
    effort = controller.step(state(rest, mass_matrix=mass)).value
    J, expected = jacobian(chain, rest), np.zeros(7)
    for rows in (slice(0, 3), slice(3, 6)):
        task_mass = np.linalg.inv(J[rows] @ np.linalg.solve(mass, J[rows].T))
        expected += J[rows].T @ task_mass @ (kp * command[rows])
    assert effort == pytest.approx(expected, rel=0.02, abs=0.02 * np.abs(expected).max())


def test_bias_forces_are_added_unless_switched_off(gantry) -> None:
    bias = np.array([1.0, -2.0, 49.05])
    for compensated, expected in ((True, bias), (False, np.zeros(3))):
        controller = make_task(gantry, OSC, use_cc_compensation=compensated, **FREE)
        assert controller.step(state(np.zeros(3), mass_matrix=MASS, bias=bias)).value == pytest.approx(
            expected
        )


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ({"kp": (1.0, 2.0)}, "kp: must be one number or 6, got 2"),
        ({"kp_null": (1.0,) * 6}, "kp_null: must be one number or 3, got 6"),
        ({"damping_ratio": -0.5}, r"must not be negative, got -0\.5"),
        ({"reset_joint_pos": (0.0, 0.0)}, "reset_joint_pos: must have 3 values, got 2"),
    ],
)
def test_gains_and_postures_that_do_not_fit_are_refused(gantry, keys: dict, message: str) -> None:
    with pytest.raises((ConfigError, ValueError), match=message):
        make_task(gantry, OSC, **keys)


def test_a_chain_must_have_as_many_joints_as_its_group(gantry) -> None:
    chain, _, rest = gantry
    with pytest.raises(ConfigError, match="the chain has 3 joints, the group 2"):
        make_task((chain, limits(2), rest), IK)


def test_the_error_of_inverse_kinematics_decreases_at_the_stated_rate(gantry) -> None:
    """Damped least squares with J = 1: each step removes g / (1 + lambda^2) of the error, g = 15 dt."""
    damping = 0.5
    controller = make_task(gantry, IK, damping=damping, reset_joint_pos=(0.0, 0.0, 0.0), **FREE)
    goal = np.array([0.3, -0.2, 0.1])
    controller.update_goal(goal, state(np.zeros(3), dt=0.01))
    way = np.array([controller.step(state(np.zeros(3), dt=0.01)).value for _ in range(5)])
    errors = np.linalg.norm(goal - way, axis=1)
    rate = errors[1:] / errors[:-1]
    assert rate == pytest.approx(np.full(4, 1 - 0.15 / (1 + damping**2)), abs=0.02)


def test_inverse_kinematics_starts_at_the_limit_for_a_joint_beyond_it(gantry) -> None:
    controller = make_task(gantry, IK, **FREE)
    assert controller.step(state([2.5, 0, 0])).value == pytest.approx([2.0, 0, 0])


def test_targets_of_inverse_kinematics_are_averaged_over_the_filter_size(gantry) -> None:
    plain, smooth = make_task(gantry, IK, **FREE), make_task(gantry, IK, smoothing_filter_size=3, **FREE)
    found = []
    for controller in (plain, smooth):
        controller.update_goal([0.5, 0.2, -0.4], state(np.zeros(3)))
        found.append(np.array([controller.step(state(np.zeros(3))).value for _ in range(8)]))
    expected = [found[0][max(0, k - 2) : k + 1].mean(axis=0) for k in range(8)]
    assert found[1] == pytest.approx(np.array(expected))


def test_inverse_kinematics_by_effort_is_a_spring_to_its_reference(gantry) -> None:
    controller = make_task(gantry, IK, use_impedances=True, pos_kp=36.0, pos_damping_ratio=0.5, **FREE)
    bias, v, q = np.array([0.0, 1.0, 49.0]), np.array([0.1, 0.0, -0.2]), np.array([0.05, 0.0, 0.0])
    now = state(q, v, mass_matrix=MASS, bias=bias)
    controller.step(state(np.zeros(3), mass_matrix=MASS, bias=bias))
    effort = controller.step(now).value
    assert effort == pytest.approx(MASS @ (36.0 * -q - 6.0 * v) + bias)
    assert controller.control_type == "effort"


def test_changes_of_orientation_are_about_the_axes_of_the_base(arm) -> None:
    chain, _, rest = arm
    controller = make_task(arm, IK, **RAW)
    turn = np.array([0.2, -0.1, 0.3])
    controller.update_goal([0, 0, 0, *turn], state(rest))
    before = Rotation.from_matrix(forward_kinematics(chain, rest)[:3, :3])
    expected = Rotation.from_rotvec(turn) * before
    assert controller.goal[:3, :3] == pytest.approx(expected.as_matrix())


def test_changes_relative_to_the_target_add_up_exactly_under_load(arm) -> None:
    chain, _, rest = arm
    controller = make_task(arm, IK, goal_update_mode="target", **RAW)
    sagging = rest + 0.02
    controller.update_goal(np.zeros(6), state(rest))
    for _ in range(10):
        controller.update_goal([0.01, 0, -0.02, 0, 0, 0.05], state(sagging))
    start = forward_kinematics(chain, rest)
    assert controller.goal[:3, 3] == pytest.approx(start[:3, 3] + [0.1, 0, -0.2])
    turned = Rotation.from_euler("z", 0.5).as_matrix() @ start[:3, :3]
    assert controller.goal[:3, :3] == pytest.approx(turned)


def test_a_fixed_orientation_is_that_of_the_first_command_until_a_reset(arm) -> None:
    chain, _, rest = arm
    controller = make_task(arm, IK, mode="position_fixed_ori", **RAW)
    other = rest + 0.3
    for q in (rest, other):
        controller.update_goal([0.01, 0, 0], state(q))
        assert controller.goal[:3, :3] == pytest.approx(forward_kinematics(chain, rest)[:3, :3])
    controller.reset()
    controller.update_goal([0.01, 0, 0], state(other))
    assert controller.goal[:3, :3] == pytest.approx(forward_kinematics(chain, other)[:3, :3])


@pytest.mark.parametrize(
    "mode", ["absolute_pose", "pose_absolute_ori", "pose_delta_ori", "position_fixed_ori"]
)
def test_the_no_op_command_of_a_task_keeps_its_goal(arm, mode: str) -> None:
    chain, _, rest = arm
    controller = make_task(arm, IK, mode=mode, **RAW)
    tip = forward_kinematics(chain, rest)
    first = np.zeros(controller.command_dim)
    if mode == "absolute_pose":
        first[:3] = tip[:3, 3] + 0.05
    if mode in ("absolute_pose", "pose_absolute_ori"):
        first[3:] = Rotation.from_matrix(tip[:3, :3]).as_rotvec()
    controller.update_goal(first, state(rest))
    goal = controller.goal.copy()
    controller.update_goal(controller.noop_command(state(rest + 0.01)), state(rest + 0.01))
    assert controller.goal == pytest.approx(goal, abs=1e-9)


def test_an_absolute_goal_stays_in_the_base_frame_when_the_torso_moves(arm) -> None:
    chain, _, rest = arm
    controller = make_task(arm, IK, mode="absolute_pose", **RAW)
    goal = forward_kinematics(chain, rest)
    controller.update_goal([*goal[:3, 3], *Rotation.from_matrix(goal[:3, :3]).as_rotvec()], state(rest))
    lifted = np.eye(4)
    lifted[2, 3] = 0.1
    assert controller.target(state(rest, mount=lifted))[:3, 3] == pytest.approx(goal[:3, 3] - [0, 0, 0.1])
    delta = make_task(arm, IK, **RAW)
    delta.update_goal(np.zeros(6), state(rest))
    assert delta.target(state(rest, mount=lifted))[:3, 3] == pytest.approx(goal[:3, 3])


def test_unit_commands_of_a_task_are_scaled_to_twenty_centimetres_and_half_a_radian(arm) -> None:
    chain, _, rest = arm
    controller = make_task(arm, OSC)
    controller.update_goal([1, -0.5, 0, 0, 0, 1], state(rest))
    start = forward_kinematics(chain, rest)
    assert controller.goal[:3, 3] == pytest.approx(start[:3, 3] + [0.2, -0.1, 0])
    turn = Rotation.from_matrix(controller.goal[:3, :3] @ start[:3, :3].T).as_rotvec()
    assert turn == pytest.approx([0, 0, 0.5], abs=1e-9)


def test_a_workspace_limiter_must_return_finite_poses(arm) -> None:
    _, _, rest = arm
    controller = make_task(arm, IK, workspace_pose_limiter=lambda p, q: (p * np.nan, q))
    with pytest.raises(RoboyardError, match="workspace_pose_limiter returned a pose that is not finite"):
        controller.update_goal(np.zeros(6), state(rest, dt=DT))


def test_keys_that_omnigibson_stores_without_use_are_accepted_and_checked() -> None:
    inverse = REGISTERED_CONTROLLERS["InverseKinematicsController"].Settings
    assert inverse.model_validate({"condition_on_current_position": False})
    space = REGISTERED_CONTROLLERS["OperationalSpaceController"].Settings
    keys = {"kp_limits": [10, 300], "damping_ratio_limits": [0, 2], "kp_null_limits": [0, 50]}
    assert space.model_validate(keys) == space.model_validate({})
    with pytest.raises(ValueError, match="lower and an upper bound"):
        space.model_validate({"kp_limits": [300, 10]})


def test_a_posture_is_followed_in_that_posture_not_only_at_its_tip(arm) -> None:
    """The tip stays along a path through the null space of an arm with seven joints."""
    chain, _, rest = arm
    path, tip = [rest], forward_kinematics(chain, rest)
    for _ in range(300):  # along the null space, away from the rest posture
        null = np.linalg.svd(jacobian(chain, path[-1]))[2][-1]
        null *= np.sign(null[0]) * 2e-3
        correction = tip[:3, 3] - forward_kinematics(chain, path[-1] + null)[:3, 3]
        path.append(path[-1] + null + np.linalg.pinv(jacobian(chain, path[-1])[:3]) @ correction)
    assert np.abs(path[-1] - rest).max() > 0.3
    controller = make_task(arm, IK, **RAW)
    q = rest
    for posture in path:
        controller.follow_posture(posture, state(q))
        q = controller.step(state(q)).value
        assert q == pytest.approx(posture, abs=1e-9)
    for _ in range(50):
        q = controller.step(state(q)).value
    assert q == pytest.approx(path[-1], abs=1e-4)
    osc = make_task(arm, OSC, kp=100.0, kp_null=100.0, **RAW)
    osc.follow_posture(path[-1], state(path[-1], mass_matrix=inertia(3)))
    effort = osc.step(state(path[-1], mass_matrix=inertia(3))).value
    assert effort == pytest.approx(np.zeros(7), abs=1e-6)  # at rest there, far from its rest posture
    osc.reset()
    effort = osc.step(state(path[-1], mass_matrix=inertia(3))).value
    assert np.abs(effort).max() > 1.0
