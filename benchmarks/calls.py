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
import itertools
import json
import re
import resource
import statistics
import subprocess
import sys
import time
from collections.abc import Callable, Iterable
from typing import Any

import call_forms
import other_calls

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
        figures = measure(arguments.one, arguments.only)
        print("\n" + json.dumps(figures))
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
    print(f"{'call':<58}{'Roboyard':>10}{'PyBullet':>10}{'ratio':>8}")
    for name, figures in rows.items():
        ours = statistics.median(figures["roboyard.pybullet"])
        theirs = statistics.median(figures["pybullet"]) if "pybullet" in figures else float("nan")
        print(f"{name:<58}{ours:>10.3f}{theirs:>10.3f}{ours / theirs:>8.2f}")


def measure(side: str, only: str) -> dict[str, float]:
    """Return the figure of each call on one side."""
    p = importlib.import_module(side)
    p.connect(p.DIRECT)
    p.setAdditionalSearchPath(data_folder())
    p.setGravity(0, 0, -9.8)
    p.loadURDF("plane.urdf")
    robot = p.loadURDF("r2d2.urdf", [0, 0, 1])
    p.stepSimulation()
    usage = resource.getrusage(resource.RUSAGE_SELF)
    found = {"start (s)": usage.ru_utime + usage.ru_stime}
    arm = p.loadURDF("kuka_iiwa/model.urdf", [2, 0, 0], useFixedBase=True)
    cube = p.loadURDF("cube_small.urdf", [1, 0, 1])
    p.stepSimulation()
    tables = (transforms, getters, queries, commands, alternated, pairs, *other_calls.TABLES, loops, planning)
    found |= figures_of(p, tables, (robot, arm, cube), only)
    p.resetSimulation()
    p.setGravity(0, 0, -9.8)
    p.loadURDF("plane.urdf")
    robot = p.loadURDF("r2d2.urdf", [0, 0, 1])
    arm = p.loadURDF("kuka_iiwa/model.urdf", [2, 0, 0], useFixedBase=True)
    cube = p.loadURDF("cube_small.urdf", [1, 0, 1])
    return found | figures_of(p, call_forms.TABLES, (robot, arm, cube), only)


def figures_of(p: Any, tables: Iterable[Any], bodies: tuple[int, int, int], only: str) -> dict[str, float]:
    """Return the figures of calls whose names match a regular expression."""
    found: dict[str, float] = {}
    for table in tables:
        for name, call in table(p, *bodies).items():
            if re.search(only, name):
                found[name] = cost(call)
    return found


def data_folder() -> str:
    """Return the folder of PyBullet's robots, or of Roboyard's own."""
    has_data = importlib.util.find_spec("pybullet_data") is not None
    return importlib.import_module("pybullet_data" if has_data else "roboyard.pybullet_data").getDataPath()


Calls = dict[str, Callable[[], Any]]


def transforms(p: Any, *bodies: int) -> Calls:
    """Return name to call of the mathematics."""
    q, r, v = [0.1, 0.2, 0.3, 0.927], [0.0, 0.6, 0.0, 0.8], [0.1, 0.2, 0.3]
    return {
        "getQuaternionFromEuler": lambda: p.getQuaternionFromEuler(v),
        "getEulerFromQuaternion": lambda: p.getEulerFromQuaternion(q),
        "getMatrixFromQuaternion": lambda: p.getMatrixFromQuaternion(q),
        "multiplyTransforms": lambda: p.multiplyTransforms(v, q, v, q),
        "invertTransform": lambda: p.invertTransform(v, q),
        "rotateVector": lambda: p.rotateVector(q, v),
        "getQuaternionSlerp": lambda: p.getQuaternionSlerp(q, r, 0.3),
        "getQuaternionFromAxisAngle": lambda: p.getQuaternionFromAxisAngle(v, 0.3),
        "getAxisAngleFromQuaternion": lambda: p.getAxisAngleFromQuaternion(q),
        "getDifferenceQuaternion": lambda: p.getDifferenceQuaternion(q, r),
        "getAxisDifferenceQuaternion": lambda: p.getAxisDifferenceQuaternion(q, r),
        "calculateVelocityQuaternion": lambda: p.calculateVelocityQuaternion(q, r, 0.1),
        "computeViewMatrix": lambda: p.computeViewMatrix([1, 1, 1], [0, 0, 0], [0, 0, 1]),
        "computeViewMatrixFromYawPitchRoll": lambda: p.computeViewMatrixFromYawPitchRoll(v, 1, 30, -20, 0, 2),
        "computeViewMatrix, keywords": lambda: p.computeViewMatrix(
            cameraEyePosition=[1, 1, 1], cameraTargetPosition=[0, 0, 0], cameraUpVector=[0, 0, 1]
        ),
        "computeProjectionMatrix": lambda: p.computeProjectionMatrix(-1, 1, -1, 1, 0.1, 10),
        "computeProjectionMatrixFOV": lambda: p.computeProjectionMatrixFOV(60, 1, 0.1, 10),
    }


def getters(p: Any, robot: int, arm: int, cube: int) -> Calls:
    """Return name to call of what reads the state."""
    fixed = p.createConstraint(cube, -1, -1, -1, p.JOINT_FIXED, [0, 0, 0], [0, 0, 0], [1, 0, 1])
    data = p.addUserData(cube, "key", "value")
    p.stepSimulation()
    return {
        "isConnected": p.isConnected,
        "getConnectionInfo": p.getConnectionInfo,
        "getAPIVersion": p.getAPIVersion,
        "getNumBodies": p.getNumBodies,
        "getBodyUniqueId": lambda: p.getBodyUniqueId(1),
        "getBodyInfo": lambda: p.getBodyInfo(arm),
        "getBasePositionAndOrientation": lambda: p.getBasePositionAndOrientation(robot),
        "getBaseVelocity": lambda: p.getBaseVelocity(robot),
        "getJointState": lambda: p.getJointState(arm, 2),
        "getJointStates": lambda: p.getJointStates(arm, range(7)),
        "getJointStateMultiDof": lambda: p.getJointStateMultiDof(arm, 2),
        "getJointStatesMultiDof": lambda: p.getJointStatesMultiDof(arm, range(7)),
        "getJointInfo": lambda: p.getJointInfo(arm, 2),
        "getNumJoints": lambda: p.getNumJoints(arm),
        "computeDofCount": lambda: p.computeDofCount(arm),
        "getLinkState": lambda: p.getLinkState(arm, 6),
        "getLinkState, velocity": lambda: p.getLinkState(arm, 6, computeLinkVelocity=1),
        "getLinkState, forward kinematics": lambda: p.getLinkState(arm, 6, computeForwardKinematics=1),
        "getLinkStates": lambda: p.getLinkStates(arm, range(7)),
        "getLinkStates, velocity": lambda: p.getLinkStates(arm, range(7), computeLinkVelocity=1),
        "getDynamicsInfo": lambda: p.getDynamicsInfo(arm, 3),
        "getVisualShapeData": lambda: p.getVisualShapeData(arm),
        "getCollisionShapeData": lambda: p.getCollisionShapeData(arm, 3),
        "getNumConstraints": p.getNumConstraints,
        "getConstraintUniqueId": lambda: p.getConstraintUniqueId(0),
        "getConstraintInfo": lambda: p.getConstraintInfo(fixed),
        "getConstraintState": lambda: p.getConstraintState(fixed),
        "getPhysicsEngineParameters": p.getPhysicsEngineParameters,
        "getNumUserData": lambda: p.getNumUserData(cube),
        "getUserData": lambda: p.getUserData(data),
        "getUserDataId": lambda: p.getUserDataId(cube, "key"),
        "getUserDataInfo": lambda: p.getUserDataInfo(cube, 0),
        "getDebugVisualizerCamera": p.getDebugVisualizerCamera,
        "getKeyboardEvents": p.getKeyboardEvents,
        "getMouseEvents": p.getMouseEvents,
        "getVREvents": p.getVREvents,
        "isNumpyEnabled": p.isNumpyEnabled,
        "getMeshData": lambda: p.getMeshData(cube, -1),
    }


def queries(p: Any, robot: int, arm: int, cube: int) -> Calls:
    """Return name to call of what computes from the state."""
    seven, tenths = [0.0] * 7, [0.1] * 7
    starts, ends = [[0.02 * i, 0, 2] for i in range(64)], [[0.04 * i, 0, -1] for i in range(64)]
    ball, at = p.createCollisionShape(p.GEOM_SPHERE, radius=0.1), [1, 0, 1.2]
    state = p.saveState()
    count = sum(p.getJointInfo(robot, i)[2] != p.JOINT_FIXED for i in range(p.getNumJoints(robot)))
    floating = [0.1] * count
    pose = [0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]
    view, projection = (
        p.computeViewMatrix([4, 4, 3], [0, 0, 0], [0, 0, 1]),
        p.computeProjectionMatrixFOV(60, 1, 0.1, 10),
    )
    return {
        "getContactPoints": lambda: p.getContactPoints(robot),
        "getContactPoints, two bodies": lambda: p.getContactPoints(arm, cube),
        "getClosestPoints": lambda: p.getClosestPoints(arm, cube, 2.0),
        "getClosestPoints, far apart": lambda: p.getClosestPoints(arm, robot, 0.1),
        "getClosestPoints, shape at a pose": lambda: p.getClosestPoints(
            cube, -1, 0.5, collisionShapeB=ball, collisionShapePositionB=at
        ),
        "getClosestPoints, two shapes at poses": lambda: p.getClosestPoints(
            -1,
            -1,
            0.5,
            collisionShapeA=ball,
            collisionShapePositionA=[1, 0, 1],
            collisionShapeB=ball,
            collisionShapePositionB=at,
        ),
        "getAABB": lambda: p.getAABB(cube),
        "getAABB, link": lambda: p.getAABB(arm, 3),
        "getOverlappingObjects": lambda: p.getOverlappingObjects([0, -1, 0], [3, 1, 2]),
        "rayTest": lambda: p.rayTest([0, 0, 5], [0, 0, -5]),
        "rayTest, mask": lambda: p.rayTest([0, 0, 5], [0, 0, -5], 1),
        "rayTestBatch, 64": lambda: p.rayTestBatch(starts, ends),
        "rayTestBatch, 64, with a body": lambda: p.rayTestBatch(starts, ends, parentObjectUniqueId=robot),
        "rayTestBatch, 1, with a link": lambda: p.rayTestBatch(
            [[0, 0, 0.1]], [[0, 0, 1]], parentObjectUniqueId=arm, parentLinkIndex=6
        ),
        "calculateInverseKinematics": lambda: p.calculateInverseKinematics(arm, 6, [1.6, 0.2, 0.6]),
        "calculateInverseKinematics2": lambda: p.calculateInverseKinematics2(arm, [6], [[1.6, 0.2, 0.6]]),
        "calculateInverseDynamics": lambda: p.calculateInverseDynamics(arm, seven, tenths, tenths),
        "calculateInverseDynamics, floating": lambda: p.calculateInverseDynamics(
            robot, pose + floating, [0.1] * 6 + floating, [0.1] * 6 + floating
        ),
        "calculateJacobian": lambda: p.calculateJacobian(arm, 6, [0, 0, 0], tenths, seven, seven),
        "calculateJacobian, floating": lambda: p.calculateJacobian(
            robot, 3, [0.1, 0, 0], floating, floating, floating
        ),
        "calculateMassMatrix": lambda: p.calculateMassMatrix(arm, tenths),
        "calculateMassMatrix, floating": lambda: p.calculateMassMatrix(robot, floating),
        "restoreState": lambda: p.restoreState(state),
        "performCollisionDetection": p.performCollisionDetection,
        "getCameraImage, 64 x 64": lambda: p.getCameraImage(
            64, 64, view, projection, renderer=p.ER_TINY_RENDERER
        ),
        "stepSimulation": p.stepSimulation,
    }


def commands(p: Any, robot: int, arm: int, cube: int) -> Calls:
    """Return name to call of what changes the state or a setting."""
    q, v, zero = [0, 0, 0, 1], [0.1, 0.2, 0.3], [0, 0, 0]
    held = p.createConstraint(cube, -1, -1, -1, p.JOINT_FIXED, zero, zero, [1, 0, 1])
    line, folder = p.addUserDebugLine(zero, v), data_folder()
    text = p.addUserDebugText("text", v)
    return {
        "applyExternalForce": lambda: p.applyExternalForce(robot, -1, [1, 0, 0], zero, p.LINK_FRAME),
        "applyExternalForce, world": lambda: p.applyExternalForce(arm, 6, [1, 0, 0], zero, p.WORLD_FRAME),
        "applyExternalTorque": lambda: p.applyExternalTorque(robot, -1, [1, 0, 0], p.LINK_FRAME),
        "resetBasePositionAndOrientation": lambda: p.resetBasePositionAndOrientation(robot, [0, 0, 1], q),
        "resetBasePositionAndOrientation, fixed": lambda: p.resetBasePositionAndOrientation(
            arm, [2, 0, 0], q
        ),
        "resetBaseVelocity": lambda: p.resetBaseVelocity(robot, zero, zero),
        "resetJointState": lambda: p.resetJointState(arm, 2, 0.1),
        "resetJointStateMultiDof": lambda: p.resetJointStateMultiDof(arm, 2, [0.1]),
        "resetJointStatesMultiDof": lambda: p.resetJointStatesMultiDof(arm, range(7), [[0.1]] * 7),
        "setJointMotorControl2": lambda: p.setJointMotorControl2(arm, 2, p.POSITION_CONTROL, 0.1, force=100),
        "setJointMotorControl2, velocity": lambda: p.setJointMotorControl2(
            arm, 2, p.VELOCITY_CONTROL, targetVelocity=0.1, force=100
        ),
        "setJointMotorControl2, torque": lambda: p.setJointMotorControl2(
            robot, 3, p.TORQUE_CONTROL, force=0.1
        ),
        "setJointMotorControlArray": lambda: p.setJointMotorControlArray(
            arm, range(7), p.POSITION_CONTROL, [0] * 7
        ),
        "setJointMotorControlArray, forces": lambda: p.setJointMotorControlArray(
            arm, range(7), p.POSITION_CONTROL, [0.0] * 7, forces=[50.0] * 7
        ),
        "setJointMotorControlArray, torque": lambda: p.setJointMotorControlArray(
            robot, [2, 3], p.TORQUE_CONTROL, forces=[0.1, 0.1]
        ),
        "setJointMotorControlMultiDof": lambda: p.setJointMotorControlMultiDof(
            arm, 2, p.POSITION_CONTROL, [0.1], force=[100]
        ),
        "setJointMotorControlMultiDofArray": lambda: p.setJointMotorControlMultiDofArray(
            arm, range(7), p.POSITION_CONTROL, [[0.1]] * 7, forces=[[100]] * 7
        ),
        "enableJointForceTorqueSensor": lambda: p.enableJointForceTorqueSensor(arm, 2, 1),
        "changeDynamics, friction": lambda: p.changeDynamics(cube, -1, lateralFriction=0.5),
        "changeDynamics, damping": lambda: p.changeDynamics(
            robot, -1, linearDamping=0.04, angularDamping=0.04
        ),
        "changeDynamics, mass": lambda: p.changeDynamics(cube, -1, mass=0.2),
        "changeConstraint": lambda: p.changeConstraint(held, [1, 0, 1], q, maxForce=50),
        "setCollisionFilterPair": lambda: p.setCollisionFilterPair(robot, arm, 1, 3, 1),
        "setCollisionFilterGroupMask": lambda: p.setCollisionFilterGroupMask(cube, -1, 1, 1),
        "setGravity": lambda: p.setGravity(0, 0, -9.8),
        "setTimeStep": lambda: p.setTimeStep(1 / 240),
        "setRealTimeSimulation": lambda: p.setRealTimeSimulation(0),
        "setPhysicsEngineParameter": lambda: p.setPhysicsEngineParameter(numSolverIterations=50),
        "setDefaultContactERP": lambda: p.setDefaultContactERP(0.2),
        "setTimeOut": lambda: p.setTimeOut(10),
        "setAdditionalSearchPath": lambda: p.setAdditionalSearchPath(folder),
        "changeVisualShape": lambda: p.changeVisualShape(cube, -1, rgbaColor=[1, 0, 0, 1]),
        "addUserDebugLine, replaced": lambda: p.addUserDebugLine(zero, v, replaceItemUniqueId=line),
        "addUserDebugText, replaced": lambda: p.addUserDebugText("text", v, replaceItemUniqueId=text),
        "setDebugObjectColor": lambda: p.setDebugObjectColor(cube, -1, [1, 0, 0]),
        "addUserData": lambda: p.addUserData(cube, "key", "value"),
        "setInternalSimFlags": lambda: p.setInternalSimFlags(0),
        "removeAllUserDebugItems": p.removeAllUserDebugItems,
        "syncBodyInfo": p.syncBodyInfo,
        "syncUserData": p.syncUserData,
        "submitProfileTiming": lambda: p.submitProfileTiming("event"),
        "configureDebugVisualizer": lambda: p.configureDebugVisualizer(p.COV_ENABLE_GUI, 0),
        "resetDebugVisualizerCamera": lambda: p.resetDebugVisualizerCamera(2, 30, -20, v),
    }


def alternated(p: Any, robot: int, arm: int, cube: int) -> Calls:
    """Return name to call of commands that give another value each time."""
    zero, turns = [0, 0, 0], itertools.cycle((0, 1))
    held = p.createConstraint(cube, -1, -1, -1, p.JOINT_FIXED, zero, zero, [1, 0, 1])

    def reset_and_read() -> None:
        p.resetJointState(arm, 2, 0.1 * next(turns))
        p.getLinkState(arm, 6)

    def step_and(read: Callable[[], Any]) -> Callable[[], None]:
        def call() -> None:
            p.stepSimulation()
            read()

        return call

    def detect() -> None:
        p.resetBasePositionAndOrientation(robot, [0, 0, 0.47 + 0.01 * next(turns)], [0, 0, 0, 1])
        p.performCollisionDetection()
        p.getContactPoints(robot)

    def filter_and_step() -> None:
        on = next(turns)
        p.setCollisionFilterGroupMask(cube, -1, on, on)
        p.stepSimulation()

    return {
        "changeDynamics, friction alternated": lambda: p.changeDynamics(
            cube, -1, lateralFriction=0.4 + 0.1 * next(turns)
        ),
        "changeDynamics, mass alternated": lambda: p.changeDynamics(cube, -1, mass=0.1 + 0.1 * next(turns)),
        "changeDynamics, mass 0 or more, step": step_and(
            lambda: p.changeDynamics(cube, -1, mass=0.1 * next(turns))
        ),
        "changeConstraint, moved": lambda: p.changeConstraint(held, [1, 0, 1 + 0.1 * next(turns)]),
        "resetJointState, getLinkState": reset_and_read,
        "resetBase..., performCollisionDetection, getContactPoints": detect,
        "setCollisionFilterGroupMask, mask alternated": lambda: p.setCollisionFilterGroupMask(
            cube, -1, 1, next(turns)
        ),
        "setCollisionFilterGroupMask, off and on, step": filter_and_step,
        "stepSimulation, getContactPoints": step_and(lambda: p.getContactPoints(robot)),
        "stepSimulation, getJointState with a sensor": step_and(lambda: p.getJointState(arm, 2)),
        "enableJointForceTorqueSensor, off": lambda: p.enableJointForceTorqueSensor(arm, 2, 0),
        "stepSimulation, getJointState": step_and(lambda: p.getJointState(arm, 2)),
        "stepSimulation, getJointStates": step_and(lambda: p.getJointStates(arm, range(7))),
        "stepSimulation, getLinkState": step_and(lambda: p.getLinkState(arm, 6)),
        "stepSimulation, getLinkState, velocity": step_and(
            lambda: p.getLinkState(arm, 6, computeLinkVelocity=1, computeForwardKinematics=1)
        ),
        "stepSimulation, getAABB": step_and(lambda: p.getAABB(cube)),
        "stepSimulation, getClosestPoints": step_and(lambda: p.getClosestPoints(robot, cube, 0.5)),
        "stepSimulation, calculateJacobian": step_and(
            lambda: p.calculateJacobian(arm, 6, zero, [0.1] * 7, [0.0] * 7, [0.0] * 7)
        ),
    }


def loops(p: Any, robot: int, arm: int, cube: int) -> Calls:
    """Return name to call of what programs repeat, with steps between creating and removing."""
    box, zero = p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.1, 0.1, 0.1]), [0, 0, 0]
    p.setCollisionFilterGroupMask(cube, -1, 1, -1)  # as before `alternated`

    def body() -> None:
        made = p.createMultiBody(1, box, -1, [3, 3, 1])
        p.stepSimulation()
        p.removeBody(made)
        p.stepSimulation()

    def linked() -> None:
        made = p.createMultiBody(
            1, box, -1, [3, 3, 1], linkMasses=[1, 1], linkCollisionShapeIndices=[box, box],
            linkVisualShapeIndices=[-1, -1], linkPositions=[[0, 0, 0.3]] * 2,
            linkOrientations=[[0, 0, 0, 1]] * 2, linkInertialFramePositions=[zero] * 2,
            linkInertialFrameOrientations=[[0, 0, 0, 1]] * 2, linkParentIndices=[0, 1],
            linkJointTypes=[p.JOINT_REVOLUTE] * 2, linkJointAxis=[[0, 0, 1]] * 2,
        )  # fmt: skip
        p.stepSimulation()
        p.removeBody(made)
        p.stepSimulation()

    def filtered() -> None:
        made = p.createMultiBody(1, box, -1, [3, 3, 1])
        p.setCollisionFilterPair(made, robot, -1, -1, 0)
        p.stepSimulation()
        p.removeBody(made)
        p.stepSimulation()

    def seen() -> None:
        made = p.createMultiBody(1, box, -1, [3, 3, 1])
        p.rayTest([0, 0, 5], [0, 0, -5])
        p.removeBody(made)

    def ten() -> None:
        made = [p.createMultiBody(1, box, -1, [3 + k, 3, 1]) for k in range(10)]
        p.stepSimulation()
        for body in made:
            p.removeBody(body)
        p.stepSimulation()

    def all_pairs() -> None:
        for k in range(3):
            for other in range(7):
                p.setCollisionFilterPair(robot, arm, k, other, 0)

    def constraint() -> None:
        made = p.createConstraint(cube, -1, -1, -1, p.JOINT_POINT2POINT, zero, zero, [1, 0, 1])
        p.stepSimulation()
        p.removeConstraint(made)
        p.stepSimulation()

    def grasp() -> None:
        made = p.createConstraint(arm, 6, cube, -1, p.JOINT_FIXED, zero, [0, 0, 0.1], zero)
        p.stepSimulation()
        p.removeConstraint(made)
        p.stepSimulation()

    def gear() -> None:
        made = p.createConstraint(robot, 2, robot, 3, p.JOINT_GEAR, [0, 1, 0], zero, zero)
        p.changeConstraint(made, gearRatio=-1, maxForce=100)
        p.stepSimulation()
        p.removeConstraint(made)
        p.stepSimulation()

    def apart() -> None:
        for on in (0, 1):
            p.setCollisionFilterPair(robot, arm, 1, 3, on)
            p.stepSimulation()

    def cubes() -> None:
        p.resetSimulation()
        for k in range(5):
            p.loadURDF("cube_small.urdf", [k, 0, 1])
        p.stepSimulation()

    def robots() -> None:
        p.resetSimulation()
        p.loadURDF("cartpole.urdf")
        p.stepSimulation()

    def ants() -> None:
        p.resetSimulation()
        p.loadMJCF("mjcf/ant.xml")
        p.stepSimulation()

    return {
        "createConstraint, step, removed, step": constraint,
        "createConstraint to an arm, step, removed, step": grasp,
        "createConstraint of a gear, step, removed, step": gear,
        "createMultiBody, step, removed, step": body,
        "createMultiBody with links, step, removed, step": linked,
        "createMultiBody, filter, step, removed, step": filtered,
        "createMultiBody, rayTest, removed": seen,
        "10 of createMultiBody, step, removed, step": ten,
        "setCollisionFilterPair, off and on, steps": apart,
        "setCollisionFilterPair, 21 pairs": all_pairs,
        "resetSimulation, 5 cubes, step": cubes,
        "resetSimulation, cartpole, step": robots,
        "resetSimulation, ant of MJCF, step": ants,
    }


def planning(p: Any, *bodies: int) -> Calls:
    """Return name to call of what planners repeat, in a world that makes no step."""
    p.resetSimulation()
    p.loadURDF("plane.urdf")
    arm = p.loadURDF("kuka_iiwa/model.urdf", [2, 0, 0], useFixedBase=True)
    box = p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.1, 0.1, 0.1])
    boxes = [p.createMultiBody(1, box, -1, [0.19 * k, 0, 0.1]) for k in range(5)]
    turns = itertools.cycle((0.1, 0.2, 0.3))

    def pose() -> None:
        angle = next(turns)
        for joint in range(7):
            p.resetJointState(arm, joint, angle)

    def arm_detected() -> None:
        pose()
        p.performCollisionDetection()
        p.getContactPoints(arm)

    def box_detected() -> None:
        p.resetBasePositionAndOrientation(boxes[0], [0.1 * next(turns), 0, 0.1], [0, 0, 0, 1])
        p.performCollisionDetection()
        p.getContactPoints(boxes[0])

    def arm_close() -> None:
        pose()
        for other in boxes:
            p.getClosestPoints(arm, other, 0.0)

    return {
        "no step: arm posed, contacts": arm_detected,
        "no step: box moved, contacts": box_detected,
        "no step: arm posed, closest points of 5 boxes": arm_close,
    }


def pairs(p: Any, robot: int, arm: int, cube: int) -> Calls:
    """Return name to call of what creates something and removes it."""
    box = p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.1, 0.1, 0.1])
    zero = [0, 0, 0]

    def held() -> int:
        made = p.createConstraint(cube, -1, -1, -1, p.JOINT_POINT2POINT, zero, zero, zero)
        p.changeConstraint(made, maxForce=50)
        return made

    def geared() -> int:
        made = p.createConstraint(robot, 2, robot, 3, p.JOINT_GEAR, [0, 1, 0], zero, zero)
        p.changeConstraint(made, gearRatio=-1, maxForce=100)
        return made

    def pair(create: Callable[[], int], remove: Callable[[int], Any]) -> Callable[[], Any]:
        return lambda: remove(create())

    return {
        "createCollisionShape, removed": pair(
            lambda: p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.1, 0.1, 0.1]), p.removeCollisionShape
        ),
        "createMultiBody, removed": pair(lambda: p.createMultiBody(1, box), p.removeBody),
        "createConstraint, removed": pair(
            lambda: p.createConstraint(cube, -1, -1, -1, p.JOINT_POINT2POINT, zero, zero, zero),
            p.removeConstraint,
        ),
        "createConstraint, changed, removed": pair(held, p.removeConstraint),
        "createConstraint of a gear, changed, removed": pair(geared, p.removeConstraint),
        "addUserDebugLine, removed": pair(lambda: p.addUserDebugLine(zero, [0, 0, 1]), p.removeUserDebugItem),
        "addUserDebugText, removed": pair(lambda: p.addUserDebugText("text", zero), p.removeUserDebugItem),
        "addUserDebugParameter, removed": pair(
            lambda: p.addUserDebugParameter("name", 0, 1, 0.5), p.removeUserDebugItem
        ),
        "addUserDebugPoints, removed": pair(
            lambda: p.addUserDebugPoints([zero] * 9, [[1, 0, 0]] * 9), p.removeUserDebugItem
        ),
        "addUserData, removed": pair(lambda: p.addUserData(cube, "other", "value"), p.removeUserData),
        "saveState, removed": pair(p.saveState, p.removeState),
        "loadURDF, removed": pair(lambda: p.loadURDF("cube_small.urdf"), p.removeBody),
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
