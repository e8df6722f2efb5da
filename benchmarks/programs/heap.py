"""A heap of boxes grows by one every ten steps, up to 150."""

import pybullet as p

p.connect(p.DIRECT)
p.setGravity(0, 0, -9.81)
p.createMultiBody(0, p.createCollisionShape(p.GEOM_PLANE))
box = p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.05, 0.05, 0.05])
bodies = []
for k in range(150):
    bodies.append(p.createMultiBody(0.1, box, -1, [0.03 * (k % 5), 0.03 * (k // 5 % 5), 0.6]))
    for _ in range(10):
        p.stepSimulation()
print(max(p.getBasePositionAndOrientation(body)[0][2] for body in bodies))
