"""A tree of 800 postures of an arm is grown among twelve obstacles, each checked with getClosestPoints."""

import random

import numpy as np
import pybullet_data

import pybullet as p

p.connect(p.DIRECT)
p.setAdditionalSearchPath(pybullet_data.getDataPath())
random.seed(1)
drawn = np.random.default_rng(1)
p.loadURDF("plane.urdf", [0, 0, -0.1])
arm = p.loadURDF("kuka_iiwa/model.urdf", useFixedBase=True)
obstacles = []
for _ in range(12):
    place = [random.uniform(0.3, 0.7), random.uniform(-0.5, 0.5), random.uniform(0.2, 0.8)]
    obstacles.append(p.loadURDF("cube_small.urdf", place, useFixedBase=True, globalScaling=3))


def collides(posture: np.ndarray) -> bool:
    for joint in range(7):
        p.resetJointState(arm, joint, posture[joint])
    return any(p.getClosestPoints(arm, obstacle, 0.0) for obstacle in obstacles)


tree = [np.zeros(7)]
for _ in range(800):
    goal = drawn.uniform(-2, 2, 7)
    nearest = min(tree, key=lambda posture: np.sum((posture - goal) ** 2))
    step = nearest + 0.2 * (goal - nearest) / np.linalg.norm(goal - nearest)
    if not collides(step):
        tree.append(step)
print(len(tree))
