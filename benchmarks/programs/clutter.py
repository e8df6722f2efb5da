"""Twenty episodes from resetSimulation on, each with a tray and three objects that were not loaded before."""

import pybullet_data

import pybullet as p

p.connect(p.DIRECT)
p.setAdditionalSearchPath(pybullet_data.getDataPath())
total = 0.0
for episode in range(20):
    p.resetSimulation()
    p.setGravity(0, 0, -9.81)
    p.loadURDF("plane.urdf")
    p.loadURDF("tray/traybox.urdf", [0, 0, 0])
    numbers = [3 * episode + k for k in range(3)]
    objects = [
        p.loadURDF(f"random_urdfs/{n:03}/{n:03}.urdf", [0, 0, 0.2 + 0.2 * k]) for k, n in enumerate(numbers)
    ]
    for _ in range(240):
        p.stepSimulation()
    total += sum(p.getBasePositionAndOrientation(body)[0][2] for body in objects)
print(round(total, 1))
