"""A Kuka arm draws a circle by inverse kinematics and position control, ten simulated seconds."""

import math

import pybullet_data

import pybullet as p

p.connect(p.DIRECT)
p.setAdditionalSearchPath(pybullet_data.getDataPath())
p.setGravity(0, 0, -9.81)
p.loadURDF("plane.urdf")
arm = p.loadURDF("kuka_iiwa/model.urdf", useFixedBase=True)
joints = [j for j in range(p.getNumJoints(arm)) if p.getJointInfo(arm, j)[2] == p.JOINT_REVOLUTE]
down = p.getQuaternionFromEuler([0, -math.pi, 0])
for step in range(2400):
    angle = step / 240
    goal = [0.5, 0.2 * math.cos(angle), 0.5 + 0.2 * math.sin(angle)]
    targets = p.calculateInverseKinematics(arm, 6, goal, down)
    for j, target in zip(joints, targets, strict=False):
        p.setJointMotorControl2(
            arm, j, p.POSITION_CONTROL, target, force=500, positionGain=0.03, velocityGain=1
        )
    p.stepSimulation()
print(p.getLinkState(arm, 6)[4])
