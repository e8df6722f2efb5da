"""Names of the commands by the module that defines them, so that a module is imported on first use."""

from __future__ import annotations

from collections.abc import Mapping

TOPICS: Mapping[str, tuple[str, ...]] = {
    "articulated": ("calculateJacobian", "calculateMassMatrix", "calculateInverseDynamics"),
    "bodies": (
        "getNumBodies",
        "getBodyUniqueId",
        "getBodyInfo",
        "syncBodyInfo",
        "removeBody",
        "resetSimulation",
        "getBasePositionAndOrientation",
        "resetBasePositionAndOrientation",
        "getBaseVelocity",
        "resetBaseVelocity",
    ),
    "camera": ("getCameraImage",),
    "shapes.collision_shapes": ("createCollisionShape", "createCollisionShapeArray", "removeCollisionShape"),
    "constraints": (
        "createConstraint",
        "changeConstraint",
        "removeConstraint",
        "getNumConstraints",
        "getConstraintUniqueId",
        "getConstraintInfo",
        "getConstraintState",
    ),
    "contact_points": ("getContactPoints", "getClosestPoints"),
    "joints": (
        "getNumJoints",
        "computeDofCount",
        "getJointInfo",
        "getJointState",
        "getJointStates",
        "getJointStateMultiDof",
        "getJointStatesMultiDof",
        "resetJointState",
        "resetJointStateMultiDof",
        "resetJointStatesMultiDof",
        "enableJointForceTorqueSensor",
    ),
    "control": (
        "setJointMotorControl2",
        "setJointMotorControlArray",
        "setJointMotorControlMultiDof",
        "setJointMotorControlMultiDofArray",
    ),
    "debug": (
        "addUserDebugLine",
        "addUserDebugText",
        "addUserDebugPoints",
        "addUserDebugParameter",
        "readUserDebugParameter",
        "removeUserDebugItem",
        "removeAllUserDebugItems",
        "removeAllUserParameters",
    ),
    "dynamics": ("getDynamicsInfo", "changeDynamics"),
    "filters": ("setCollisionFilterPair", "setCollisionFilterGroupMask"),
    "forces": ("applyExternalForce", "applyExternalTorque"),
    "inverse_kinematics": ("calculateInverseKinematics", "calculateInverseKinematics2"),
    "links": ("getLinkState", "getLinkStates"),
    "user_data": (
        "addUserData",
        "getUserData",
        "getUserDataId",
        "getNumUserData",
        "getUserDataInfo",
        "removeUserData",
        "syncUserData",
    ),
    "loading": ("setAdditionalSearchPath", "loadURDF", "loadSDF", "loadMJCF"),
    "logs": ("startStateLogging", "stopStateLogging", "submitProfileTiming"),
    "shapes.meshes": ("getMeshData", "vhacd", "unsupportedChangeScaling"),
    "shapes.multibody": ("createMultiBody",),
    "parameters": (
        "setGravity",
        "setTimeStep",
        "setRealTimeSimulation",
        "setDefaultContactERP",
        "setInternalSimFlags",
        "setPhysicsEngineParameter",
        "getPhysicsEngineParameters",
        "setTimeOut",
    ),
    "raycasts": ("rayTest", "rayTestBatch", "getAABB", "getOverlappingObjects"),
    "saved_files": ("saveBullet", "saveWorld", "loadBullet"),
    "stepping": ("stepSimulation", "performCollisionDetection", "saveState", "removeState", "restoreState"),
    "shapes.textures": ("loadTexture", "changeTexture"),
    "plugins": ("loadPlugin", "unloadPlugin", "executePluginCommand"),
    "soft_bodies": ("loadSoftBody", "createSoftBodyAnchor", "getTetraMeshData", "resetMeshData"),
    "shapes.visual_shapes": (
        "createVisualShape",
        "createVisualShapeArray",
        "getVisualShapeData",
        "getCollisionShapeData",
        "changeVisualShape",
        "resetVisualShapeData",
        "setDebugObjectColor",
    ),
    "virtual_reality": ("getVREvents", "setVRCameraState"),
    "visualizer": (
        "getDebugVisualizerCamera",
        "resetDebugVisualizerCamera",
        "configureDebugVisualizer",
        "getKeyboardEvents",
        "getMouseEvents",
    ),
}
"""Module of `roboyard.pybullet.api` to its commands."""

HOMES: Mapping[str, str] = {
    name: f"roboyard.pybullet.api.{topic}" for topic, names in TOPICS.items() for name in names
}
"""Command to the full name of its module."""

KINDS = 5
BODIES, LOOKS, CONSTRAINTS, DATA, CONTACTS = range(KINDS)
"""Kinds of answers that are kept."""
KEPT_ANSWERS: Mapping[str, int] = {
    "computeDofCount": BODIES,
    "getBodyInfo": BODIES,
    "getBodyUniqueId": BODIES,
    "getCollisionShapeData": BODIES,
    "getConstraintUniqueId": CONSTRAINTS,
    "getJointInfo": BODIES,
    "getNumBodies": BODIES,
    "getNumConstraints": CONSTRAINTS,
    "getNumJoints": BODIES,
    "getNumUserData": DATA,
    "getUserData": DATA,
    "getUserDataId": DATA,
    "getUserDataInfo": DATA,
    "getVisualShapeData": LOOKS,
    "performCollisionDetection": CONTACTS,
}
"""Commands whose answers stay the same until one is called that changes such answers (`changed_answers`).

That of a detection is that it has found the contacts."""
KEPT_FAILURES: Mapping[str, int] = {
    "getAABB": BODIES,
    "getBasePositionAndOrientation": BODIES,
    "getBaseVelocity": BODIES,
    "getBodyInfo": BODIES,
    "getConstraintInfo": CONSTRAINTS,
    "getDynamicsInfo": BODIES,
    "getJointInfo": BODIES,
    "getJointState": BODIES,
    "getJointStateMultiDof": BODIES,
    "getLinkState": BODIES,
}
"""Commands whose errors say what does not exist: they stay the same until such answers may be others."""
_ALL = BODIES, LOOKS, CONSTRAINTS, DATA
_CHANGED: Mapping[str, tuple[int, ...]] = {
    "addUserData": (DATA,),
    "changeTexture": (LOOKS,),
    "changeVisualShape": (LOOKS,),
    "createConstraint": (CONSTRAINTS,),
    "loadTexture": (LOOKS,),
    "removeConstraint": (CONSTRAINTS,),
    "removeUserData": (DATA,),
    "resetVisualShapeData": (LOOKS,),
    "setDebugObjectColor": (LOOKS,),
}
"""Commands that change answers of some kinds only."""

_READING = ("get", "calculate", "compute", "rayTest", "sync")
_HARMLESS = frozenset(
    (
        *("applyExternalForce", "applyExternalTorque", "setJointMotorControl2", "setJointMotorControlArray"),
        *("setJointMotorControlMultiDof", "setJointMotorControlMultiDofArray", "addUserDebugLine"),
        *("addUserDebugText", "addUserDebugPoints", "addUserDebugParameter"),
        *("resetBasePositionAndOrientation", "resetBaseVelocity", "resetJointState", "stepSimulation"),
        *("resetJointStateMultiDof", "resetJointStatesMultiDof", "enableJointForceTorqueSensor"),
        *("readUserDebugParameter", "removeUserDebugItem", "removeAllUserDebugItems"),
        *("setGravity", "setTimeStep", "setRealTimeSimulation", "setTimeOut", "setPhysicsEngineParameter"),
        *("setDefaultContactERP", "setAdditionalSearchPath", "submitProfileTiming"),
        *("setCollisionFilterPair", "setCollisionFilterGroupMask", "performCollisionDetection"),
        *("configureDebugVisualizer", "resetDebugVisualizerCamera", "saveState", "removeState"),
        *("changeConstraint", "changeDynamics"),
    )
)


_UNMOVING = frozenset(
    (
        *("addUserDebugLine", "addUserDebugText", "addUserDebugPoints", "addUserDebugParameter"),
        *("readUserDebugParameter", "removeUserDebugItem", "removeAllUserDebugItems"),
        *("setTimeOut", "setAdditionalSearchPath", "submitProfileTiming", "setDebugObjectColor"),
        *("configureDebugVisualizer", "resetDebugVisualizerCamera"),
    )
)


def changed_answers(name: str) -> tuple[int, ...]:
    """Return which kinds of answers of `KEPT_ANSWERS` may be others after a command."""
    if name in KEPT_ANSWERS or name.startswith(_READING):
        return ()
    kinds = () if name in _HARMLESS else _CHANGED.get(name, _ALL)
    return kinds if name in _UNMOVING else (*kinds, CONTACTS)
