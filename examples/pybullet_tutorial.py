"""PyBullet's first steps in one script: bodies, joints, terrain, gravity, camera, lines.

python examples/pybullet_tutorial.py [film.gif [last_picture.png]]

Replace the two imports of Roboyard by `import pybullet as p, pybullet_data`, and it runs on PyBullet.
"""

import math
import random
import sys

import numpy as np
from PIL import Image

import roboyard.pybullet as p
import roboyard.pybullet_data as pybullet_data

ROWS = 128


def add_terrain() -> int:
    """Add hills of at most half a metre, each as high as its four neighbours."""
    random.seed(10)
    coarse = [[random.uniform(0, 0.5) for _ in range(ROWS // 2)] for _ in range(ROWS // 2)]
    heights = [coarse[j // 2][i // 2] for j in range(ROWS) for i in range(ROWS)]
    shape = p.createCollisionShape(
        p.GEOM_HEIGHTFIELD, meshScale=[0.3, 0.3, 1], heightfieldTextureScaling=(ROWS - 1) / 2,
        heightfieldData=heights, numHeightfieldRows=ROWS, numHeightfieldColumns=ROWS,
    )  # fmt: skip
    terrain = p.createMultiBody(0, shape)
    p.resetBasePositionAndOrientation(terrain, [0, 0, 0], [0, 0, 0, 1])
    return terrain


def picture() -> Image.Image:
    """Return what a camera sees that stands four metres away."""
    view = p.computeViewMatrixFromYawPitchRoll([1, -1, 0.3], 4, 60, -25, 0, upAxisIndex=2)
    lens = p.computeProjectionMatrixFOV(fov=45, aspect=1.6, nearVal=0.01, farVal=100)
    rgba = p.getCameraImage(480, 300, view, lens, shadow=True, lightDirection=[1, 1, 1])[2]
    return Image.fromarray(np.asarray(rgba, np.uint8).reshape(300, 480, 4)[:, :, :3])


def main(film: str = "", last: str = "") -> list[float]:
    """Let a Husky fall onto the terrain; return its heights (m)."""
    p.connect(p.DIRECT)
    p.setAdditionalSearchPath(pybullet_data.getDataPath())
    add_terrain()
    husky = p.loadURDF("husky/husky.urdf", [1, -1, 1.0])
    for joint in range(p.getNumJoints(husky)):
        index, name, kind, *_ = p.getJointInfo(husky, joint)
        print(f"{index}: {name.decode()}, {'revolute' if kind == p.JOINT_REVOLUTE else 'fixed'}")
    p.setGravity(0, 0, -9.807)
    p.setTimeStep(1 / 120)
    heights, frames = [], []
    for step in range(180):
        position, orientation = p.getBasePositionAndOrientation(husky)
        heights.append(position[2])
        if step % 6 == 0:
            roll, pitch, yaw = (math.degrees(angle) for angle in p.getEulerFromQuaternion(orientation))
            print(f"{step / 120:.2f} s: z={position[2]:.3f} m, {roll:.1f}, {pitch:.1f}, {yaw:.1f} degrees")
            frames.append(picture())
        p.stepSimulation()
    for axis in np.eye(3):  # the axes of the base, drawn by addUserDebugLine
        p.addUserDebugLine([0, 0, 0], (1.2 * axis).tolist(), axis.tolist(), 4, parentObjectUniqueId=husky)
    if film:
        frames[0].save(film, save_all=True, append_images=frames[1:], duration=50, loop=0)
    if last:
        picture().save(last)
    p.disconnect()
    return heights


if __name__ == "__main__":
    main(*sys.argv[1:])
