"""Frames of links stay old when other bodies are placed, as recorded from PyBullet 3.2.7."""

import numpy as np

from roboyard import pybullet as p

PLACES = [
    (0.19552463769, 0.10089007497, 1.06486871419), (0.19343238546, 0.10096628075, 1.07139038867),
    (0.18069759119, 0.09930276315, 1.10460310357), (0.17612023312, 0.09820281517, 1.11447971954),
    (0.15028436664, 0.08978394026, 1.15832533506), (0.14162999221, 0.0864548461, 1.16990170563),
    (0.09677691052, 0.06707830204, 1.21484385198), (0.0828930682, 0.06058558402, 1.22493143045),
]  # fmt: skip
"""(8, 3) places of the rotor (m), shown in turn before and after each fifth step."""
VELOCITY = (0.12438551996, 0.07346551995, 0.53129531736), (8.66652882749, -17.43918988034, 0.49406778561)


def test_bodies_that_are_placed_leave_the_frames_of_other_bodies_links_old(client: int) -> None:
    """Forces act in these frames, and boxes of what was placed are up to date."""
    body = p.createMultiBody(
        1, p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.1, 0.15, 0.05]), basePosition=[0, 0, 1],
        linkMasses=[0.1],
        linkCollisionShapeIndices=[p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.04, 0.01, 0.005])],
        linkVisualShapeIndices=[-1], linkPositions=[[0.2, 0.1, 0.05]], linkOrientations=[[0, 0, 0, 1]],
        linkInertialFramePositions=[[0, 0, 0]], linkInertialFrameOrientations=[[0, 0, 0, 1]],
        linkParentIndices=[0], linkJointTypes=[p.JOINT_REVOLUTE], linkJointAxis=[[0, 0, 1]],
    )  # fmt: skip
    mark = p.createMultiBody(
        0, baseVisualShapeIndex=p.createVisualShape(p.GEOM_SPHERE, radius=0.01), basePosition=[0, 0, 2]
    )
    ball = p.createMultiBody(1, p.createCollisionShape(p.GEOM_SPHERE, radius=0.1), basePosition=[0, 3, 1])
    p.resetBaseVelocity(body, [0, 0, 0], [2, -3, 1])
    shown = []
    for step in range(20):
        p.resetBasePositionAndOrientation(mark, [0, 0, 2 + 0.01 * step], [0, 0, 0, 1])
        p.resetBaseVelocity(ball, [0, 0, 0.1 * step], [0, 0, 0])
        p.applyExternalForce(body, 0, [0, 0, 9], [0, 0, 0], p.LINK_FRAME)
        p.applyExternalTorque(body, 0, [0.1, 0, 0.2], p.LINK_FRAME)
        if step % 5 == 4:
            shown.append(p.getLinkState(body, 0)[0])
        p.stepSimulation()
        if step % 5 == 4:
            height = 1 + 0.1 * step
            p.resetBasePositionAndOrientation(ball, [0, 3, height], [0, 0, 0, 1])
            shown.append(p.getLinkState(body, 0)[0])
            around = p.getOverlappingObjects([-0.1, 2.9, height - 0.1], [0.1, 3.1, height + 0.1])
            assert around == ((ball, -1),)
    assert np.allclose(shown, PLACES, atol=1e-9)
    assert np.allclose(p.getBaseVelocity(body), VELOCITY, atol=1e-7)
