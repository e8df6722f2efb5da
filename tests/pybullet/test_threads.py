"""Threads that share a client take turns, as with PyBullet, whose functions keep the interpreter's lock."""

from __future__ import annotations

import os
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
for k in range(CALLS):
    p.getJointState(arm, 0)
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


def run(program: str) -> str:
    """Return the last line that a program printed, which may print no errors."""
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=False, timeout=120
    )
    assert done.stderr == ""
    assert done.returncode == 0
    return done.stdout.splitlines()[-1]


@pytest.mark.parametrize("calls", [0, 0, 300])  # before and after machine code calls commands
def test_a_thread_steps_while_another_loads_and_reads(calls: int) -> None:
    assert run(f"CALLS = {calls}\n{PROGRAM}") == "[] True 0.3 16"


PAUSED = """
import contextlib, io, threading, time
import roboyard.pybullet as p
from roboyard.pybullet.connections import CLIENTS

with contextlib.redirect_stderr(io.StringIO()):  # it says where the page is
    p.connect(p.GUI, options="--port=0")
window = CLIENTS[0].window
window.gate._is_watched = lambda: True
ball = p.createMultiBody(1, p.createCollisionShape(p.GEOM_SPHERE, radius=0.1), basePosition=[0, 0, 10])
for k in range(CALLS):
    p.getNumBodies()
ends, steps = [], []


def run():
    while not ends:
        p.stepSimulation()
        steps.append(1)


def wait(so):
    end = time.monotonic() + 60
    while not so():
        assert time.monotonic() < end
        time.sleep(0.01)


threading.Thread(target=run, daemon=True).start()
wait(lambda: len(steps) > 300)
window.gate.play(False)
held = -1
while held != len(steps):
    held = len(steps)
    time.sleep(0.2)
p.resetBasePositionAndOrientation(ball, [0, 0, 20], [0, 0, 0, 1])
print(p.getBasePositionAndOrientation(ball)[0][2], len(steps) == held)
window.gate.play(True)
wait(lambda: len(steps) > held + 300)
ends.append(True)
p.disconnect()
"""


@pytest.mark.parametrize("calls", [0, 300])
def test_a_thread_that_a_page_pauses_lets_others_call(calls: int) -> None:
    pytest.importorskip("viser")
    assert run(f"CALLS = {calls}\n{PAUSED}") == "20.0 True"


FORKED = """
import os, threading, time
import roboyard.pybullet as p

p.connect(p.DIRECT)
ball = p.createMultiBody(1, p.createCollisionShape(p.GEOM_SPHERE, radius=0.1), basePosition=[0, 0, 10])
for k in range(CALLS):
    p.getNumBodies()
ends = []


def run():
    while not ends:
        p.stepSimulation()
        p.getClosestPoints(ball, ball, 1)


thread = threading.Thread(target=run)
thread.start()
codes = []
for _ in range(20):
    child = os.fork()
    if not child:
        p.stepSimulation()
        os._exit(p.getNumBodies())
    codes.append(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]))
ends.append(True)
thread.join()
print(set(codes))
"""


@pytest.mark.skipif(not hasattr(os, "fork"), reason="needs os.fork")
@pytest.mark.filterwarnings("ignore::DeprecationWarning")
@pytest.mark.parametrize("calls", [0, 300])
def test_a_child_of_a_process_with_threads_calls_commands(calls: int) -> None:
    assert run(f"import warnings\nwarnings.simplefilter('ignore')\nCALLS = {calls}\n{FORKED}") == "{1}"


FOLLOWING = """
import threading
import roboyard.pybullet as p
from roboyard.pybullet.face import direct_calls

p.connect(p.DIRECT)


def run():
    for _ in range(400):
        p.getNumBodies()


for _ in range(2):
    thread = threading.Thread(target=run)
    thread.start()
    thread.join()
run()
is_machine = direct_calls.START._address != 0
thread = threading.Thread(target=run)
thread.start()
thread.join()
print(is_machine or not direct_calls.CAN_START, direct_calls.START._address)
"""


def test_machine_code_goes_from_a_thread_that_ended_to_the_next_one() -> None:
    assert run(FOLLOWING) == "True 0"
