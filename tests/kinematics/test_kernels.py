"""The compiled kernels against NumPy and SciPy: frames, logarithms, Jacobians, small solves."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import cho_factor, cho_solve
from scipy.optimize import lsq_linear
from scipy.spatial.transform import Rotation

from roboyard.kinematics import _kernels as kernels
from roboyard.kinematics import _linear as linear


def frame(position: np.ndarray, rotation: Rotation) -> np.ndarray:
    """A frame as the kernels store it: position, then the rotation matrix by rows."""
    return np.concatenate([position, rotation.as_matrix().ravel()])


def matrix(frame_: np.ndarray) -> np.ndarray:
    """(4, 4) pose of a stored frame."""
    pose = np.eye(4)
    pose[:3, 3], pose[:3, :3] = frame_[:3], frame_[3:].reshape(3, 3)
    return pose


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(11)


def random_frames(rng: np.random.Generator, count: int) -> np.ndarray:
    return np.array([frame(rng.normal(size=3), Rotation.random(random_state=rng)) for _ in range(count)])


def random_tree(rng: np.random.Generator, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Nodes in the kernels' layout: a random tree of hinges and slides with multipliers and offsets."""
    whole = np.zeros((count, 3), dtype=np.int64)
    real = np.zeros((count, 14))
    for node in range(count):
        whole[node] = rng.integers(-1, node) if node else -1, rng.integers(0, 2), node
        real[node, :12] = random_frames(rng, 1)[0]
        real[node, 12:] = rng.uniform(0.5, 1.5), rng.uniform(-0.2, 0.2)
    return whole, real


def placed(whole: np.ndarray, real: np.ndarray, q: np.ndarray) -> list[np.ndarray]:
    """(4, 4) pose of every node by products of homogeneous matrices."""
    poses: list[np.ndarray] = []
    for (parent, is_slide, index), numbers in zip(whole, real, strict=True):
        value = numbers[12] * q[index] + numbers[13]
        motion = np.eye(4)
        if is_slide:
            motion[2, 3] = value
        else:
            motion[:3, :3] = Rotation.from_rotvec([0.0, 0.0, value]).as_matrix()
        before = np.eye(4) if parent < 0 else poses[parent]
        poses.append(before @ matrix(numbers[:12]) @ motion)
    return poses


def test_composition_is_the_product_of_matrices(rng: np.random.Generator) -> None:
    a, b = random_frames(rng, 5), random_frames(rng, 5)
    out = np.empty((5, 12))
    for i in range(5):
        kernels.compose(out, i, a, i, b, i)
        np.testing.assert_allclose(matrix(out[i]), matrix(a[i]) @ matrix(b[i]), atol=1e-14)


def test_composition_may_write_over_its_input_array(rng: np.random.Generator) -> None:
    frames, local = random_frames(rng, 2), random_frames(rng, 1)
    expected = matrix(frames[0]) @ matrix(local[0])
    kernels.compose(frames, 1, frames, 0, local, 0)
    np.testing.assert_allclose(matrix(frames[1]), expected, atol=1e-14)


@pytest.mark.parametrize("count", [1, 2, 7, 20])
def test_nodes_of_a_tree_are_products_along_their_branches(rng: np.random.Generator, count: int) -> None:
    whole, real = random_tree(rng, count)
    q, frames = rng.uniform(-2, 2, count), np.empty((count, 12))
    kernels.place_nodes(whole, real, q, frames)
    for found, expected in zip(frames, placed(whole, real, q), strict=True):
        np.testing.assert_allclose(matrix(found), expected, atol=1e-12)


def test_links_keep_their_offset_from_a_node_or_the_base(rng: np.random.Generator) -> None:
    frames, local = random_frames(rng, 3), random_frames(rng, 2)
    out = np.empty((2, 12))
    kernels.place_links(frames, np.array([2, -1]), local, out)
    np.testing.assert_allclose(matrix(out[0]), matrix(frames[2]) @ matrix(local[0]), atol=1e-14)
    np.testing.assert_array_equal(out[1], local[1])


def test_batch_is_each_configuration_alone(rng: np.random.Generator) -> None:
    whole, real = random_tree(rng, 6)
    node, local = np.array([5, 1]), random_frames(rng, 2)
    qs = rng.uniform(-1, 1, (4, 6))
    out, frames = np.empty((4, 2, 12)), np.empty((6, 12))
    kernels.forward_batch(whole, real, node, local, qs, frames, out)
    for q, found in zip(qs, out, strict=True):
        poses = placed(whole, real, q)
        for k in range(2):
            np.testing.assert_allclose(matrix(found[k]), poses[node[k]] @ matrix(local[k]), atol=1e-12)


def test_jacobian_is_the_derivative_of_the_pose(rng: np.random.Generator) -> None:
    whole, real = random_tree(rng, 8)
    node, local, q = np.array([7]), random_frames(rng, 1), rng.uniform(-1, 1, 8)
    frames, tip, out = np.empty((8, 12)), np.empty((1, 12)), np.empty((8, 6))
    kernels.jacobian_at(whole, real, node, local, q, frames, tip, out)
    pose, step = matrix(tip[0]), 1e-6
    for j in range(8):
        ahead, behind = q.copy(), q.copy()
        ahead[j] += step
        behind[j] -= step
        after, before = (placed(whole, real, value)[7] @ matrix(local[0]) for value in (ahead, behind))
        turn = Rotation.from_matrix(after[:3, :3] @ before[:3, :3].T).as_rotvec() / (2 * step)
        np.testing.assert_allclose(out[j, :3], (after - before)[:3, 3] / (2 * step), atol=1e-7)
        np.testing.assert_allclose(out[j, 3:], turn, atol=1e-7)
    np.testing.assert_allclose(pose, placed(whole, real, q)[7] @ matrix(local[0]), atol=1e-12)


@pytest.mark.parametrize("width", [3, 7, 16])
def test_targets_are_read_as_frames(rng: np.random.Generator, width: int) -> None:
    position, turn = rng.normal(size=(4, 3)), Rotation.random(4, random_state=rng)
    expected = np.array([frame(p, r) for p, r in zip(position, turn, strict=True)])
    if width == 3:
        targets = position
        expected[:, 3:] = np.eye(3).ravel()
    elif width == 7:
        targets = np.hstack([position, 3.0 * turn.as_quat()])  # any length
    else:
        targets = np.array([matrix(row).ravel() for row in expected])
    out = np.empty((4, 12))
    assert kernels.read_targets(np.ascontiguousarray(targets), out)
    np.testing.assert_allclose(out, expected, atol=1e-12)


@pytest.mark.parametrize("wrong", [np.nan, np.inf])
def test_targets_that_are_not_finite_are_noticed(wrong: float) -> None:
    targets = np.array([[0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]])
    targets[0, 1] = wrong
    assert not kernels.read_targets(targets, np.empty((1, 12)))


def test_quaternion_of_length_zero_is_noticed() -> None:
    assert not kernels.read_targets(np.zeros((1, 7)), np.empty((1, 12)))


@pytest.mark.parametrize("angle", [0.0, 1e-9, 1e-4, 0.7, 2.0, np.pi - 1e-4, np.pi - 1e-9])
def test_rotation_logarithm_is_scipys(rng: np.random.Generator, angle: float) -> None:
    axis = rng.normal(size=3)
    axis /= np.linalg.norm(axis)
    target = Rotation.random(random_state=rng)
    tip = target * Rotation.from_rotvec(angle * axis)
    rows = np.array([frame(np.zeros(3), target)]), np.array([frame(np.zeros(3), tip)])
    np.testing.assert_allclose(kernels.rotation_log(rows[0], 0, rows[1], 0), angle * axis, atol=3e-8)


def test_task_errors_count_only_what_has_a_weight(rng: np.random.Generator) -> None:
    target, tip = random_frames(rng, 2), random_frames(rng, 2)
    weights = np.array([[1.0, 2.0, 0.0, 0.5, 0.5, 0.0], [1.0, 1.0, 1.0, 0.0, 0.0, 0.0]])
    raw, errors = np.zeros((2, 6)), np.zeros((2, 2))
    cost = kernels.task_errors(target, weights, tip, raw, errors)
    expected = 0.0
    for t in range(2):
        difference = target[t, :3] - tip[t, :3]
        turn = (
            Rotation.from_matrix(target[t, 3:].reshape(3, 3)).inv()
            * Rotation.from_matrix(tip[t, 3:].reshape(3, 3))
        ).as_rotvec()
        parts = np.concatenate([difference, turn])
        has_weight = weights[t] > 0
        expected += 0.5 * np.sum((weights[t] * parts)[has_weight] ** 2)
        assert errors[t, 0] == pytest.approx(np.linalg.norm(difference[has_weight[:3]]))
        assert errors[t, 1] == pytest.approx(np.linalg.norm(turn[has_weight[3:]]))
    assert cost == pytest.approx(expected)


def test_normal_equations_are_products_of_the_jacobian(rng: np.random.Generator) -> None:
    jac, rhs = rng.normal(size=(7, 6)), rng.normal(size=6)
    hessian, gradient = np.empty((7, 7)), np.empty(7)
    linear.normal_equations(jac, rhs, hessian, gradient)
    np.testing.assert_allclose(hessian, jac @ jac.T, atol=1e-12)
    np.testing.assert_allclose(gradient, jac @ rhs, atol=1e-12)


def test_free_entries_are_solved_by_cholesky(rng: np.random.Generator) -> None:
    jac, damping, right = rng.normal(size=(6, 9)), rng.uniform(0.1, 1.0, 6), rng.normal(size=6)
    hessian = jac @ jac.T
    free = np.array([0, 2, 3, 5, 0, 0])
    factor, step = np.zeros((6, 6)), np.full(6, 9.0)
    linear.solve_free(hessian, damping, right, free, 4, factor, step)
    rows = free[:4]
    expected = cho_solve(cho_factor((hessian + np.diag(damping))[np.ix_(rows, rows)]), right[rows])
    np.testing.assert_allclose(step[rows], expected, atol=1e-10)
    np.testing.assert_array_equal(step[[1, 4]], 9.0)  # untouched


@pytest.mark.parametrize("seed", range(12))
def test_bounded_step_is_scipys_bounded_least_squares(seed: int) -> None:
    rng = np.random.default_rng(seed)
    n = int(rng.integers(1, 12))
    jac, rhs = rng.normal(size=(n, 6)), rng.normal(size=6)
    damping = rng.uniform(1e-3, 0.3, n)
    low, high = -rng.uniform(0.0, 0.4, n), rng.uniform(0.0, 0.4, n)
    hessian, gradient = jac @ jac.T, jac @ rhs
    free, right = np.zeros(2 * n, dtype=np.int64), np.empty(n)
    factor, step = np.zeros((n, n)), np.empty(n)
    linear.bounded_step(hessian, damping, gradient, low, high, free, right, factor, step)
    system = np.vstack([jac.T, np.diag(np.sqrt(damping))])
    expected = lsq_linear(system, np.concatenate([rhs, np.zeros(n)]), (low - 1e-12, high + 1e-12), tol=1e-14)
    np.testing.assert_allclose(step, expected.x, atol=2e-6)
    assert np.all(step >= low) and np.all(step <= high)
