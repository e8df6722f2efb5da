"""A program written for PyBullet, without a word of Roboyard: an arm draws a circle among falling blocks.

roboyard run examples/pybullet_project.py [PICTURE.png]     on Roboyard, unchanged
python examples/pybullet_project.py                         on PyBullet, where that is installed
"""

import math
import sys
import time

import numpy as np
import pybullet_data

import pybullet as p

CENTRE, RADIUS = (0.5, 0.0, 0.5), 0.15


def main(picture: str = "") -> float:
    """Draw two circles; return the largest distance of the tip from the second one (m)."""
    p.connect(p.DIRECT)
    p.setAdditionalSearchPath(pybullet_data.getDataPath())
    p.setGravity(0, 0, -9.81)
    p.loadURDF("plane.urdf")
    arm = p.loadURDF("kuka_iiwa/model.urdf", useFixedBase=True)
    tip = p.getNumJoints(arm) - 1
    for joint, angle in enumerate((0, 0.6, 0, -1.2, 0, 1.2, 0)):
        p.resetJointState(arm, joint, angle)
    shape = p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.04] * 3)
    blocks = [p.createMultiBody(0.2, shape, basePosition=(-0.4, 0, 0.1 + 0.1 * k)) for k in range(8)]

    begin, worst, steps = time.process_time(), 0.0, 8 * 240
    for k in range(steps):
        angle = 2 * math.pi * k / (steps / 2)
        y, z = CENTRE[1] + RADIUS * math.cos(angle), CENTRE[2] + RADIUS * math.sin(angle)
        goal = (CENTRE[0], y, z)
        q = p.calculateInverseKinematics(arm, tip, goal, maxNumIterations=20)
        p.setJointMotorControlArray(arm, range(7), p.POSITION_CONTROL, q, forces=[300] * 7)
        if k % 240 == 120:
            p.applyExternalForce(blocks[-1], -1, (8, 0, 0), (0, 0, 0), p.LINK_FRAME)
        p.stepSimulation()
        if k > steps / 2:
            worst = max(worst, float(np.linalg.norm(np.subtract(p.getLinkState(arm, tip)[4], goal))))
    spent = time.process_time() - begin
    print(f"{steps} steps, the tip is within {1000 * worst:.1f} mm of the circle ({spent:.2f} s of CPU)")
    print(
        f"{len(p.getContactPoints())} contacts; a ray down hits body",
        p.rayTest((-0.4, 0, 3), (-0.4, 0, 0))[0][0],
    )
    if picture:
        view = p.computeViewMatrix((1.8, -1.4, 1.2), (0.1, 0, 0.4), (0, 0, 1))
        image = p.getCameraImage(480, 360, view, p.computeProjectionMatrixFOV(45, 4 / 3, 0.1, 5))
        from PIL import Image

        Image.fromarray(np.reshape(image[2], (360, 480, 4)).astype(np.uint8)).save(picture)
    p.disconnect()
    return worst


if __name__ == "__main__":
    main(*sys.argv[1:2])
