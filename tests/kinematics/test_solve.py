"""Inverse kinematics: answers checked by an independent forward pass, closed forms and a NumPy reference."""

import numpy as np
import pytest
from scipy.optimize import lsq_linear
from scipy.spatial.transform import Rotation

from roboyard.kinematics import forward_kinematics, jacobian, sample_reachable, solve_ik, solve_ik_batch
from roboyard.transforms import quaternion_from_matrix


def angle_between(a, b):
    return Rotation.from_matrix(a[:3, :3].T @ b[:3, :3]).magnitude()


def twin(chain, target, q, iterations, position_weight, orientation_weight):
    """The same descent in plain NumPy, for one tip, without restarts."""

    def errors(values):
        pose = forward_kinematics(chain, values)
        turn = Rotation.from_matrix(target[:3, :3].T @ pose[:3, :3]).as_rotvec()
        return pose, target[:3, 3] - pose[:3, 3], turn

    def cost_of(shift, turn):
        return 0.5 * (position_weight**2 * shift @ shift + orientation_weight**2 * turn @ turn)

    q = np.clip(q, chain.lower, chain.upper)
    _, shift, turn = errors(q)
    cost, extra, refused = cost_of(shift, turn), 1e-6, 0
    for _ in range(iterations):
        size = np.linalg.norm(turn)
        cross = np.cross(np.eye(3), turn) * -1.0
        b = 1 / 12 if size < 1e-4 else 1 / size**2 - 0.5 / (size * np.tan(size / 2))
        log_rate = np.eye(3) - 0.5 * cross + b * cross @ cross
        columns = jacobian(chain, q)
        rows = np.vstack(
            [position_weight * columns[:3], orientation_weight * log_rate @ target[:3, :3].T @ columns[3:]]
        )
        right = np.concatenate([position_weight * shift, -orientation_weight * turn])
        damping = np.sqrt(extra + 0.1 * cost) * np.eye(chain.size)
        bounds = (np.minimum(chain.lower - q, -1e-12), np.maximum(chain.upper - q, 1e-12))
        padded = np.append(right, np.zeros(chain.size))
        step = lsq_linear(np.vstack([rows, damping]), padded, bounds, method="bvls", tol=1e-14).x
        trial = np.clip(q + step, chain.lower, chain.upper)
        _, new_shift, new_turn = errors(trial)
        if cost_of(new_shift, new_turn) < cost:
            q, shift, turn, refused = trial, new_shift, new_turn, 0
            cost, extra = cost_of(shift, turn), max(0.1 * extra, 1e-9)
        else:
            extra, refused = max(8.0 * extra, 1e-3), refused + 1
    return q


@pytest.mark.parametrize("iterations", [1, 2, 3, 5])
def test_descent_equals_the_numpy_reference(arm, home, iterations):
    _, targets = sample_reachable(arm, 15, seed=4)
    for target in targets:
        answer = solve_ik(arm, target, home, iterations=iterations, restarts=0, tolerance_position=1e-12)
        assert np.allclose(answer.q, twin(arm, target, home, iterations, 1.0, 0.5), atol=1e-7)


def test_all_reachable_poses_are_reached_inside_the_limits(arm, home):
    _, targets = sample_reachable(arm, 200, seed=0)
    for target in targets:
        answer = solve_ik(arm, target, home)
        assert answer.converged
        assert np.all(answer.q >= arm.lower)
        assert np.all(answer.q <= arm.upper)
        pose = forward_kinematics(arm, answer.q)
        distance = np.linalg.norm(pose[:3, 3] - target[:3, 3])
        assert distance < 1e-4
        assert angle_between(pose, target) < 1e-3
        assert answer.position_error == pytest.approx(distance, abs=1e-12)
        assert answer.orientation_error == pytest.approx(angle_between(pose, target), abs=1e-7)


def test_same_seed_same_answer(arm, home):
    _, targets = sample_reachable(arm, 30, seed=8)
    first, second = (solve_ik_batch(arm, targets, home, seed=5) for _ in range(2))
    assert first.descents.max() > 1
    assert np.array_equal(first.q, second.q)


def test_batch_gives_the_single_answers(arm, home):
    _, targets = sample_reachable(arm, 20, seed=6)
    many = solve_ik_batch(arm, targets, home)
    for i, target in enumerate(targets):
        one = solve_ik(arm, target, home, seed=i)
        assert np.array_equal(one.q, many.q[i])
        assert one.iterations == many.iterations[i]


def test_matrix_and_quaternion_targets_agree(arm, home):
    _, (target, *_) = sample_reachable(arm, 1, seed=2)
    pose = np.concatenate([target[:3, 3], 2.0 * quaternion_from_matrix(target[:3, :3])])
    assert np.allclose(solve_ik(arm, target, home).q, solve_ik(arm, pose, home).q, atol=1e-9)


def test_warm_start_follows_a_path_cheaply(arm, home):
    start = forward_kinematics(arm, home)
    path = np.repeat(start[None], 60, axis=0)
    path[:, 1, 3] += np.linspace(0.0, 0.2, 60)
    cold, warm = (solve_ik_batch(arm, path, home, warm_start=w) for w in (False, True))
    assert warm.converged.all()
    assert warm.iterations.sum() < 0.6 * cold.iterations.sum()
    assert np.abs(np.diff(warm.q, axis=0)).max() < 0.1


def test_unreachable_target_gives_the_nearest_posture(planar):
    answer = solve_ik(planar, [0.0, 2.0, 0.0], [0.3, 0.4], restarts=3)
    assert not answer.converged
    assert answer.position_error == pytest.approx(0.5, abs=1e-6)  # 2 m away, arm of 1.5 m
    assert answer.q[0] == pytest.approx(np.pi / 2, abs=1e-3)


def test_answer_stays_inside_the_limits(arm, home):
    beyond = home.copy()
    beyond[3] = 0.6
    answer = solve_ik(arm, forward_kinematics(arm, beyond)[:3, 3], home, restarts=2)
    assert np.all(answer.q <= arm.upper)
    assert np.all(answer.q >= arm.lower)


def test_start_outside_the_limits_is_clipped(arm):
    answer = solve_ik(arm, [0.4, 0.1, 0.6], np.full(7, 9.0), restarts=0, iterations=0)
    assert np.array_equal(answer.q, arm.upper)


def test_position_target_leaves_the_orientation_free(arm, home):
    answer = solve_ik(arm, [0.4, 0.1, 0.6], home, restarts=0)
    assert answer.converged
    assert answer.orientation_error == 0.0
    assert np.allclose(forward_kinematics(arm, answer.q)[:3, 3], [0.4, 0.1, 0.6], atol=1e-4)


def test_free_axis_of_the_tool(arm, home):
    _, targets = sample_reachable(arm, 40, seed=12)
    for target in targets:
        answer = solve_ik(arm, target, home, orientation_weights=(0.5, 0.5, 0.0))
        pose = forward_kinematics(arm, answer.q)
        assert answer.converged
        assert np.linalg.norm(pose[:3, 3] - target[:3, 3]) < 1e-4
        assert np.arccos(min(1.0, pose[:3, 2] @ target[:3, 2])) < 1e-3


def test_free_direction_of_the_base(arm, home):
    target = [0.4, 0.1, 5.0]
    answer = solve_ik(arm, target, home, position_weights=(1, 1, 0))
    assert answer.converged
    assert np.allclose(forward_kinematics(arm, answer.q)[:2, 3], target[:2], atol=1e-4)


def test_orientation_alone(arm, home):
    target = np.eye(4)
    target[:3, :3] = Rotation.from_euler("xyz", [0.3, 1.2, -0.4]).as_matrix()
    answer = solve_ik(arm, target, home, position_weights=0.0)
    assert answer.converged
    assert answer.position_error == 0.0
    assert angle_between(forward_kinematics(arm, answer.q), target) < 1e-3


def test_two_end_effectors_at_once(two_arms):
    _, targets = sample_reachable(two_arms, 30, seed=3)
    many = solve_ik_batch(two_arms, targets)
    assert many.converged.all()
    found = forward_kinematics(two_arms, many.q)
    assert np.linalg.norm(found[..., :3, 3] - targets[..., :3, 3], axis=-1).max() < 1e-4
    assert (
        max(
            angle_between(a, b)
            for x, y in zip(found, targets, strict=True)
            for a, b in zip(x, y, strict=True)
        )
        < 1e-3
    )
    mixed = solve_ik(two_arms, targets[0], orientation_weights=[[0.5, 0.5, 0.5], [0, 0, 0]])
    assert mixed.converged
    assert angle_between(forward_kinematics(two_arms, mixed.q)[0], targets[0, 0]) < 1e-3


def test_free_turning_joints_come_back_near_the_start(planar):
    for start in (-20.0, 0.0, 7.0, 100.0):
        answer = solve_ik(planar, [0.5, 0.9, 0.0], [start, 1.0], seed=3)
        assert answer.converged
        assert np.all(np.abs(answer.q - [start, 1.0]) <= np.pi + 1e-9)


def test_rest_posture_is_approached_within_the_tolerances(arm, home):
    rest = np.array([0.5, 0.8, 0.3, -1.5, -0.4, 0.7, -0.3])
    _, targets = sample_reachable(arm, 40, seed=10)
    nearer = 0
    for target in targets:
        plain, drawn = solve_ik(arm, target, home), solve_ik(arm, target, home, rest=rest)
        assert drawn.converged
        assert np.linalg.norm(forward_kinematics(arm, drawn.q)[:3, 3] - target[:3, 3]) < 1e-4
        a, b = np.linalg.norm(plain.q - rest), np.linalg.norm(drawn.q - rest)
        assert b <= a
        nearer += b < a - 1e-3
    assert nearer >= 30  # the others are at a joint limit


def test_rest_ends_at_the_null_space_minimum(arm, home):
    rest = home + 0.4
    target = forward_kinematics(arm, home)
    answer = solve_ik(arm, target, home, rest=rest, rest_iterations=100)
    slack = (answer.q > arm.lower + 1e-6) & (answer.q < arm.upper - 1e-6)
    free = np.linalg.svd(jacobian(arm, answer.q))[2][6]  # the direction of the null space
    assert slack.all()
    assert abs(free @ (rest - answer.q)) < 0.01


def test_rest_weights_choose_the_joint_that_matters(planar):
    target = [0.5, 0.9, 0.0]
    answer = solve_ik(
        planar, target, [0.0, 1.0], rest=[0.0, 1.0], position_weights=(1, 0, 0), rest_weights=[100, 1]
    )
    other = solve_ik(
        planar, target, [0.0, 1.0], rest=[0.0, 1.0], position_weights=(1, 0, 0), rest_weights=[1, 100]
    )
    assert abs(answer.q[0]) < abs(other.q[0])
    assert abs(answer.q[1] - 1.0) > abs(other.q[1] - 1.0)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"targets": np.zeros(5)}, r"targets have shape \(5,\); give \(3\) or \(7\) or \(4, 4\) for 1 tip"),
        ({"targets": [0, 0, np.nan]}, "the target or its start has a value that is not finite"),
        ({"targets": [0.1, 0, 0, 0, 0, 0, 0]}, "a quaternion of zero length"),
        ({"q0": np.zeros(6)}, r"q0 has shape \(6,\); the chain has 7 joints \(joint1"),
        ({"q0": np.full(7, np.inf)}, "not finite"),
        ({"rest": np.zeros(2)}, r"rest has shape \(2,\)"),
        ({"rest": np.zeros(7), "rest_weights": -1.0}, "rest_weights must not be negative"),
        ({"orientation_weights": [1, 2]}, r"have shapes \(\) and \(2,\); give scalars, \(3,\) or \(1, 3\)"),
        ({"position_weights": -1.0}, "weights must be finite and not negative"),
    ],
)
def test_invalid_arguments_raise(arm, arguments, message):
    given = {"targets": [0.4, 0.1, 0.6], "q0": None} | arguments
    with pytest.raises(ValueError, match=message):
        solve_ik(arm, given.pop("targets"), given.pop("q0"), **given)


def test_batch_names_the_bad_target(arm):
    targets = np.full((4, 3), 0.4)
    targets[2, 1] = np.nan
    with pytest.raises(ValueError, match="target 2 or its start"):
        solve_ik_batch(arm, targets)


def test_chain_without_joints_reports_whether_the_target_is_reached(arm_description):
    from roboyard.kinematics import from_description

    stiff = from_description(arm_description, "tool", base_link="link7")
    assert solve_ik(stiff, [0.0, 0.01, 0.1]).converged
    assert not solve_ik(stiff, [0.0, 0.0, 0.3], restarts=1).converged
