"""A hundred cubes fall into a pile, four simulated seconds; all poses are read at the end."""

import pybullet_data

import pybullet as p

p.connect(p.DIRECT)
p.setAdditionalSearchPath(pybullet_data.getDataPath())
p.setGravity(0, 0, -9.81)
p.loadURDF("plane.urdf")
box = p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.05, 0.05, 0.05])
cubes = [
    p.createMultiBody(0.2, box, basePosition=[0.12 * (i % 5), 0.12 * (i // 5 % 5), 0.2 + 0.15 * (i // 25)])
    for i in range(100)
]
for _ in range(960):
    p.stepSimulation()
print(max(p.getBasePositionAndOrientation(cube)[0][2] for cube in cubes))
