"""A cart with a pole is controlled by the best of 20 random sequences of forces, restored before each."""

import numpy as np
import pybullet_data

import pybullet as p

p.connect(p.DIRECT)
p.setAdditionalSearchPath(pybullet_data.getDataPath())
p.setGravity(0, 0, -9.81)
drawn = np.random.default_rng(1)
p.loadURDF("plane.urdf")
cart = p.loadURDF("cartpole.urdf")
for joint in (0, 1):
    p.setJointMotorControl2(cart, joint, p.VELOCITY_CONTROL, force=0)
p.resetJointState(cart, 1, 0.2)
for _ in range(20):
    state, best = p.saveState(), (float("inf"), 0.0)
    for _try in range(20):
        p.restoreState(state)
        forces, cost = drawn.uniform(-20, 20, 20), 0.0
        for force in forces:
            p.setJointMotorControl2(cart, 0, p.TORQUE_CONTROL, force=float(force))
            p.stepSimulation()
            cost += p.getJointState(cart, 1)[0] ** 2
        best = min(best, (cost, float(forces[0])))
    p.restoreState(state)
    p.removeState(state)
    p.setJointMotorControl2(cart, 0, p.TORQUE_CONTROL, force=best[1])
    p.stepSimulation()
print(p.getJointState(cart, 1)[:2])
