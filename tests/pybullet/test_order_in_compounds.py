"""The parts of two compounds that touch are taken in PyBullet's order; its numbers are of 3.2.7."""

from __future__ import annotations

from random import Random

import numpy as np
import pytest

from roboyard import pybullet as p
from roboyard.description.model import Pose
from roboyard.pybullet.bullet_rules.contact_order import visits_of

FIVE = [[0, 0, 0], [0.15, 0, 0], [0.3, 0.05, 0], [0.1, 0.15, 0], [0.25, 0.2, 0.02]]
FOUR = [[0, 0, 0], [0.16, 0.02, 0], [0.05, 0.15, 0], [0.2, 0.2, 0]]
RECORDED = {
    0: (10, [0.156181499, 0.084709188, 0.528609177, 1.117591141, -0.95993249, -0.419364028]),
    5: (8, [0.155978909, 0.084599308, 0.527923495, 1.1117261, -0.962072785, -0.418278132]),
    11: (5, [0.402501959, 0.24747334, -0.854617466, -0.187889833, 1.064909252, 1.299639623]),
    17: (1, [-0.232717425, 0.236885885, -1.283752009, -0.149017045, 0.143358484, 2.396145792]),
    23: (1, [0.39931664, 0.19965832, -1.497437399, -0.017586676, 0.48642725, 2.993911527]),
}
"""Number of contacts and velocity (m/s, rad/s) of the upper body after steps."""


def _spheres(radius: float, places: list[list[float]]) -> int:
    count = len(places)
    return p.createCollisionShapeArray(
        shapeTypes=[p.GEOM_SPHERE] * count, radii=[radius] * count, collisionFramePositions=places
    )


@pytest.mark.usefixtures("client")
def test_parts_of_two_compounds_are_taken_as_both_trees_have_them() -> None:
    """Both trees are gone down at once; the last pair of the two bodies takes the place of one that ends."""
    p.setPhysicsEngineParameter(numSolverIterations=3)
    p.createMultiBody(1, _spheres(0.1, FIVE), basePosition=[0, 0, 0.1])
    upper = p.createMultiBody(1, _spheres(0.09, FOUR), -1, [0.05, 0.03, 0.22], [0.018, 0.053, 0.148, 0.987])
    for step in range(24):
        if step % 7 == 6:
            p.resetBaseVelocity(upper, [0.4 * (-1) ** (step // 7), 0.2, -1.5], [0, 0.5, 1 + step / 10])
        p.stepSimulation()
        if step in RECORDED:
            count, velocity = RECORDED[step]
            assert len(p.getContactPoints()) == count, step
            np.testing.assert_allclose(np.ravel(p.getBaseVelocity(upper)), velocity, atol=1e-7)


FALLEN = {
    0: [-0.92947356, 0.52552002, -0.57195056, -0.53821979, -6.69304086, 0.61896485],
    1: [1.00487641, 0.17992584, -0.42269131, -1.49512729, 6.67772003, 0.74507440],
    3: [1.09873936, 0.68833460, 0.29144103, -1.24331133, 0.79108434, 0.04914814],
    18: [-1.25063864, 0.23066829, 0.14264882, -2.25684331, -3.98269069, -0.13473774],
    22: [0.13485190, 0.12715690, 0.18242111, 1.15171532, -1.05832858, -1.88242143],
}
"""Velocities (m/s, rad/s) of the upper body of random ones after 80 steps."""


def _draw(seed: int) -> int:
    """Let two compounds of six spheres, drawn at random, fall onto a block; return the upper one."""
    drawn = Random(seed)
    p.setGravity(0, 0, -30)
    block = p.createCollisionShape(p.GEOM_BOX, halfExtents=[3, 3, 0.5])
    p.createMultiBody(0, block, basePosition=[0, 0, -0.95])
    p.setPhysicsEngineParameter(numSolverIterations=3)
    upper = -1
    for place in [0, 0, 0], [0.1, 0.05, 0.45]:
        centres = [[round(drawn.uniform(-0.3, 0.3), 2) for _ in range(3)] for _ in range(6)]
        shape = _spheres(0.1, centres)
        turn = p.getQuaternionFromEuler([round(drawn.uniform(-1, 1), 1) for _ in range(3)])
        upper = p.createMultiBody(1, shape, -1, place, turn)
    p.changeDynamics(upper, -1, linearDamping=0, angularDamping=0)
    return upper


@pytest.mark.usefixtures("client")
@pytest.mark.parametrize("seed", FALLEN)
def test_turned_compounds_that_fall_on_each_other_move_as_in_pybullet(seed: int) -> None:
    """Parts whose boxes meet in the world, but not along the axes of the first compound, are no pair yet."""
    upper = _draw(seed)
    for _ in range(80):
        p.stepSimulation()
    np.testing.assert_allclose(np.ravel(p.getBaseVelocity(upper)), FALLEN[seed], atol=1e-6)


def _parts(places: list[list[float]]) -> np.ndarray:
    """Return cubes 0.1 m wide as `ShapeForms.parts` has them."""
    parts = np.zeros((len(places), 5, 3))
    parts[:, 0], parts[:, 1:4] = places, 0.05 * np.eye(3)
    return parts


def test_nodes_of_a_tree_come_before_those_below_with_the_parts_of_their_younger_side() -> None:
    """By hand: the third cube joins the second one, the fourth the first one."""
    places = [[0.0, 0, 0], [1.0, 0, 0], [1.2, 0, 0], [-0.3, 0, 0]]
    found = visits_of(_parts(places), [1] * 4, Pose(), nests=False)
    assert found == [(2, 2), (1, 1), (3, 1), (0, 0)]
    found = visits_of(_parts(places), [2, 2], Pose(), nests=False)
    assert [place for place, _ in found] == [3, 2, 1, 0]
    assert [side for _, side in found] == [2, -1, -1, 0]
    found = visits_of(_parts(places[:2]), [2], Pose(), nests=True)
    assert found == [(1, -1), (0, 0)]
