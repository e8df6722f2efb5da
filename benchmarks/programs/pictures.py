"""A camera turns around an R2D2 and takes 60 pictures of 320 by 240 pixels."""

import pybullet_data

import pybullet as p

p.connect(p.DIRECT)
p.setAdditionalSearchPath(pybullet_data.getDataPath())
p.loadURDF("plane.urdf")
p.loadURDF("r2d2.urdf", [0, 0, 0.5])
projection = p.computeProjectionMatrixFOV(60, 320 / 240, 0.1, 20)
for i in range(60):
    view = p.computeViewMatrixFromYawPitchRoll([0, 0, 0.5], 2.5, 6 * i, -25, 0, 2)
    colours = p.getCameraImage(320, 240, view, projection, renderer=p.ER_TINY_RENDERER)[2]
print(len(colours))
