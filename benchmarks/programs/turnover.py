"""Three hundred small objects of three files are dropped one by one; random ones are removed."""

import random

import pybullet_data

import pybullet as p

FILES = ("cube_small.urdf", "sphere_small.urdf", "duck_vhacd.urdf")

p.connect(p.DIRECT)
p.setAdditionalSearchPath(pybullet_data.getDataPath())
p.setGravity(0, 0, -9.81)
random.seed(1)
p.loadURDF("plane.urdf")
there = []
for _ in range(300):
    if len(there) > 15:
        p.removeBody(there.pop(random.randrange(len(there))))
    place = [random.uniform(-0.2, 0.2), random.uniform(-0.2, 0.2), 0.4]
    there.append(p.loadURDF(random.choice(FILES), place))
    for _step in range(4):
        p.stepSimulation()
print(p.getNumBodies())
