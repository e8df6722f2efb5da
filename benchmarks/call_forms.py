"""Further tables of `calls.py`: the same calls with tuples, arrays, keywords and the client's number."""

from __future__ import annotations

import itertools
import tempfile
from collections.abc import Callable
from contextlib import suppress
from typing import Any

import numpy as np

Calls = dict[str, Callable[[], Any]]


def math_forms(p: Any, *bodies: int) -> Calls:
    """Return name to call of the mathematics with arrays, tuples and keywords."""
    q, r, v = np.array([0.1, 0.2, 0.3, 0.927]), np.array([0.0, 0.6, 0.0, 0.8]), np.array([0.1, 0.2, 0.3])
    tuple_q, tuple_v = tuple(q.tolist()), tuple(v.tolist())
    short = v.astype(np.float32)
    return {
        "getQuaternionFromEuler of an array": lambda: p.getQuaternionFromEuler(v),
        "getQuaternionFromEuler of integers": lambda: p.getQuaternionFromEuler([0, 0, 1]),
        "getQuaternionFromEuler of short floats": lambda: p.getQuaternionFromEuler(short),
        "getEulerFromQuaternion of an array": lambda: p.getEulerFromQuaternion(q),
        "getMatrixFromQuaternion of an array": lambda: p.getMatrixFromQuaternion(q),
        "getMatrixFromQuaternion of a tuple": lambda: p.getMatrixFromQuaternion(tuple_q),
        "multiplyTransforms of arrays": lambda: p.multiplyTransforms(v, q, v, q),
        "multiplyTransforms of tuples": lambda: p.multiplyTransforms(tuple_v, tuple_q, tuple_v, tuple_q),
        "multiplyTransforms, keywords": lambda: p.multiplyTransforms(
            positionA=tuple_v, orientationA=tuple_q, positionB=tuple_v, orientationB=tuple_q
        ),
        "invertTransform of arrays": lambda: p.invertTransform(v, q),
        "invertTransform, keywords": lambda: p.invertTransform(position=tuple_v, orientation=tuple_q),
        "rotateVector of arrays": lambda: p.rotateVector(q, v),
        "getQuaternionSlerp of arrays": lambda: p.getQuaternionSlerp(q, r, 0.3),
        "getDifferenceQuaternion of arrays": lambda: p.getDifferenceQuaternion(q, r),
        "getAxisAngleFromQuaternion, client": lambda: p.getAxisAngleFromQuaternion(
            tuple_q, physicsClientId=0
        ),
        "getQuaternionFromEuler, client": lambda: p.getQuaternionFromEuler(tuple_v, physicsClientId=0),
        "computeViewMatrix of arrays": lambda: p.computeViewMatrix(v, r[:3], q[:3]),
        "computeProjectionMatrixFOV, keywords": lambda: p.computeProjectionMatrixFOV(
            fov=60, aspect=1.5, nearVal=0.1, farVal=10
        ),
        "computeViewMatrixFromYawPitchRoll, keywords": lambda: p.computeViewMatrixFromYawPitchRoll(
            cameraTargetPosition=tuple_v, distance=1, yaw=30, pitch=-20, roll=0, upAxisIndex=2
        ),
    }


def getter_forms(p: Any, robot: int, arm: int, cube: int) -> Calls:
    """Return name to call of getters with keywords, numbers of NumPy, and the client's number."""
    body, joint, joints = np.int64(arm), np.int64(2), list(range(7))
    slider = p.addUserDebugParameter("slider", 0, 1, 0.5)
    p.stepSimulation()

    def read() -> None:
        with suppress(p.error):
            p.readUserDebugParameter(slider)

    return {
        "getBasePositionAndOrientation, client": lambda: p.getBasePositionAndOrientation(
            robot, physicsClientId=0
        ),
        "getBasePositionAndOrientation, keyword": lambda: p.getBasePositionAndOrientation(bodyUniqueId=robot),
        "getBasePositionAndOrientation of a number of NumPy": lambda: p.getBasePositionAndOrientation(body),
        "getBaseVelocity, client": lambda: p.getBaseVelocity(robot, physicsClientId=0),
        "getJointState, keywords": lambda: p.getJointState(bodyUniqueId=arm, jointIndex=2),
        "getJointState of numbers of NumPy": lambda: p.getJointState(body, joint),
        "getJointStates of a list": lambda: p.getJointStates(arm, joints),
        "getJointStates, keywords": lambda: p.getJointStates(bodyUniqueId=arm, jointIndices=joints),
        "getJointStates of a tuple, client": lambda: p.getJointStates(arm, tuple(joints), physicsClientId=0),
        "getJointInfo of numbers of NumPy": lambda: p.getJointInfo(body, joint),
        "getJointInfo, client": lambda: p.getJointInfo(arm, 2, physicsClientId=0),
        "getNumJoints, client": lambda: p.getNumJoints(arm, physicsClientId=0),
        "getLinkState, all keywords": lambda: p.getLinkState(
            bodyUniqueId=arm, linkIndex=6, computeLinkVelocity=True, computeForwardKinematics=True
        ),
        "getLinkState, true": lambda: p.getLinkState(arm, 6, True, True),
        "getLinkState of numbers of NumPy": lambda: p.getLinkState(body, joint),
        "getLinkStates of an array": lambda: p.getLinkStates(arm, np.arange(7)),
        "getDynamicsInfo, keywords": lambda: p.getDynamicsInfo(bodyUniqueId=arm, linkIndex=3),
        "getVisualShapeData, flags": lambda: p.getVisualShapeData(arm, 1),
        "getCollisionShapeData of a base": lambda: p.getCollisionShapeData(cube, -1),
        "getAABB, keywords": lambda: p.getAABB(bodyUniqueId=arm, linkIndex=3),
        "getAABB of numbers of NumPy": lambda: p.getAABB(body, joint),
        "getContactPoints, all": p.getContactPoints,
        "getContactPoints, keywords": lambda: p.getContactPoints(bodyA=robot, bodyB=0),
        "getContactPoints, links": lambda: p.getContactPoints(robot, 0, -1, -1),
        "getClosestPoints, keywords": lambda: p.getClosestPoints(bodyA=arm, bodyB=cube, distance=2.0),
        "getClosestPoints, links": lambda: p.getClosestPoints(arm, cube, 2.0, 3, -1),
        "getOverlappingObjects of arrays": lambda: p.getOverlappingObjects(
            np.array([0.0, -1.0, 0.0]), np.array([3.0, 1.0, 2.0])
        ),
        "getMeshData of a link": lambda: p.getMeshData(arm, 3),
        "getMeshData, flags": lambda: p.getMeshData(cube, -1, flags=0),
        "getConstraintInfo, none": lambda: _refused(p, lambda: p.getConstraintInfo(9999)),
        "readUserDebugParameter": read,
        "getUserDataId, keywords": lambda: p.getUserDataId(cube, "key", linkIndex=-1),
        "getBodyInfo, client": lambda: p.getBodyInfo(arm, physicsClientId=0),
        "getConnectionInfo, client": lambda: p.getConnectionInfo(physicsClientId=0),
        "isConnected, client": lambda: p.isConnected(physicsClientId=0),
        "isConnected, positional": lambda: p.isConnected(0),
        "getNumBodies, client": lambda: p.getNumBodies(physicsClientId=0),
    }


def _refused(p: Any, call: Callable[[], Any]) -> None:
    with suppress(p.error):
        call()


def query_forms(p: Any, robot: int, arm: int, cube: int) -> Calls:
    """Return name to call of queries with arrays, keywords and further arguments."""
    start, end = np.array([0.0, 0.0, 5.0]), np.array([0.0, 0.0, -5.0])
    starts = np.stack([np.linspace(0.0, 1.28, 64), np.zeros(64), np.full(64, 2.0)], 1)
    ends = starts * [2.0, 1.0, 0.0] - [0.0, 0.0, 1.0]
    target, turn, seven, tenths = np.array([1.6, 0.2, 0.6]), [0, 1, 0, 0], np.zeros(7), np.full(7, 0.1)
    low, high, ranges, rest = [-2.0] * 7, [2.0] * 7, [4.0] * 7, [0.1] * 7
    listed = [0.1] * 7
    return {
        "rayTest of arrays": lambda: p.rayTest(start, end),
        "rayTest, keywords": lambda: p.rayTest(rayFromPosition=[0, 0, 5], rayToPosition=[0, 0, -5]),
        "rayTestBatch, 64, arrays": lambda: p.rayTestBatch(starts, ends),
        "rayTestBatch, 64, keywords": lambda: p.rayTestBatch(
            rayFromPositions=starts.tolist(), rayToPositions=ends.tolist()
        ),
        "rayTestBatch, 64, threads": lambda: p.rayTestBatch(starts, ends, 0),
        "rayTestBatch, 64, reportHitNumber": lambda: p.rayTestBatch(starts, ends, reportHitNumber=0),
        "calculateInverseKinematics, orientation": lambda: p.calculateInverseKinematics(
            arm, 6, target, turn
        ),
        "calculateInverseKinematics, null space": lambda: p.calculateInverseKinematics(
            arm, 6, target, turn, low, high, ranges, rest
        ),
        "calculateInverseKinematics, keywords": lambda: p.calculateInverseKinematics(
            bodyUniqueId=arm, endEffectorLinkIndex=6, targetPosition=[1.6, 0.2, 0.6], maxNumIterations=100,
            residualThreshold=1e-5,
        ),
        "calculateInverseKinematics, damping": lambda: p.calculateInverseKinematics(
            arm, 6, target, jointDamping=listed
        ),
        "calculateInverseKinematics, solver": lambda: p.calculateInverseKinematics(
            arm, 6, target, turn, solver=p.IK_DLS
        ),
        "calculateInverseKinematics, present positions": lambda: p.calculateInverseKinematics(
            arm, 6, target, turn, currentPositions=listed
        ),
        "calculateInverseKinematics2, orientation absent": lambda: p.calculateInverseKinematics2(
            arm, [5, 6], [[1.6, 0.2, 0.6], [1.6, 0.2, 0.7]], solver=p.IK_DLS
        ),
        "calculateInverseDynamics of arrays": lambda: p.calculateInverseDynamics(
            arm, tenths.tolist(), seven.tolist(), seven.tolist()
        ),
        "calculateInverseDynamics, keywords": lambda: p.calculateInverseDynamics(
            bodyUniqueId=arm, objPositions=listed, objVelocities=listed, objAccelerations=listed
        ),
        "calculateJacobian, keywords": lambda: p.calculateJacobian(
            bodyUniqueId=arm, linkIndex=6, localPosition=[0, 0, 0], objPositions=listed, objVelocities=listed,
            objAccelerations=listed,
        ),
        "calculateMassMatrix, keywords": lambda: p.calculateMassMatrix(
            bodyUniqueId=arm, objPositions=listed
        ),
        "renderImage": lambda: p.renderImage(16, 16),
        "getCameraImage, 16 x 16": lambda: p.getCameraImage(16, 16, renderer=p.ER_TINY_RENDERER),
        "getCameraImage, 100 x 100, shadow": lambda: p.getCameraImage(
            100, 100, shadow=1, lightDirection=[1, 1, 1], renderer=p.ER_TINY_RENDERER
        ),
    }  # fmt: skip


def command_forms(p: Any, robot: int, arm: int, cube: int) -> Calls:
    """Return name to call of commands with arrays, tuples, keywords and the client's number."""
    zero, q = np.zeros(3), np.array([0.0, 0.0, 0.0, 1.0])
    at, force = np.array([0.0, 0.0, 1.0]), np.array([1.0, 0.0, 0.0])
    joints, targets, forces = list(range(7)), np.full(7, 0.1), np.full(7, 50.0)
    turns = itertools.cycle((0.1, 0.2))
    identity = (0.0, 0.0, 0.0, 1.0)
    return {
        "resetBasePositionAndOrientation of arrays": lambda: p.resetBasePositionAndOrientation(robot, at, q),
        "resetBasePositionAndOrientation, keywords": lambda: p.resetBasePositionAndOrientation(
            bodyUniqueId=robot, posObj=[0, 0, 1], ornObj=[0, 0, 0, 1]
        ),
        "resetBasePositionAndOrientation of tuples, client": lambda: p.resetBasePositionAndOrientation(
            robot, (0.0, 0.0, 1.0), identity, physicsClientId=0
        ),
        "resetBaseVelocity of arrays": lambda: p.resetBaseVelocity(robot, zero, zero),
        "resetBaseVelocity, linear": lambda: p.resetBaseVelocity(robot, linearVelocity=[0, 0, 0]),
        "resetBaseVelocity, angular": lambda: p.resetBaseVelocity(robot, angularVelocity=[0, 0, 0]),
        "resetJointState, velocity": lambda: p.resetJointState(arm, 2, 0.1, 0.2),
        "resetJointState, keywords": lambda: p.resetJointState(
            bodyUniqueId=arm, jointIndex=2, targetValue=0.1, targetVelocity=0.0
        ),
        "resetJointState of a number of NumPy": lambda: p.resetJointState(arm, 2, targets[2]),
        "resetJointStatesMultiDof, velocities": lambda: p.resetJointStatesMultiDof(
            arm, joints, [[0.1]] * 7, [[0.0]] * 7
        ),
        "setJointMotorControl2, keywords": lambda: p.setJointMotorControl2(
            bodyUniqueId=arm, jointIndex=2, controlMode=p.POSITION_CONTROL, targetPosition=0.1,
            targetVelocity=0, force=100, positionGain=0.03, velocityGain=1,
        ),
        "setJointMotorControl2, bodyIndex": lambda: p.setJointMotorControl2(
            bodyIndex=arm, jointIndex=2, controlMode=p.POSITION_CONTROL, targetPosition=next(turns), force=100
        ),
        "setJointMotorControl2 of numbers of NumPy": lambda: p.setJointMotorControl2(
            arm, 2, p.POSITION_CONTROL, targets[2], force=forces[2]
        ),
        "setJointMotorControl2, maxVelocity": lambda: p.setJointMotorControl2(
            arm, 2, p.POSITION_CONTROL, 0.1, force=100, maxVelocity=1.0
        ),
        "setJointMotorControl2, velocity without force": lambda: p.setJointMotorControl2(
            arm, 2, p.VELOCITY_CONTROL, force=0
        ),
        "setJointMotorControl2, off and on": lambda: [
            p.setJointMotorControl2(arm, 2, p.VELOCITY_CONTROL, force=size) for size in (0, 100)
        ],
        "setJointMotorControl2, force alternated": lambda: p.setJointMotorControl2(
            arm, 2, p.POSITION_CONTROL, 0.1, force=1000 * next(turns)
        ),
        "setJointMotorControl2 of a fixed joint": lambda: p.setJointMotorControl2(
            robot, 0, p.POSITION_CONTROL, 0.1, force=100
        ),
        "setJointMotorControlArray of arrays": lambda: p.setJointMotorControlArray(
            arm, joints, p.POSITION_CONTROL, targetPositions=targets, forces=forces
        ),
        "setJointMotorControlArray, all": lambda: p.setJointMotorControlArray(
            arm, joints, p.POSITION_CONTROL, targetPositions=[0.1] * 7, targetVelocities=[0.0] * 7,
            forces=[50.0] * 7, positionGains=[0.1] * 7, velocityGains=[1.0] * 7,
        ),
        "setJointMotorControlArray, velocity": lambda: p.setJointMotorControlArray(
            arm, joints, p.VELOCITY_CONTROL, targetVelocities=[0.1] * 7, forces=[50.0] * 7
        ),
        "setJointMotorControlMultiDof, torque": lambda: p.setJointMotorControlMultiDof(
            arm, 2, p.TORQUE_CONTROL, force=[0.1]
        ),
        "setJointMotorControlMultiDofArray, torque": lambda: p.setJointMotorControlMultiDofArray(
            arm, joints, p.TORQUE_CONTROL, forces=[[0.1]] * 7
        ),
        "setJointMotorControl, velocity": lambda: p.setJointMotorControl(arm, 2, p.VELOCITY_CONTROL, 0.1, 50),
        "setJointMotorControl, torque": lambda: p.setJointMotorControl(arm, 2, p.TORQUE_CONTROL, 0.1),
        "setJointMotorControl, eight": lambda: p.setJointMotorControl(
            arm, 2, p.POSITION_CONTROL, 0.1, 0.0, 100, 0.1, 1.0
        ),
        "applyExternalForce of arrays": lambda: p.applyExternalForce(robot, -1, force, zero, p.LINK_FRAME),
        "applyExternalForce, keywords": lambda: p.applyExternalForce(
            objectUniqueId=robot, linkIndex=-1, forceObj=[1, 0, 0], posObj=[0, 0, 0], flags=p.WORLD_FRAME
        ),
        "applyExternalTorque of an array": lambda: p.applyExternalTorque(robot, -1, force, p.WORLD_FRAME),
        "applyExternalTorque, keywords": lambda: p.applyExternalTorque(
            objectUniqueId=robot, linkIndex=-1, torqueObj=[1, 0, 0], flags=p.LINK_FRAME
        ),
        "stepSimulation, client": lambda: p.stepSimulation(physicsClientId=0),
        "setGravity, client": lambda: p.setGravity(0, 0, -9.8, physicsClientId=0),
        "setGravity, keywords": lambda: p.setGravity(gravX=0, gravY=0, gravZ=-9.8),
        "setPhysicsEngineParameter, four": lambda: p.setPhysicsEngineParameter(
            fixedTimeStep=1 / 240, numSolverIterations=50, numSubSteps=0, restitutionVelocityThreshold=0.2
        ),
        "changeDynamics, keywords": lambda: p.changeDynamics(
            bodyUniqueId=cube, linkIndex=-1, lateralFriction=0.5, restitution=0.1
        ),
        "changeDynamics of a number of NumPy": lambda: p.changeDynamics(
            cube, -1, lateralFriction=targets[0] + next(turns)
        ),
        "changeVisualShape of an array": lambda: p.changeVisualShape(
            cube, -1, rgbaColor=np.array([next(turns), 0.0, 0.0, 1.0])
        ),
        "changeConstraint, none": lambda: p.changeConstraint(9999, maxForce=50),
        "enableJointForceTorqueSensor, keywords": lambda: p.enableJointForceTorqueSensor(
            bodyUniqueId=arm, jointIndex=2, enableSensor=True
        ),
        "enableJointForceTorqueSensor, off again": lambda: p.enableJointForceTorqueSensor(arm, 2, False),
        "setCollisionFilterPair, keywords": lambda: p.setCollisionFilterPair(
            bodyUniqueIdA=robot, bodyUniqueIdB=arm, linkIndexA=1, linkIndexB=3, enableCollision=1
        ),
        "setCollisionFilterGroupMask, keywords": lambda: p.setCollisionFilterGroupMask(
            bodyUniqueId=cube, linkIndexA=-1, collisionFilterGroup=1, collisionFilterMask=1
        ),
        "removeAllUserParameters": p.removeAllUserParameters,
        "addUserDebugLine, all": lambda: p.removeUserDebugItem(
            p.addUserDebugLine([0, 0, 0], [0, 0, 1], [1, 0, 0], 2, 0, parentObjectUniqueId=cube,
                               parentLinkIndex=-1)
        ),
        "addUserDebugLine of arrays": lambda: p.removeUserDebugItem(p.addUserDebugLine(zero, at, force)),
        "addUserDebugText, all": lambda: p.removeUserDebugItem(
            p.addUserDebugText("text", [0, 0, 0], textColorRGB=[1, 0, 0], textSize=1.5,
                               textOrientation=[0, 0, 0, 1])
        ),
        "configureDebugVisualizer, keywords": lambda: p.configureDebugVisualizer(
            flag=p.COV_ENABLE_RENDERING, enable=0
        ),
        "configureDebugVisualizer, light": lambda: p.configureDebugVisualizer(lightPosition=[1, 1, 1]),
        "resetDebugVisualizerCamera, keywords": lambda: p.resetDebugVisualizerCamera(
            cameraDistance=2, cameraYaw=30, cameraPitch=-20, cameraTargetPosition=[0, 0, 0]
        ),
        "saveState": lambda: p.removeState(p.saveState()),
    }  # fmt: skip


def further(p: Any, robot: int, arm: int, cube: int) -> Calls:
    """Return name to call of what programs create, load and read less often."""
    folder = tempfile.mkdtemp()
    zero, unit = [0, 0, 0], [0, 0, 0, 1]
    box, look = (
        p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.1] * 3),
        p.createVisualShape(p.GEOM_BOX, halfExtents=[0.1] * 3),
    )
    cubes = itertools.cycle(([1, 0, 0, 1], [0, 1, 0, 1]))

    def reset() -> None:
        state = p.saveState()
        p.restoreState(state)
        p.removeState(state)

    def mesh(**given: Any) -> Callable[[], Any]:
        return lambda: p.removeCollisionShape(
            p.createCollisionShape(p.GEOM_MESH, fileName="duck.obj", meshScale=[0.1] * 3, **given)
        )

    return {
        "createMultiBody with a look, removed": lambda: p.removeBody(p.createMultiBody(1, box, look)),
        "createMultiBody, keywords, removed": lambda: p.removeBody(
            p.createMultiBody(
                baseMass=1, baseCollisionShapeIndex=box, baseVisualShapeIndex=look, basePosition=[0, 3, 1],
                baseOrientation=unit, baseInertialFramePosition=zero,
            )
        ),
        "createMultiBody of mass 0, removed": lambda: p.removeBody(
            p.createMultiBody(0, box, look, [0, 3, 1])
        ),
        "createMultiBody, coloured, removed": lambda: _coloured(p, box, look, next(cubes)),
        "createCollisionShape of a cylinder, removed": lambda: p.removeCollisionShape(
            p.createCollisionShape(p.GEOM_CYLINDER, radius=0.1, height=0.2)
        ),
        "createCollisionShape of a plane, removed": lambda: p.removeCollisionShape(
            p.createCollisionShape(p.GEOM_PLANE)
        ),
        "createCollisionShape of a mesh file, removed": mesh(),
        "createVisualShape of a sphere, removed": lambda: p.removeCollisionShape(
            p.createVisualShape(p.GEOM_SPHERE, radius=0.1, rgbaColor=[1, 0, 0, 1])
        ),
        "createVisualShape of a mesh file, removed": lambda: p.removeCollisionShape(
            p.createVisualShape(p.GEOM_MESH, fileName="duck.obj", meshScale=[0.1] * 3)
        ),
        "loadURDF at a pose, removed": lambda: p.removeBody(
            p.loadURDF("cube_small.urdf", [0, 3, 1], unit, useFixedBase=True, globalScaling=2.0)
        ),
        "loadURDF, numbers, removed": lambda: p.removeBody(p.loadURDF("cube_small.urdf", 0, 3, 1)),
        "loadURDF of a plane, removed": lambda: p.removeBody(p.loadURDF("plane.urdf")),
        "loadURDF of a duck, removed": lambda: p.removeBody(p.loadURDF("duck_vhacd.urdf")),
        "loadURDF of R2D2, removed": lambda: p.removeBody(p.loadURDF("r2d2.urdf", [0, 5, 1])),
        "saveState, restored, removed": reset,
        "startStateLogging of profiles, stopped": lambda: p.stopStateLogging(
            p.startStateLogging(p.STATE_LOGGING_PROFILE_TIMINGS, f"{folder}/profile")
        ),
        "loadPlugin of no file": lambda: p.loadPlugin(f"{folder}/none.so"),
        "executePluginCommand of none": lambda: p.executePluginCommand(99, "a"),
        "removeBody of none": lambda: p.removeBody(9999),
        "removeUserDebugItem of none": lambda: p.removeUserDebugItem(9999),
        "getBodyInfo of none": lambda: _refused(p, lambda: p.getBodyInfo(9999)),
        "getJointInfo of none": lambda: _refused(p, lambda: p.getJointInfo(9999, 0)),
        "getBasePositionAndOrientation of none": lambda: _refused(
            p, lambda: p.getBasePositionAndOrientation(9999)
        ),
        "loadURDF of no file": lambda: _refused(p, lambda: p.loadURDF("none.urdf")),
    }  # fmt: skip


def _coloured(p: Any, box: int, look: int, colour: list[int]) -> None:
    made = p.createMultiBody(1, box, look, [0, 3, 1])
    p.changeVisualShape(made, -1, rgbaColor=colour)
    p.removeBody(made)


def numpy_numbers(p: Any, robot: int, arm: int, cube: int) -> Calls:
    """Return name to call with numbers of bodies, links and joints that are NumPy's."""
    a, c, r, two, six, base = (np.int64(k) for k in (arm, cube, robot, 2, 6, -1))
    listed, zero = [0.1] * 7, [0, 0, 0]
    held = np.int64(p.createConstraint(cube, -1, -1, -1, p.JOINT_FIXED, zero, zero, [1, 0, 1]))
    turns = itertools.cycle((0.1, 0.2))
    p.stepSimulation()
    calls: Calls = {
        "getNumJoints": lambda: p.getNumJoints(a),
        "getBodyInfo": lambda: p.getBodyInfo(a),
        "getBaseVelocity": lambda: p.getBaseVelocity(r),
        "getJointStates": lambda: p.getJointStates(a, [two, six]),
        "getJointStateMultiDof": lambda: p.getJointStateMultiDof(a, two),
        "getLinkStates": lambda: p.getLinkStates(a, [two, six]),
        "getDynamicsInfo": lambda: p.getDynamicsInfo(a, two),
        "getVisualShapeData": lambda: p.getVisualShapeData(a),
        "getCollisionShapeData": lambda: p.getCollisionShapeData(a, two),
        "getContactPoints": lambda: p.getContactPoints(r),
        "getClosestPoints": lambda: p.getClosestPoints(a, c, 2.0),
        "getConstraintInfo": lambda: p.getConstraintInfo(held),
        "getConstraintState": lambda: p.getConstraintState(held),
        "changeConstraint": lambda: p.changeConstraint(held, [1, 0, 1 + next(turns)]),
        "calculateJacobian": lambda: p.calculateJacobian(a, six, zero, listed, listed, listed),
        "calculateMassMatrix": lambda: p.calculateMassMatrix(a, listed),
        "calculateInverseKinematics": lambda: p.calculateInverseKinematics(a, six, [1.6, 0.2, 0.6]),
        "calculateInverseDynamics": lambda: p.calculateInverseDynamics(a, listed, listed, listed),
        "applyExternalForce": lambda: p.applyExternalForce(r, base, [1, 0, 0], zero, p.LINK_FRAME),
        "applyExternalTorque": lambda: p.applyExternalTorque(r, base, [1, 0, 0], p.LINK_FRAME),
        "resetBasePositionAndOrientation": lambda: p.resetBasePositionAndOrientation(
            r, [0, 0, 1], [0, 0, 0, 1]
        ),
        "resetBaseVelocity": lambda: p.resetBaseVelocity(r, zero, zero),
        "resetJointState": lambda: p.resetJointState(a, two, 0.1),
        "setJointMotorControl2": lambda: p.setJointMotorControl2(a, two, p.POSITION_CONTROL, 0.1),
        "setJointMotorControl2, torque": lambda: p.setJointMotorControl2(a, two, p.TORQUE_CONTROL, force=1),
        "setJointMotorControlArray": lambda: p.setJointMotorControlArray(
            a, [two, six], p.POSITION_CONTROL, [0.1] * 2
        ),
        "enableJointForceTorqueSensor": lambda: p.enableJointForceTorqueSensor(a, two, 1),
        "changeDynamics": lambda: p.changeDynamics(c, base, lateralFriction=next(turns)),
        "changeVisualShape": lambda: p.changeVisualShape(c, base, rgbaColor=[next(turns), 0, 0, 1]),
        "setCollisionFilterPair": lambda: p.setCollisionFilterPair(r, a, two, two, 1),
        "setCollisionFilterGroupMask": lambda: p.setCollisionFilterGroupMask(c, base, 1, 1),
        "rayTestBatch": lambda: p.rayTestBatch([[0, 0, 0.1]], [[0, 0, 1]], parentObjectUniqueId=a),
        "getMeshData": lambda: p.getMeshData(c, base),
        "addUserDebugLine": lambda: p.removeUserDebugItem(
            p.addUserDebugLine(zero, [0, 0, 1], parentObjectUniqueId=c)
        ),
        "addUserData": lambda: p.addUserData(c, "key", "value"),
        "getUserDataId": lambda: p.getUserDataId(c, "key"),
        "createConstraint": lambda: p.removeConstraint(
            p.createConstraint(c, base, -1, -1, p.JOINT_POINT2POINT, zero, zero, zero)
        ),
    }
    return {f"{name}, numbers of NumPy": call for name, call in calls.items()}


TABLES = (math_forms, getter_forms, query_forms, command_forms, further, numpy_numbers)
