"""Random actions on a cart with a pole in 300 short episodes: what a class of an environment does."""

import random

import pybullet_data

import pybullet as p

p.connect(p.DIRECT)
p.setAdditionalSearchPath(pybullet_data.getDataPath())
p.setGravity(0, 0, -9.8)
p.setTimeStep(0.02)
cart = p.loadURDF("cartpole.urdf", [0, 0, 0])
p.changeDynamics(cart, -1, linearDamping=0, angularDamping=0)
p.setJointMotorControl2(cart, 1, p.VELOCITY_CONTROL, force=0)
random.seed(0)
total = 0
for _ in range(300):
    for j in (0, 1):
        p.resetJointState(cart, j, random.uniform(-0.05, 0.05), random.uniform(-0.05, 0.05))
    for _ in range(100):
        p.setJointMotorControl2(cart, 0, p.TORQUE_CONTROL, force=random.choice((-10, 10)))
        p.stepSimulation()
        place, angle = p.getJointState(cart, 0)[0], p.getJointState(cart, 1)[0]
        total += 1
        if abs(place) > 0.5 or abs(angle) > 0.2:
            break
print(total)
