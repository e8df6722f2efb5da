"""Cost of single calls of PyBullet's API, on Roboyard and on an installed pybullet, in alternating processes.

    python benchmarks/calls.py [--rounds 3] [--only REGEX]

Each row is the median over the rounds of the best of three loops, in microseconds of CPU time, and the ratio
of Roboyard's to PyBullet's. The scene is a plane, an R2D2 and a Kuka arm; without pybullet only Roboyard's
column is printed. The rows "start" are seconds of a whole process: import, connect, two bodies, one step.
"""

from __future__ import annotations

import argparse
import importlib
import importlib.util
import json
import re
import resource
import statistics
import subprocess
import sys
import time
from collections.abc import Callable
from typing import Any

LOOPS = 3
SECONDS = 0.05
"""Duration of one loop (s)."""


def main() -> None:
    """Run all calls on both and print the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--only", default="", help="regular expression that a call's name must match")
    parser.add_argument("--one", help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.one:
        print(json.dumps(measure(arguments.one, arguments.only)))
        return
    sides = ["roboyard.pybullet"]
    if importlib.util.find_spec("pybullet") is not None:
        sides.append("pybullet")
    rows: dict[str, dict[str, list[float]]] = {}
    for _ in range(arguments.rounds):
        for side in sides:
            command = [sys.executable, __file__, "--one", side, "--only", arguments.only]
            done = subprocess.run(command, capture_output=True, text=True, check=True)
            for name, figure in json.loads(done.stdout.splitlines()[-1]).items():
                rows.setdefault(name, {}).setdefault(side, []).append(figure)
    print(f"{'call':<36}{'Roboyard':>10}{'PyBullet':>10}{'ratio':>8}")
    for name, figures in rows.items():
        ours = statistics.median(figures["roboyard.pybullet"])
        theirs = statistics.median(figures["pybullet"]) if "pybullet" in figures else float("nan")
        print(f"{name:<36}{ours:>10.3f}{theirs:>10.3f}{ours / theirs:>8.2f}")


def measure(side: str, only: str) -> dict[str, float]:
    """Return the figure of each call on one side."""
    p = importlib.import_module(side)
    data = importlib.import_module("pybullet_data" if side == "pybullet" else "roboyard.pybullet_data")
    p.connect(p.DIRECT)
    p.setAdditionalSearchPath(data.getDataPath())
    p.setGravity(0, 0, -9.8)
    p.loadURDF("plane.urdf")
    robot = p.loadURDF("r2d2.urdf", [0, 0, 1])
    p.stepSimulation()
    usage = resource.getrusage(resource.RUSAGE_SELF)
    found = {"start (s)": usage.ru_utime + usage.ru_stime}
    arm = p.loadURDF("kuka_iiwa/model.urdf", [2, 0, 0], useFixedBase=True)
    p.stepSimulation()
    for name, call in calls(p, robot, arm).items():
        if re.search(only, name):
            found[name] = cost(call)
    return found


def calls(p: Any, robot: int, arm: int) -> dict[str, Callable[[], Any]]:
    """Return name to call."""
    q, v, seven = [0, 0, 0, 1], [0.1, 0.2, 0.3], [0.0] * 7
    return {
        "applyExternalForce": lambda: p.applyExternalForce(robot, -1, [1, 0, 0], [0, 0, 0], p.LINK_FRAME),
        "applyExternalTorque": lambda: p.applyExternalTorque(robot, -1, [1, 0, 0], p.LINK_FRAME),
        "resetBasePositionAndOrientation": lambda: p.resetBasePositionAndOrientation(robot, [0, 0, 1], q),
        "resetBaseVelocity": lambda: p.resetBaseVelocity(robot, [0, 0, 0], [0, 0, 0]),
        "resetJointState": lambda: p.resetJointState(arm, 2, 0.1),
        "getBasePositionAndOrientation": lambda: p.getBasePositionAndOrientation(robot),
        "getBaseVelocity": lambda: p.getBaseVelocity(robot),
        "getJointState": lambda: p.getJointState(arm, 2),
        "getJointStates": lambda: p.getJointStates(arm, range(7)),
        "getJointInfo": lambda: p.getJointInfo(arm, 2),
        "getNumJoints": lambda: p.getNumJoints(arm),
        "getLinkState": lambda: p.getLinkState(arm, 6),
        "getLinkState, forward kinematics": lambda: p.getLinkState(arm, 6, computeForwardKinematics=1),
        "getLinkStates": lambda: p.getLinkStates(arm, range(7)),
        "getContactPoints": lambda: p.getContactPoints(robot),
        "rayTest": lambda: p.rayTest([0, 0, 5], [0, 0, -5]),
        "setJointMotorControl2": lambda: p.setJointMotorControl2(arm, 2, p.POSITION_CONTROL, 0.1, force=100),
        "setJointMotorControlArray": lambda: p.setJointMotorControlArray(
            arm, range(7), p.POSITION_CONTROL, [0] * 7
        ),
        "calculateInverseKinematics": lambda: p.calculateInverseKinematics(arm, 6, [1.6, 0.2, 0.6]),
        "calculateInverseDynamics": lambda: p.calculateInverseDynamics(arm, seven, seven, seven),
        "calculateJacobian": lambda: p.calculateJacobian(arm, 6, [0, 0, 0], seven, seven, seven),
        "getQuaternionFromEuler": lambda: p.getQuaternionFromEuler(v),
        "getEulerFromQuaternion": lambda: p.getEulerFromQuaternion(q),
        "getMatrixFromQuaternion": lambda: p.getMatrixFromQuaternion(q),
        "multiplyTransforms": lambda: p.multiplyTransforms(v, q, v, q),
        "invertTransform": lambda: p.invertTransform(v, q),
        "stepSimulation": p.stepSimulation,
    }


def cost(call: Callable[[], Any]) -> float:
    """Return the CPU time of a call (µs): the best of a few loops."""
    call()
    count, start = 0, time.process_time()
    while time.process_time() - start < SECONDS / 5:
        call()
        count += 1
    count = max(10, count * 5)
    best = float("inf")
    for _ in range(LOOPS):
        start = time.process_time()
        for _ in range(count):
            call()
        best = min(best, time.process_time() - start)
    return best / count * 1e6


if __name__ == "__main__":
    main()
