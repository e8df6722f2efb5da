"""Fifty cubes lie on a plane; a box is created, falls for a step and is removed, 400 times."""

import pybullet_data

import pybullet as p

p.connect(p.DIRECT)
p.setAdditionalSearchPath(pybullet_data.getDataPath())
p.setGravity(0, 0, -9.81)
p.loadURDF("plane.urdf")
for k in range(50):
    p.loadURDF("cube_small.urdf", [0.1 * (k % 7), 0.1 * (k // 7), 0.03])
box = p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.03, 0.03, 0.03])
for _ in range(100):
    p.stepSimulation()
for _ in range(400):
    made = p.createMultiBody(0.1, box, -1, [0.3, 0.3, 0.5])
    p.stepSimulation()
    p.removeBody(made)
print(p.getNumBodies(), p.getBasePositionAndOrientation(1)[0])
