"""Memory over an hour of simulated driving, and over many clients.

    python benchmarks/leaks.py [--steps 864000] [--cycles 200]

R2D2 drives through `roboyard.pybullet`, with motor commands and state reads now and then; after that clients
connect, load, step and disconnect, and one resets its simulation, with and without changes that end reuse.
Prints the growth of resident memory from when all is warm to the end.
"""

from __future__ import annotations

import argparse
import gc
import os
from pathlib import Path
from time import perf_counter

import roboyard.pybullet as p
import roboyard.pybullet_data as data

WARM_UP = 0.02
"""Share of a run after which memory counts."""


def resident_mb() -> float:
    """Resident memory of this process in MB (Linux)."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 1e6


def driving(steps: int) -> float:
    """MB that resident memory grows by while R2D2 drives."""
    client = p.connect(p.DIRECT)
    p.setAdditionalSearchPath(data.getDataPath())
    p.setGravity(0, 0, -9.8)
    p.loadURDF("plane.urdf")
    robot = p.loadURDF("r2d2.urdf", [0, 0, 0.5])
    wheels = [j for j in range(p.getNumJoints(robot)) if b"wheel" in p.getJointInfo(robot, j)[1]]
    start = 0.0
    for step in range(steps):
        if step == int(steps * WARM_UP):
            gc.collect()
            start = resident_mb()
        if step % 24 == 0:
            speed = 5.0 if step // 2400 % 2 else -5.0
            p.setJointMotorControlArray(
                robot,
                wheels,
                p.VELOCITY_CONTROL,
                targetVelocities=[speed] * len(wheels),
                forces=[10] * len(wheels),
            )
            p.getLinkState(robot, wheels[0])
            p.getContactPoints(robot)
            p.getJointStates(robot, wheels)
        p.stepSimulation()
    gc.collect()
    grown = resident_mb() - start
    p.disconnect(client)
    return grown


def connecting(cycles: int) -> float:
    """MB that resident memory grows by while clients come and go."""
    start = 0.0
    warm = max(3, int(cycles * 0.1))
    for cycle in range(cycles + warm):
        if cycle == warm:
            gc.collect()
            start = resident_mb()
        client = p.connect(p.DIRECT)
        p.setAdditionalSearchPath(data.getDataPath())
        p.loadURDF("plane.urdf")
        p.loadURDF("r2d2.urdf", [0, 0, 0.5])
        p.loadURDF("husky/husky.urdf", [2, 0, 0.5])
        for _ in range(10):
            p.stepSimulation()
        p.getCameraImage(64, 48)
        p.disconnect(client)
    gc.collect()
    return resident_mb() - start


def resetting(cycles: int) -> float:
    """MB that resident memory grows by while a client resets its simulation and builds it again."""
    client, start = p.connect(p.DIRECT), 0.0
    p.setAdditionalSearchPath(data.getDataPath())
    warm = max(12, int(cycles * 0.2))
    for cycle in range(cycles + warm):
        if cycle == warm:
            gc.collect()
            start = resident_mb()
        p.resetSimulation()
        p.loadURDF("plane.urdf")
        robot = p.loadURDF("r2d2.urdf", [0, 0, 0.5 + 0.001 * cycle])
        box = p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.1, 0.1, 0.1])
        if cycle % 4 == 0:  # another world, which is compiled
            p.createMultiBody(0.1, box, basePosition=[2, 0, 1])
        if cycle % 5 == 0:
            p.changeDynamics(robot, 1, mass=0.5)
        p.stepSimulation()
    gc.collect()
    grown = resident_mb() - start
    p.disconnect(client)
    return grown


def main() -> None:
    """Run all and print the figures."""
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--steps", type=int, default=864_000)
    options.add_argument("--cycles", type=int, default=200)
    given = options.parse_args()
    begin = perf_counter()
    print(f"connect/load/disconnect, {given.cycles} cycles: {connecting(given.cycles):+.1f} MB "
          f"in {perf_counter() - begin:.0f} s", flush=True)  # fmt: skip
    begin = perf_counter()
    print(f"reset/load/step, {5 * given.cycles} cycles: {resetting(5 * given.cycles):+.1f} MB "
          f"in {perf_counter() - begin:.0f} s", flush=True)  # fmt: skip
    begin = perf_counter()
    print(f"driving, {given.steps} steps: {driving(given.steps):+.1f} MB "
          f"in {perf_counter() - begin:.0f} s", flush=True)  # fmt: skip


if __name__ == "__main__":
    main()
