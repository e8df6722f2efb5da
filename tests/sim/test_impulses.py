"""The two ways in which rows are solved in turn give the same impulses, those of a plain loop in Python."""

import numpy as np
import pytest

from roboyard.sim.stepping import impulse_kernels as kernels
from roboyard.sim.stepping.impulse_records import LINES


def problem(seed: int) -> dict[str, np.ndarray]:
    """Return two trees with four motors, two normals and the sliding rows of both."""
    rng = np.random.default_rng(seed)
    tree_dof, tree_dofs = np.array([0, 4], np.int32), np.array([4, 6], np.int32)
    mass = np.zeros((10, 10))
    for start, size in zip(tree_dof, tree_dofs, strict=True):
        part = rng.normal(size=(size, size))
        mass[start : start + size, start : start + size] = part @ part.T + np.eye(size)
    rows = np.array(
        [[k, 0, -1, -1] for k in range(4)]
        + [[4, 0, 1, 4], [5, 1, -1, 5]]
        + [[6 + k, 0, 1, 4] for k in range(2)]
        + [[8 + k, 1, -1, 5] for k in range(2)],
        np.int32,
    )
    jacobian = np.zeros((10, 10))
    for n, (_, a, b, _) in enumerate(rows):
        for tree in (a, b):
            if tree >= 0:
                here = slice(tree_dof[tree], tree_dof[tree] + tree_dofs[tree])
                jacobian[n, here] = rng.normal(size=tree_dofs[tree])
    goals = np.zeros((10, 5))
    goals[:, 0] = rng.normal(size=10)
    goals[:4, 1], goals[:4, 2] = -0.3, 0.3
    goals[4:6, 2] = 1e10
    goals[6:, 1] = goals[6:, 2] = 0.4
    goals[5, 4] = 0.05
    return {
        "rows": rows,
        "goals": goals,
        "ends": np.array([4, 6, 6, 6, 10], np.int32),
        "jacobian": jacobian,
        "response": np.linalg.solve(mass, jacobian.T).T.copy(),
        "tree_dof": tree_dof,
        "tree_dofs": tree_dofs,
    }


def reference(given: dict[str, np.ndarray], rounds: int) -> np.ndarray:
    """Return the impulses after some rounds, by dense products."""
    J, R, goals = given["jacobian"], given["response"], given["goals"]
    impulses, change = np.zeros(10), np.zeros(10)
    own = np.einsum("nd,nd->n", J, R) + goals[:, 4]

    def wish(n: int) -> float:
        return impulses[n] + (goals[n, 0] - goals[n, 4] * impulses[n] - J[n] @ change) / own[n]

    for turn in range(rounds):
        for n in [*(range(3, -1, -1) if turn % 2 == 0 else range(4)), 4, 5]:
            new = np.clip(wish(n), goals[n, 1], goals[n, 2])
            change += R[n] * (new - impulses[n])
            impulses[n] = new
        for n, normal in ((6, 4), (8, 5)):
            new = np.array([wish(n), wish(n + 1)])
            bound = 0.4 * max(impulses[normal], 0.0)
            new *= min(1.0, bound / np.linalg.norm(new))
            change += (new - impulses[n : n + 2]) @ R[n : n + 2]
            impulses[n : n + 2] = new
    return impulses


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("rounds", [1, 2, 50])
def test_both_ways_of_solving_in_turn_are_the_plain_loop(seed: int, rounds: int) -> None:
    expected = reference(problem(seed), rounds)
    for by_table in (True, False):
        given = problem(seed)
        response, change = given["response"], np.zeros(10)
        if by_table:
            across = np.zeros((10, 12))  # in whole blocks of four rows
            across[:, :10] = response.T
            given["response"] = across
            kernels.solve_by_table(
                *given.values(), rounds, 0.0, np.zeros((10, 12)), np.zeros((LINES, 12)), change
            )
        else:
            kernels.solve_in_turn(*given.values(), rounds, 0.0, np.zeros(10), np.zeros(2), change)
        assert np.allclose(given["goals"][:, 3], expected, atol=1e-12)
        assert np.allclose(change, expected @ response, atol=1e-12)
