"""A body hovers by four forces of a feedback law, ten simulated seconds."""

import pybullet_data

import pybullet as p

p.connect(p.DIRECT)
p.setAdditionalSearchPath(pybullet_data.getDataPath())
p.setGravity(0, 0, -9.81)
p.loadURDF("plane.urdf")
shape = p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.1, 0.1, 0.03])
drone = p.createMultiBody(0.5, shape, basePosition=[0, 0, 0.5])
arms = [[0.1, 0.1, 0], [-0.1, 0.1, 0], [-0.1, -0.1, 0], [0.1, -0.1, 0]]
for _ in range(2400):
    position, orientation = p.getBasePositionAndOrientation(drone)
    velocity, turning = p.getBaseVelocity(drone)
    roll, pitch, _ = p.getEulerFromQuaternion(orientation)
    lift = 0.5 * 9.81 + 4 * (1 - position[2]) - 2 * velocity[2]
    for x, y, _ in arms:
        push = lift / 4 - y * (roll + 0.2 * turning[0]) + x * (pitch + 0.2 * turning[1])
        p.applyExternalForce(drone, -1, [0, 0, push], [x, y, 0], p.LINK_FRAME)
    p.stepSimulation()
print(position)
