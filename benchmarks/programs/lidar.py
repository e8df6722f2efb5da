"""Sixty-four rays look around in 1,000 steps, among 30 boxes."""

import math

import pybullet_data

import pybullet as p

p.connect(p.DIRECT)
p.setAdditionalSearchPath(pybullet_data.getDataPath())
p.setGravity(0, 0, -9.81)
p.loadURDF("plane.urdf")
box = p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.3, 0.3, 0.5])
for i in range(30):
    p.createMultiBody(0, box, basePosition=[5 * math.cos(i / 4.8), (3 + i % 4) * math.sin(i / 4.8), 0.5])
robot = p.loadURDF("r2d2.urdf", [0, 0, 0.5])
angles = [2 * math.pi * i / 64 for i in range(64)]
for _ in range(1000):
    (x, y, _), _ = p.getBasePositionAndOrientation(robot)
    starts = [[x + 0.6 * math.cos(a), y + 0.6 * math.sin(a), 0.5] for a in angles]
    ends = [[x + 10 * math.cos(a), y + 10 * math.sin(a), 0.5] for a in angles]
    hits = p.rayTestBatch(starts, ends)
    p.stepSimulation()
print(sum(hit[0] >= 0 for hit in hits))
