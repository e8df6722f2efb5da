"""Single steps: closed forms, SciPy's bounded least squares, and PyBullet's recorded answers."""

import numpy as np
import pytest
from scipy.optimize import lsq_linear
from scipy.spatial.transform import Rotation

from roboyard.kinematics import (
    damped_step_ik,
    differential_step,
    differential_velocity,
    forward_kinematics,
    from_description,
    jacobian,
)
from roboyard.kinematics.steps import plain_steps

POSITION, ORIENTATION = [0.35, 0.2, 0.7], [0.5, 0.5, -0.5, 0.5]


def shifted(pose, shift, turn):
    out = pose.copy()
    out[:3, 3] += shift
    out[:3, :3] = Rotation.from_rotvec(turn).as_matrix() @ out[:3, :3]
    return out


def test_position_step_is_the_damped_least_squares_solution(arm, home):
    error = np.array([0.01, -0.02, 0.015])
    target = forward_kinematics(arm, home)[:3, 3] + error
    columns = jacobian(arm, home)[:3]
    expected = np.linalg.solve(columns.T @ columns + 0.1**2 * np.eye(7), columns.T @ (0.5 * error))
    assert np.allclose(
        differential_step(arm, home, target, gain=0.5, damping=0.1), home + expected, atol=1e-10
    )


def test_repeated_steps_reach_the_pose(arm, home):
    target = shifted(forward_kinematics(arm, home), [0.1, -0.05, 0.08], [0.2, -0.3, 0.1])
    q = home
    for _ in range(30):
        previous, q = q, differential_step(arm, q, target, max_step=0.1)
        assert np.abs(q - previous).max() <= 0.1 + 1e-12
    pose = forward_kinematics(arm, q)
    assert np.linalg.norm(pose[:3, 3] - target[:3, 3]) < 1e-4
    assert Rotation.from_matrix(pose[:3, :3].T @ target[:3, :3]).magnitude() < 1e-3


@pytest.mark.parametrize("seed", range(20))
def test_bounded_step_is_the_optimum_of_bounded_least_squares(arm, home, seed):
    random = np.random.default_rng(seed)
    error = random.uniform(-0.2, 0.2, 3)
    bound = random.uniform(0.01, 0.1, 7)
    target = forward_kinematics(arm, home)[:3, 3] + error
    step = differential_step(arm, home, target, damping=0.1, max_step=bound) - home
    rows = np.vstack([jacobian(arm, home)[:3], 0.1 * np.eye(7)])
    right = np.append(error, np.zeros(7))
    best = lsq_linear(rows, right, (-bound, bound), tol=1e-14)
    assert np.allclose(step, best.x, atol=1e-6)
    assert np.all(np.abs(step) <= bound + 1e-12)
    assert np.sum((rows @ step - right) ** 2) <= 2 * best.cost + 1e-9


def test_joints_outside_their_limits_are_brought_back(arm, home):
    q = home.copy()
    q[3] = 0.15  # the limit is 0.1
    target = forward_kinematics(arm, q)
    assert differential_step(arm, q, target)[3] <= 0.1 + 1e-12
    assert differential_step(arm, q, target, max_step=0.02)[3] == pytest.approx(0.13)


def test_rest_moves_the_joints_and_not_the_tip(arm, home):
    target, q = forward_kinematics(arm, home), home
    rest = home + np.array([0.6, -0.2, -0.5, 0.1, 0.4, 0.2, -0.3])
    for _ in range(200):
        q = differential_step(arm, q, target, rest=rest, rest_gain=0.1)
        assert np.linalg.norm(forward_kinematics(arm, q)[:3, 3] - target[:3, 3]) < 1e-3
    free = np.linalg.svd(jacobian(arm, q))[2][6]
    assert np.abs(q - home).max() > 0.1
    assert abs(free @ (rest - q)) < 0.02


def test_velocity_gives_the_twist(arm, home):
    twist = np.array([0.05, -0.02, 0.04, 0.1, 0.05, -0.08])
    velocity = differential_velocity(arm, home, twist, 0.01, damping=1e-6)
    assert np.allclose(jacobian(arm, home) @ velocity, twist, atol=1e-6)


def test_velocity_keeps_speed_and_position_limits(arm, home):
    assert np.all(np.abs(differential_velocity(arm, home, [3, 0, 0, 0, 0, 0], 0.01)) <= arm.velocity + 1e-12)
    q = home.copy()
    q[3] = arm.upper[3] - 0.001
    for direction in np.eye(6):
        for sign in (-1.0, 1.0):
            velocity = differential_velocity(arm, q, sign * direction, 0.01)
            assert np.all(q + 0.01 * velocity <= arm.upper + 1e-12)


def test_two_end_effectors_step_together(two_arms):
    q = np.array([0.2, 0.1, 0.3, 0.4, -0.2, 0.5, 0.1, -0.3, 0.4, 0.2, 0.5, -0.1])
    targets = forward_kinematics(two_arms, q + 0.1 * np.sin(np.arange(12.0)))
    for _ in range(200):
        q = differential_step(two_arms, q, targets, damping=0.02)
    assert np.allclose(forward_kinematics(two_arms, q), targets, atol=2e-3)


# PyBullet 3.2.7 on the same joints from the same posture, single calls, no simulation step between.
NULL_SPACE = {"lower": -0.5, "upper": 0.5, "ranges": 2.0, "rest": [0.2, -0.1, 0.3, -1.5, 0.0, 0.4, -0.3]}
RECORDED = {
    "position": (
        POSITION,
        {},
        [0.228750589673, -0.258551914579, -0.17930246168, -1.860255716264, -0.023125436871, 1.22213821995,
         0.323354509326],
    ),
    "pose": (
        POSITION + ORIENTATION,
        {},
        [1.341321733356, 1.157185470612, -2.061753822862, -1.548983086237, -0.874604046636, 1.910041706118,
         0.011799150817],
    ),
    "joint damping": (
        POSITION + ORIENTATION,
        {"joint_damping": [0.1, 0.2, 0.3, 0.05, 0.1, 0.2, 0.4]},
        [1.59792689185, 0.761112152166, -1.725279147939, -1.525870735906, -1.615294566969, 2.278057419439,
         -0.223292039478],
    ),
    "threshold": (
        POSITION + ORIENTATION,
        {"iterations": 200, "residual_threshold": 0.02},
        [1.432320306675, 1.174525411372, -2.117272744721, -1.569276577852, -0.937627622148, 2.010667453395,
         0.082063665705],
    ),
    "null space": (
        POSITION + ORIENTATION,
        NULL_SPACE,
        [-0.493680111756, 0.395552406702, -0.497925008241, -1.133276764245, -0.451329509823, 0.245260855577,
         0.0686957028],
    ),
    "null space, position": (
        POSITION,
        NULL_SPACE,
        [0.375595536298, 0.623846064162, -0.088537198325, -0.245321375613, -0.204751319514, 0.393074710635,
         0.371040868087],
    ),
}  # fmt: skip


PLAIN = {"iterations", "residual_threshold"}


@pytest.mark.parametrize("case", RECORDED)
def test_plain_descent_is_pybullets(arm, home, case):
    target, options, expected = RECORDED[case]
    assert np.allclose(damped_step_ik(arm, home, target, **options), expected, atol=2e-7)


@pytest.mark.parametrize("case", [name for name, (_, options, _) in RECORDED.items() if {*options} <= PLAIN])
def test_plain_steps_of_checked_arrays_are_pybullets(arm, home, case):
    target, options, expected = RECORDED[case]
    steps, threshold = options.get("iterations", 20), options.get("residual_threshold", 1e-4)
    found = plain_steps(arm, home.copy(), np.array([target], dtype=float), threshold, steps)
    assert np.allclose(found, expected, atol=2e-7)


def test_plain_descent_with_two_tips_is_pybullets(arm_description, home):
    chain = from_description(arm_description, ["link5", "tool"])
    expected = [0.17654363887387564, 0.00332173091520925, -0.2127966735810758, -1.8549749698838416,
                -0.12298959559665519, 1.3470082153341547, 0.33519741201652364]  # fmt: skip
    assert np.allclose(damped_step_ik(chain, home, [[0.3, 0.1, 0.8], [0.35, 0.15, 0.6]]), expected, atol=1e-9)


def test_plain_descent_does_not_change_its_start(arm, home):
    before = home.copy()
    damped_step_ik(arm, home, POSITION)
    assert np.array_equal(home, before)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda c, q: damped_step_ik(c, q, POSITION, lower=-1.0, upper=1.0), "belong together"),
        (lambda c, q: damped_step_ik(c, q, [np.inf, 0, 0]), "must be finite"),
        (
            lambda c, q: damped_step_ik(c, q, POSITION, joint_damping=[1, 2]),
            r"joint_damping has shape \(2,\)",
        ),
        (lambda c, q: differential_step(c, q[:3], POSITION), r"q has shape \(3,\)"),
        (lambda c, q: differential_step(c, q, [np.nan, 0, 0]), "must be finite"),
        (
            lambda c, q: differential_step(c, q, POSITION, max_step=-0.1),
            "one positive number or one per joint, got -0.1",
        ),
        (
            lambda c, q: differential_velocity(c, q, np.zeros(5), 0.01),
            r"twists have shape \(5,\); give \(1, 6\)",
        ),
        (lambda c, q: differential_velocity(c, q, np.zeros(6), 0.0), "dt must be positive \\(s\\), got 0.0"),
    ],
)
def test_invalid_arguments_raise(arm, home, call, message):
    with pytest.raises(ValueError, match=message):
        call(arm, home)


# PyBullet 3.2.7 from zero; the target is half a turn away, and rounding decides which way round it goes.
HALF_TURNS = {
    (0.0, -1.0, 0.0, 6e-17): [0.214437431, 1.061258868, -0.044259396, 1.179199202, -0.268517914, -3.016933434,
                              -0.075248655],
    (1.0, 0.0, 0.0, 6e-17): [0.968800198, 0.420992804, -1.576402768, -0.571423746, -2.43964123, -2.457759139,
                             -0.028613474],
    (0.0, 0.0, 1.0, 6e-17): [-0.705932722, 1.124323101, -1.132729763, 1.715876376, -1.060189584, 1.248403803,
                             -1.178624355],
    (4e-17, 0.5**0.5, 0.5**0.5, 4e-17): [-0.711993975, 1.308361126, -0.371485336, 1.443306088, -0.747328089,
                                         -1.234768186, -1.735110168],
}  # fmt: skip


@pytest.mark.parametrize("turn", HALF_TURNS)
def test_half_a_turn_goes_round_as_in_pybullet(straight_arm, turn):
    chain = from_description(straight_arm, "link7")
    found = damped_step_ik(chain, np.zeros(7), [0.3, 0.1, 0.8, *turn])
    assert np.allclose(found, HALF_TURNS[turn], atol=2e-8)
    other_sign = damped_step_ik(chain, np.zeros(7), [0.3, 0.1, 0.8, *(-v for v in turn)])
    assert np.allclose(other_sign, HALF_TURNS[turn], atol=2e-8)
