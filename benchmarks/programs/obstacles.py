"""Sixty episodes from resetSimulation on: twelve boxes of random sizes and masses fall for 40 steps."""

import random

import pybullet_data

import pybullet as p

p.connect(p.DIRECT)
p.setAdditionalSearchPath(pybullet_data.getDataPath())
random.seed(1)
total = 0.0
for _ in range(60):
    p.resetSimulation()
    p.setGravity(0, 0, -9.81)
    p.loadURDF("plane.urdf")
    boxes = []
    for k in range(12):
        half = [random.uniform(0.02, 0.06) for _ in range(3)]
        shape = p.createCollisionShape(p.GEOM_BOX, halfExtents=half)
        look = p.createVisualShape(p.GEOM_BOX, halfExtents=half)
        place = [random.uniform(-0.2, 0.2), random.uniform(-0.2, 0.2), 0.1 + 0.1 * k]
        boxes.append(p.createMultiBody(random.uniform(0.1, 1), shape, look, place))
    for _step in range(40):
        p.stepSimulation()
    total += sum(p.getBasePositionAndOrientation(box)[0][2] for box in boxes)
print(total)
