"""Loading compiled code when a process first connects, so that its first step is fast.

The compiled loops of a step and of creating bodies take a third of a second to load from disk.
"""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING, Any

from roboyard.pybullet.face import constants as c

if TYPE_CHECKING:
    from roboyard.pybullet.client import Client


@cache
def warm_up(make: type[Client]) -> None:
    """Step two boxes and a motor in a temporary client; does nothing when called again.

    Args:
        make: class of the client.
    """
    client: Any = make(c.DIRECT)
    client.setGravity(0, 0, -10)
    box = client.createCollisionShape(c.GEOM_BOX, halfExtents=[0.1, 0.1, 0.1])
    client.createMultiBody(0, box)
    body = client.createMultiBody(
        1, box, -1, [0, 0, 0.199],
        linkMasses=[1], linkCollisionShapeIndices=[-1], linkVisualShapeIndices=[-1],
        linkPositions=[[0, 0, 0]], linkOrientations=[[0, 0, 0, 1]],
        linkInertialFramePositions=[[0, 0, 0]], linkInertialFrameOrientations=[[0, 0, 0, 1]],
        linkParentIndices=[0], linkJointTypes=[c.JOINT_REVOLUTE], linkJointAxis=[[0, 0, 1]],
    )  # fmt: skip
    client.setJointMotorControl2(body, 0, c.POSITION_CONTROL, 0.1)
    for _ in range(3):
        client.stepSimulation()
        client.createMultiBody(1, box, -1, [1, 0, 1])
    client.getLinkState(body, 0, 1, 1)
    client.getJointStates(body, [0])
