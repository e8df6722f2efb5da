"""An R2D2 falls onto a plane: the first script of PyBullet's guide, five simulated seconds."""

import pybullet_data

import pybullet as p

p.connect(p.DIRECT)
p.setAdditionalSearchPath(pybullet_data.getDataPath())
p.setGravity(0, 0, -10)
p.loadURDF("plane.urdf")
robot = p.loadURDF("r2d2.urdf", [0, 0, 1], p.getQuaternionFromEuler([0, 0, 0]))
for _ in range(1200):
    p.stepSimulation()
print(p.getBasePositionAndOrientation(robot))
p.disconnect()
