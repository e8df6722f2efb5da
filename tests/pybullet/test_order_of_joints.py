"""Motors and limits of several robots in the order in which PyBullet solves them; numbers are of 3.2.7."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

import roboyard.pybullet as p
from roboyard.sim.stepping.impulses.grouping import order_parts
from roboyard.sim.stepping.impulses.records import EQUALITY, LIMIT, MOTOR, PART
from roboyard.sim.stepping.sequential.solution_order import number_places, quicksort


def _arm(x: float) -> int:
    """Return three links on each other, fixed at the ground, which bend about y."""
    box = p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.05, 0.05, 0.15])
    return p.createMultiBody(
        0,
        basePosition=[x, 0, 0],
        linkMasses=[1] * 3,
        linkCollisionShapeIndices=[box] * 3,
        linkVisualShapeIndices=[-1] * 3,
        linkPositions=[[0, 0, 0.2], [0, 0, 0.35], [0, 0, 0.35]],
        linkOrientations=[[0, 0, 0, 1]] * 3,
        linkInertialFramePositions=[[0, 0, 0]] * 3,
        linkInertialFrameOrientations=[[0, 0, 0, 1]] * 3,
        linkParentIndices=[0, 1, 2],
        linkJointTypes=[p.JOINT_REVOLUTE] * 3,
        linkJointAxis=[[0, 1, 0]] * 3,
    )


@pytest.mark.parametrize(
    ("apart", "wanted"),
    [
        (
            0.104,
            {
                0: (-0.079591, 0.490086, 0.7, 0.079591, -0.490086, -0.7),
                1: (0.050628, 0.491299, 0.7, -0.050628, -0.491299, -0.7),
                4: (-0.277749, 0.341006, 0.346717, 0.277389, -0.341754, -0.350833),
            },
        ),
        (
            1.0,
            {
                0: (-0.083461, 0.5, 0.684781, 0.083461, -0.5, -0.684781),
                1: (0.047125, 0.5, 0.694719, -0.047125, -0.5, -0.694719),
                4: (0.3, 0.38822, 0.75234, -0.3, -0.38822, -0.75234),
            },
        ),
    ],
)
def test_arms_whose_boxes_meet_move_as_in_pybullet(
    client: int, apart: float, wanted: dict[int, tuple[float, ...]]
) -> None:
    """Few rounds of the solver show the order, which also differs before the arms touch each other."""
    p.setGravity(0, 0, -10)
    p.setPhysicsEngineParameter(numSolverIterations=4)
    arms = _arm(0), _arm(apart)
    for arm, sign in zip(arms, (1, -1), strict=True):
        for joint in range(3):
            speed = sign * (0.3 + 0.2 * joint)
            p.setJointMotorControl2(arm, joint, p.VELOCITY_CONTROL, targetVelocity=speed, force=20)
    for step in range(5):
        p.stepSimulation()
        if step in wanted:
            speeds = [p.getJointState(arm, joint)[1] for arm in arms for joint in range(3)]
            np.testing.assert_allclose(speeds, wanted[step], atol=2e-6)


@pytest.mark.parametrize("seed", range(8))
def test_parts_are_sorted_by_the_roots_of_their_groups(seed: int) -> None:
    """The plain version sorts tuples and numbers rows by their kinds."""
    rng = np.random.default_rng(seed)
    trees, dofs, equalities = 6, 20, 4
    groups = np.arange(trees, dtype=np.int32)
    for _ in range(3):
        a, b = sorted(rng.choice(trees, 2, replace=False))
        groups[a] = groups[b]
    places = rng.permutation(trees).astype(np.int32)

    def root(tree: int) -> int:
        place = int(places[tree])
        while groups[place] != place:
            place = int(groups[place])
        return place

    kinds = [(LIMIT, dof, 1) for dof in rng.choice(dofs, 7, replace=False)]
    kinds += [(MOTOR, dof, 1) for dof in range(dofs - 3)] + [(MOTOR, dofs - 3, 3)]
    kinds += [(EQUALITY, number, 1) for number in rng.permutation(equalities)]
    parts = np.full((PART, len(kinds) + 3), -1, np.int32)
    for place, (kind, index, size) in enumerate(kinds):
        parts[:4, place] = kind, index, size, rng.integers(trees)
    names = {"slot": dofs, "limit_slot": dofs, "equality_slot": equalities}
    found = SimpleNamespace(parts=parts, **{name: np.full(n, -1, np.int32) for name, n in names.items()})
    order_parts(found, SimpleNamespace(tree_places=places), groups.copy())

    items = [
        (root(int(parts[3, k])), range(index, index + size), kind)
        for k, (kind, index, size) in enumerate(kinds)
    ]
    quicksort(items)
    wanted = {name: np.zeros(n, np.int32) for name, n in names.items()}
    number_places([(index, kind) for _, dofs, kind in items for index in dofs], *wanted.values())
    for name, values in wanted.items():
        np.testing.assert_array_equal(getattr(found, name), values, err_msg=name)
