"""Links without mass are held, also against what they overlap: numbers of PyBullet 3.2.7."""

from __future__ import annotations

import pytest

import roboyard.pybullet as p


def _arm() -> int:
    box = p.createCollisionShape(
        p.GEOM_BOX, halfExtents=[0.2, 0.05, 0.05], collisionFramePosition=[0.2, 0, 0]
    )
    return p.createMultiBody(
        0,
        box,
        -1,
        [0, 0, 1],
        linkMasses=[1, 1],
        linkCollisionShapeIndices=[box, box],
        linkVisualShapeIndices=[-1, -1],
        linkPositions=[[0.45, 0, 0]] * 2,
        linkOrientations=[[0, 0, 0, 1]] * 2,
        linkInertialFramePositions=[[0.2, 0, 0]] * 2,
        linkInertialFrameOrientations=[[0, 0, 0, 1]] * 2,
        linkParentIndices=[0, 1],
        linkJointTypes=[p.JOINT_REVOLUTE] * 2,
        linkJointAxis=[[0, 1, 0]] * 2,
    )


@pytest.mark.parametrize(
    ("held", "states"),
    [
        ([0, 1], [(0, 0), (0.1, 0)]),
        ([], [(-0.0442, -0.0054), (0.0447, -0.0062)]),
    ],
)
def test_links_that_overlap_what_is_static(
    client: int, held: list[int], states: list[tuple[float, float]]
) -> None:
    p.setGravity(0, 0, -9.8)
    arm = _arm()
    for joint in held:
        p.changeDynamics(arm, joint, mass=0)
    for joint in range(2):
        p.setJointMotorControl2(arm, joint, p.VELOCITY_CONTROL, force=0)
        p.resetJointState(arm, joint, 0.1 * joint)
    block = p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.1, 0.1, 0.1])
    p.createMultiBody(0, block, -1, [1.0, 0, 0.87])
    for _ in range(60):
        p.stepSimulation()
    assert len(p.getContactPoints(arm)) == 4
    for joint, state in enumerate(states):
        assert p.getJointState(arm, joint)[:2] == pytest.approx(state, abs=2e-4)
