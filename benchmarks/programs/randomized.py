"""Forty episodes from resetSimulation on, each with other masses and friction of a quadruped."""

import random

import pybullet_data

import pybullet as p

p.connect(p.DIRECT)
p.setAdditionalSearchPath(pybullet_data.getDataPath())
random.seed(1)
total = 0.0
for _ in range(40):
    p.resetSimulation()
    p.setGravity(0, 0, -9.81)
    plane = p.loadURDF("plane.urdf")
    p.changeDynamics(plane, -1, lateralFriction=random.uniform(0.4, 1))
    robot = p.loadURDF("a1/a1.urdf", [0, 0, 0.4])
    joints = range(p.getNumJoints(robot))
    for link in (-1, *joints):
        mass = p.getDynamicsInfo(robot, link)[0] * random.uniform(0.8, 1.2)
        p.changeDynamics(robot, link, mass=mass, lateralFriction=random.uniform(0.4, 1.2), linearDamping=0)
    hinges = [joint for joint in joints if p.getJointInfo(robot, joint)[2] == p.JOINT_REVOLUTE]
    for _step in range(60):
        for joint in hinges:
            p.setJointMotorControl2(robot, joint, p.POSITION_CONTROL, 0.1, force=20)
        p.stepSimulation()
    total += p.getBasePositionAndOrientation(robot)[0][2]
print(total)
