"""Threads that share a client take turns, as with PyBullet, whose functions keep the interpreter's lock."""

from __future__ import annotations

import subprocess
import sys

import pytest

PROGRAM = """
import threading, time
import roboyard.pybullet as p
from roboyard.pybullet_data import getDataPath

p.connect(p.DIRECT)
p.setAdditionalSearchPath(getDataPath())
p.setGravity(0, 0, -9.8)
arm = p.loadURDF("kuka_iiwa/model.urdf", useFixedBase=True)
steps, problems, ends = [0], [], []


def run():
    try:
        while not ends:
            p.stepSimulation()
            steps[0] += 1
            time.sleep(0.0005)
    except BaseException as problem:
        problems.append(repr(problem))


thread = threading.Thread(target=run)
thread.start()
for joint in range(7):
    p.setJointMotorControl2(arm, joint, p.POSITION_CONTROL, targetPosition=0.3)
for k in range(10):
    p.loadURDF("duck_vhacd.urdf", [k, 1, 1])
    body = p.loadURDF("r2d2.urdf", [k, 3, 0.5], flags=p.URDF_USE_SELF_COLLISION)
    held = p.createConstraint(body, -1, -1, -1, p.JOINT_FIXED, [0, 0, 0], [0, 0, 0], [k, 3, 0.5])
    for joint in range(p.getNumJoints(body)):
        p.setCollisionFilterPair(body, body, 0, joint, 0)
    p.getJointStates(body, range(p.getNumJoints(body)))
    if k % 2:
        p.removeConstraint(held)
        p.removeBody(body)
end = time.monotonic() + 20
while abs(p.getJointState(arm, 0)[0] - 0.3) > 0.01 and time.monotonic() < end and not problems:
    p.getLinkState(arm, 6, computeForwardKinematics=1)
    p.getContactPoints()
    time.sleep(0.001)
ends.append(True)
thread.join()
print(problems, steps[0] > 20, round(p.getJointState(arm, 0)[0], 1), p.getNumBodies())
"""


@pytest.mark.parametrize("run", range(2))
def test_a_thread_steps_while_another_loads_and_reads(run: int) -> None:
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM], capture_output=True, text=True, check=False, timeout=120
    )
    assert done.stderr == ""
    assert done.stdout.splitlines()[-1] == "[] True 0.3 16"
    assert done.returncode == 0
