"""A hundred and twenty boxes are placed at random; one that getClosestPoints finds too near is removed."""

import random

import pybullet_data

import pybullet as p

p.connect(p.DIRECT)
p.setAdditionalSearchPath(pybullet_data.getDataPath())
p.loadURDF("plane.urdf")
random.seed(1)
placed = []
for _ in range(120):
    shape = p.createCollisionShape(p.GEOM_BOX, halfExtents=[random.uniform(0.02, 0.06) for _ in range(3)])
    made = p.createMultiBody(0.2, shape, -1, [random.uniform(-0.5, 0.5), random.uniform(-0.5, 0.5), 0.1])
    if any(p.getClosestPoints(made, other, 0.0) for other in placed):
        p.removeBody(made)
    else:
        placed.append(made)
print(len(placed))
