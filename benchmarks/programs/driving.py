"""A Husky drives a slalom by wheel speeds and looks at its pose in each step, 20 simulated seconds."""

import math

import pybullet_data

import pybullet as p

p.connect(p.DIRECT)
p.setAdditionalSearchPath(pybullet_data.getDataPath())
p.setGravity(0, 0, -9.81)
p.loadURDF("plane.urdf")
car = p.loadURDF("husky/husky.urdf", [0, 0, 0.2])
joints = [p.getJointInfo(car, j) for j in range(p.getNumJoints(car))]
left = [info[0] for info in joints if info[2] == p.JOINT_REVOLUTE and b"left" in info[1]]
right = [info[0] for info in joints if info[2] == p.JOINT_REVOLUTE and b"right" in info[1]]
for step in range(4800):
    turn = 2 * math.sin(step / 240)
    for j in left:
        p.setJointMotorControl2(car, j, p.VELOCITY_CONTROL, targetVelocity=4 - turn, force=50)
    for j in right:
        p.setJointMotorControl2(car, j, p.VELOCITY_CONTROL, targetVelocity=4 + turn, force=50)
    p.stepSimulation()
    position, orientation = p.getBasePositionAndOrientation(car)
    yaw = p.getEulerFromQuaternion(orientation)[2]
print(position, yaw)
