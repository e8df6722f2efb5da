"""Two hundred dominoes stand in a row, the first is tipped over, 320 steps."""

import pybullet_data

import pybullet as p

p.connect(p.DIRECT)
p.setAdditionalSearchPath(pybullet_data.getDataPath())
p.setGravity(0, 0, -9.81)
p.loadURDF("plane.urdf")
stone = p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.01, 0.03, 0.06])
look = p.createVisualShape(p.GEOM_BOX, halfExtents=[0.01, 0.03, 0.06], rgbaColor=[1, 0, 0, 1])
row = [p.createMultiBody(0.05, stone, look, [0.06 * k, 0, 0.06]) for k in range(200)]
for _ in range(20):
    p.stepSimulation()
p.resetBaseVelocity(row[0], angularVelocity=[0, 3, 0])
for _ in range(300):
    p.stepSimulation()
print(sum(p.getBasePositionAndOrientation(body)[0][2] < 0.05 for body in row))
