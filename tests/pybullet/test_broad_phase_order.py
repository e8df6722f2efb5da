"""The order of links in the tree of boxes is PyBullet's, which gives it away in getOverlappingObjects.

The orders were recorded with PyBullet 3.2.7, asked for all objects after a step.
"""

from __future__ import annotations

from typing import Any

from roboyard import pybullet as p
from roboyard.pybullet.connections import CLIENTS
from roboyard.sim.stepping.broad_phase.box_tree import FIRST, LINK, ROOT, SECOND

RECORDED = {
    0: "10.2 10.3 10.1 10.0 10 8 7 6 9 5 4 3 0 2 1",
    1: "10.2 10.3 10.1 10 10.0 8 7 6 9 4 3 2 5 1 0",
    2: "10.3 10.1 10.2 10.0 10 8 7 4 3 9 6 5 1 2 0",
    3: "10.3 10.1 10.2 10 10.0 8 7 4 3 2 9 6 5 1 0",
    7: "10 10.0 10.3 10.1 10.2 8 7 4 9 6 3 5 2 1 0",
    15: "0 4 8 7 3 1 2 9 6 5 10.0 10 10.3 10.1 10.2",
    19: "1 2 0 8 7 4 3 9 6 5 10.0 10 10.3 10.1 10.2",
    20: "1 0 8 4 9 6 5 2 10 10.0 10.2 10.1 10.3",
    21: "8 4 9 6 5 0 2 1 10.0 10 10.2 10.1 10.3",
    29: "10.2 10.1 10.3 10.0 10 8 4 9 6 5 0 2 1",
    30: "10.2 10.1 10.3 7 9 10.0 10 6 5 8 4 2 1 0",
    31: "10.1 10.2 10.3 7 9 10.0 10 6 5 8 4 2 1 0",
    39: "10.2 10.3 10.1 7 9 10.0 10 6 5 8 4 0 2 1",
    40: "10.2 10.1 10.3 7 9 10.0 10 6 5 8 4 0 1 2",
    41: "10.2 10.1 10.3 7 9 10.0 10 5 6 8 4 0 2 1",
    50: "10.2 10.1 10.3 10.0 10 5 7 8 4 9 6 0 2 1",
    59: "10.2 10.1 10.3 10.0 10 7 9 6 5 8 4 0 2 1",
}
"""Bodies, with their links after a point, by step."""


def _arm() -> int:
    """Create a branching arm, one link of which has no shape and one joint of which is fixed."""
    box = p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.05, 0.06, 0.1])
    return p.createMultiBody(
        1.0,
        p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.1, 0.08, 0.06]),
        basePosition=[0.5, 0.1, 0.7],
        baseOrientation=p.getQuaternionFromEuler([0.1, 0.2, 0.3]),
        linkMasses=[0.5] * 4,
        linkCollisionShapeIndices=[box, -1, box, box],
        linkVisualShapeIndices=[-1] * 4,
        linkPositions=[[0, 0, 0.2], [0.1, 0, 0.1], [0, 0.1, 0.15], [0.02, 0, 0.2]],
        linkOrientations=[[0, 0, 0, 1]] * 4,
        linkInertialFramePositions=[[0, 0, 0.02]] * 4,
        linkInertialFrameOrientations=[[0, 0, 0, 1]] * 4,
        linkParentIndices=[0, 1, 2, 1],
        linkJointTypes=[p.JOINT_REVOLUTE, p.JOINT_FIXED, p.JOINT_REVOLUTE, p.JOINT_PRISMATIC],
        linkJointAxis=[[0, 1, 0], [0, 0, 1], [1, 0, 0], [0, 0, 1]],
    )


def _order(client: int) -> str:
    scene: Any = CLIENTS[client].scene
    points = scene.world.stepping.manifolds.points
    links = {
        int(row): f"{number}.{link - 1}" if link else str(number)
        for number, record in scene.bodies.items()
        for link, row in enumerate(record.body.mujoco_ids)
    }
    found, left = list[str](), [int(points.tree[ROOT])]
    while left:
        node = left.pop()
        if points.ties[node, SECOND] < 0:
            found.append(links[int(points.ties[node, LINK])])
        else:
            left += [int(points.ties[node, FIRST]), int(points.ties[node, SECOND])]
    return " ".join(found)


def test_links_are_in_the_recorded_order_as_bodies_come_go_and_get_filters(client: int) -> None:
    p.setGravity(0, 0, -9.81)
    ground = p.createCollisionShape(p.GEOM_BOX, halfExtents=[3, 3, 0.5])
    p.createMultiBody(0, ground, basePosition=[0, 0, -0.5])
    shapes = [
        p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.1, 0.05, 0.07]),
        p.createCollisionShape(p.GEOM_SPHERE, radius=0.1),
        p.createCollisionShape(p.GEOM_CAPSULE, radius=0.06, height=0.2),
    ]
    bodies = [
        p.createMultiBody(
            1.0,
            shapes[k % 3],
            basePosition=[0.13 * (k % 4) - 0.2, 0.17 * (k % 3) - 0.2, 0.3 + 0.09 * k],
            baseOrientation=p.getQuaternionFromEuler([0.3 * k, 0.2 * k, 0.1]),
        )
        for k in range(9)
    ]
    arm = _arm()
    for step in range(60):
        if step == 20:
            p.removeBody(bodies[2])
            p.removeBody(bodies[6])
        if step == 30:
            p.createMultiBody(1.0, shapes[1], basePosition=[0, 0, 1.2])
        if step == 40:
            p.setCollisionFilterGroupMask(bodies[4], -1, 2, 1)
            p.setCollisionFilterPair(arm, arm, 0, -1, 1)
        p.stepSimulation()
        if step in RECORDED:
            assert _order(client) == RECORDED[step], step
