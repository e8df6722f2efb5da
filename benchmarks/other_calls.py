"""Further tables of `calls.py`: settings that change, answers after changes, shapes and files."""

from __future__ import annotations

import itertools
import tempfile
from collections.abc import Callable, Iterable
from typing import Any

import numpy as np

Calls = dict[str, Callable[[], Any]]
_DYNAMICS: dict[str, tuple[float, float]] = {
    "mass": (1.0, 2.0), "lateralFriction": (0.5, 0.6), "spinningFriction": (0.1, 0.2),
    "rollingFriction": (0.01, 0.02), "restitution": (0.1, 0.2), "linearDamping": (0.01, 0.02),
    "angularDamping": (0.01, 0.02), "ccdSweptSphereRadius": (0.1, 0.2), "activationState": (1, 2),
    "contactProcessingThreshold": (0.1, 0.2), "jointDamping": (0.1, 0.2), "maxJointVelocity": (50.0, 60.0),
    "frictionAnchor": (0, 1), "collisionMargin": (0.01, 0.02), "jointLowerLimit": (-1.0, -0.9),
    "jointUpperLimit": (1.0, 1.1), "jointLimitForce": (10.0, 20.0), "sleepThreshold": (0.1, 0.2),
}  # fmt: skip
"""Two values of arguments of changeDynamics."""


def in_turn(call: Callable[[Any], Any], values: Iterable[Any]) -> Callable[[], Any]:
    """Return a call that is given one of the values after the other."""
    turns = itertools.cycle(values)
    return lambda: call(next(turns))


def dynamics(p: Any, robot: int, arm: int, cube: int) -> Calls:
    """Return name to call of changeDynamics, with one argument that changes."""
    p.changeDynamics(cube, -1, mass=0.1)
    rows: Calls = {}
    for name, values in _DYNAMICS.items():
        rows[f"changeDynamics of a link, {name}"] = in_turn(
            lambda value, name=name: p.changeDynamics(arm, 3, **{name: value}), values
        )
    rows["changeDynamics, both limits"] = in_turn(
        lambda low: p.changeDynamics(arm, 3, jointLowerLimit=low, jointUpperLimit=1), (-1, -1.1)
    )
    rows["changeDynamics, localInertiaDiagonal"] = in_turn(
        lambda size: p.changeDynamics(cube, -1, localInertiaDiagonal=[size] * 3), (0.1, 0.2)
    )
    rows["changeDynamics, anisotropicFriction"] = in_turn(
        lambda size: p.changeDynamics(cube, -1, anisotropicFriction=[size] * 3), (0.1, 0.2)
    )
    rows["changeDynamics, contactStiffness"] = in_turn(
        lambda size: p.changeDynamics(cube, -1, contactStiffness=size, contactDamping=10), (1000, 2000)
    )
    rows["changeDynamics, ten arguments"] = lambda: p.changeDynamics(
        cube, -1, mass=1, lateralFriction=0.5, spinningFriction=0.001, rollingFriction=0.001, restitution=0.1,
        linearDamping=0.04, angularDamping=0.04, contactStiffness=1e4, contactDamping=10,
    )  # fmt: skip
    return rows


def settings(p: Any, robot: int, arm: int, cube: int) -> Calls:
    """Return name to call of constraints and looks that change, and of old forms."""
    zero, axis = [0, 0, 0], [0, 1, 0]
    held = p.createConstraint(cube, -1, -1, -1, p.JOINT_FIXED, zero, zero, [1, 0, 1])
    gear = p.createConstraint(robot, 2, robot, 3, p.JOINT_GEAR, axis, zero, zero)
    p.changeConstraint(gear, gearRatio=-1, erp=0.1, maxForce=100)
    turns = [0, 0, 0, 1], [0, 0, 0.0998, 0.995]

    def stepped(change: Callable[[Any], Any]) -> Callable[[Any], Any]:
        def call(value: Any) -> None:
            change(value)
            p.stepSimulation()

        return call

    def change(number: int, name: str) -> Callable[[Any], Any]:
        return lambda value: p.changeConstraint(number, **{name: value})

    both = list(zip(([1, 0, 1], [1, 0, 1.1]), turns, strict=True))
    return {
        "changeConstraint, maxForce, step": in_turn(stepped(change(held, "maxForce")), (50, 60)),
        "changeConstraint, turned": in_turn(change(held, "jointChildFrameOrientation"), turns),
        "changeConstraint, moved and turned": in_turn(
            lambda pair: p.changeConstraint(held, pair[0], pair[1], maxForce=50), both
        ),
        "changeConstraint of a gear": lambda: p.changeConstraint(gear, gearRatio=-1, maxForce=100),
        "changeConstraint, gearRatio": in_turn(change(gear, "gearRatio"), (-1, -2)),
        "changeConstraint, relativePositionTarget": in_turn(change(gear, "relativePositionTarget"), (0, 0.1)),
        "changeConstraint, erp, step": in_turn(stepped(change(gear, "erp")), (0.1, 0.2)),
        "changeVisualShape, colour": in_turn(
            lambda red: p.changeVisualShape(cube, -1, rgbaColor=[red, 0, 0, 1]), (0, 1)
        ),
        "changeVisualShape, specularColor": in_turn(
            lambda red: p.changeVisualShape(cube, -1, specularColor=[red, 0, 0]), (0, 1)
        ),
        "changeVisualShape, no texture": lambda: p.changeVisualShape(cube, -1, textureUniqueId=-1),
        "resetVisualShapeData": lambda: p.resetVisualShapeData(cube, -1, rgbaColor=[1, 0, 0, 1]),
        "getJointStates of an array": lambda: p.getJointStates(arm, np.arange(7)),
        "setJointMotorControl": lambda: p.setJointMotorControl(arm, 2, p.POSITION_CONTROL, 0.1, 100),
        "setVRCameraState": lambda: p.setVRCameraState(zero, [0, 0, 0, 1]),
    }


def after_changes(p: Any, robot: int, arm: int, cube: int) -> Calls:
    """Return name to call of answers that are asked for after each change."""
    zero, state = [0, 0, 0], p.saveState()

    def held(read: Callable[[int], Any]) -> Callable[[], Any]:
        def call() -> None:
            made = p.createConstraint(cube, -1, -1, -1, p.JOINT_POINT2POINT, zero, zero, zero)
            read(made)
            p.removeConstraint(made)

        return call

    def changed(read: Callable[[], Any]) -> Callable[[], Any]:
        def call(friction: float) -> None:
            p.changeDynamics(cube, -1, lateralFriction=friction)
            read()

        return in_turn(call, (0.4, 0.5))

    def moved(read: Callable[[], Any]) -> Callable[[], Any]:
        def call(angle: float) -> None:
            p.resetJointState(arm, 2, angle)
            read()

        return in_turn(call, (0.0, 0.1))

    def add_and_read() -> None:
        made = p.addUserData(cube, "a", "b")
        p.getUserData(made)
        p.removeUserData(made)

    return {
        "createConstraint, getConstraintInfo, removed": held(p.getConstraintInfo),
        "createConstraint, getConstraintState, removed": held(p.getConstraintState),
        "createConstraint, getNumConstraints, removed": held(lambda _: p.getNumConstraints()),
        "createConstraint, getConstraintUniqueId, removed": held(lambda _: p.getConstraintUniqueId(0)),
        "createConstraint, moved, removed": held(lambda made: p.changeConstraint(made, zero, [0, 0, 0, 1])),
        "changeDynamics, getDynamicsInfo": changed(lambda: p.getDynamicsInfo(cube, -1)),
        "changeDynamics, getJointInfo": changed(lambda: p.getJointInfo(arm, 2)),
        "changeDynamics, getNumJoints": changed(lambda: p.getNumJoints(arm)),
        "changeDynamics, getVisualShapeData": changed(lambda: p.getVisualShapeData(arm)),
        "changeDynamics, getCollisionShapeData": changed(lambda: p.getCollisionShapeData(arm, 3)),
        "addUserData, getUserData, removed": add_and_read,
        "resetJointState, getAABB": moved(lambda: p.getAABB(arm, 3)),
        "resetJointState, rayTest": moved(lambda: p.rayTest([0, 0, 5], [0, 0, -5])),
        "resetJointState, getOverlappingObjects": moved(
            lambda: p.getOverlappingObjects([0, -1, 0], [3, 1, 2])
        ),
        "resetJointState, getClosestPoints": moved(lambda: p.getClosestPoints(arm, cube, 2.0)),
        "resetJointState, calculateInverseKinematics": moved(
            lambda: p.calculateInverseKinematics(arm, 6, [1.6, 0.2, 0.6])
        ),
        "resetJointState, restoreState": moved(lambda: p.restoreState(state)),
    }


def shapes(p: Any, robot: int, arm: int, cube: int) -> Calls:
    """Return name to call of what creates shapes and textures."""
    corners, triangles = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], [0, 1, 2, 0, 1, 3, 0, 2, 3, 1, 2, 3]
    many = [[0.01 * (k * 7 % 100), 0.02 * k, 0.001 * k] for k in range(1000)]
    faces, heights = [k * 37 % 1000 for k in range(3000)], [0.05 * (k * 7 % 5) for k in range(256)]
    texture = p.loadTexture("checker_blue.png")
    pixels = [k % 255 for k in range(64 * 64 * 3)]
    field: dict[str, Any] = {"meshScale": [0.1, 0.1, 1], "heightfieldData": heights}
    field |= {"numHeightfieldRows": 16, "numHeightfieldColumns": 16}
    ground = p.createCollisionShape(p.GEOM_HEIGHTFIELD, **field)

    def collision(kind: int, **given: Any) -> Callable[[], Any]:
        return lambda: p.removeCollisionShape(p.createCollisionShape(kind, **given))

    def visual(kind: int, **given: Any) -> Callable[[], Any]:
        return lambda: p.removeCollisionShape(p.createVisualShape(kind, **given))

    two = {"shapeTypes": [p.GEOM_BOX, p.GEOM_SPHERE], "halfExtents": [[0.1] * 3] * 2, "radii": [0.1] * 2}
    return {
        "createCollisionShape of a sphere, removed": collision(p.GEOM_SPHERE, radius=0.1),
        "createCollisionShape of a capsule, removed": collision(p.GEOM_CAPSULE, radius=0.1, height=0.2),
        "createCollisionShape of 4 points, removed": collision(p.GEOM_MESH, vertices=corners),
        "createCollisionShape of 4 triangles, removed": collision(
            p.GEOM_MESH, vertices=corners, indices=triangles
        ),
        "createCollisionShape of 1000 triangles, removed": collision(
            p.GEOM_MESH, vertices=many, indices=faces
        ),
        "createCollisionShape of 256 heights, removed": collision(p.GEOM_HEIGHTFIELD, **field),
        "createCollisionShapeArray, removed": lambda: p.removeCollisionShape(
            p.createCollisionShapeArray(**two, collisionFramePositions=[[0, 0, 0], [0, 0, 0.2]])
        ),
        "createVisualShape of a box, removed": visual(p.GEOM_BOX, halfExtents=[0.1] * 3),
        "createVisualShape of 4 triangles, removed": visual(p.GEOM_MESH, vertices=corners, indices=triangles),
        "createVisualShape of 1000 triangles, removed": visual(p.GEOM_MESH, vertices=many, indices=faces),
        "createVisualShapeArray, removed": lambda: p.removeCollisionShape(
            p.createVisualShapeArray(**two, rgbaColors=[[1, 0, 0, 1]] * 2)
        ),
        "createMultiBody of 256 heights, removed": lambda: p.removeBody(p.createMultiBody(0, ground)),
        "loadTexture": lambda: p.loadTexture("checker_blue.png"),
        "changeTexture, list": lambda: p.changeTexture(texture, pixels, 64, 64),
        "changeTexture, bytes": lambda: p.changeTexture(texture, bytes(pixels), 64, 64),
        "changeVisualShape, textureUniqueId": lambda: p.changeVisualShape(cube, -1, textureUniqueId=texture),
    }


def files(p: Any, robot: int, arm: int, cube: int) -> Calls:
    """Return name to call of what reads or writes files."""
    folder = tempfile.mkdtemp()
    p.saveBullet(f"{folder}/kept.bullet")

    def logged(kind: int) -> Callable[[], Any]:
        return lambda: p.stopStateLogging(p.startStateLogging(kind, f"{folder}/log"))

    return {
        "saveWorld": lambda: p.saveWorld(f"{folder}/world.py"),
        "saveBullet": lambda: p.saveBullet(f"{folder}/state.bullet"),
        "restoreState of a file": lambda: p.restoreState(fileName=f"{folder}/kept.bullet"),
        "startStateLogging of robots, stopped": logged(p.STATE_LOGGING_GENERIC_ROBOT),
        "startStateLogging of contacts, stopped": logged(p.STATE_LOGGING_CONTACT_POINTS),
        "loadURDF of an arm, removed": lambda: p.removeBody(p.loadURDF("kuka_iiwa/model.urdf")),
        "loadSDF, removed": lambda: [p.removeBody(body) for body in p.loadSDF("stadium.sdf")],
        "loadMJCF, removed": lambda: [p.removeBody(body) for body in p.loadMJCF("mjcf/ant.xml")],
        "connect, disconnect": lambda: p.disconnect(p.connect(p.DIRECT)),
    }


TABLES = (dynamics, settings, after_changes, shapes, files)
