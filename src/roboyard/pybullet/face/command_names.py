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

KEPT_ANSWERS = frozenset(
    (
        "computeDofCount",
        "getBodyInfo",
        "getBodyUniqueId",
        "getCollisionShapeData",
        "getConstraintInfo",
        "getConstraintUniqueId",
        "getDynamicsInfo",
        "getJointInfo",
        "getNumBodies",
        "getNumConstraints",
        "getNumJoints",
        "getNumUserData",
        "getUserData",
        "getUserDataId",
        "getUserDataInfo",
        "getVisualShapeData",
    )
)
"""Commands whose answers stay the same until one of `changes_kept_answers` is called."""

DETECTION = "performCollisionDetection"
"""The command that finds the same contacts again until one of `changes_contacts` is called."""

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
    )
)


def changes_kept_answers(name: str) -> bool:
    """Return whether a command may change what a command of `KEPT_ANSWERS` returns."""
    return name not in _HARMLESS and not name.startswith(_READING)


_UNMOVING = frozenset(
    (
        *("addUserDebugLine", "addUserDebugText", "addUserDebugPoints", "addUserDebugParameter"),
        *("readUserDebugParameter", "removeUserDebugItem", "removeAllUserDebugItems"),
        *("setTimeOut", "setAdditionalSearchPath", "submitProfileTiming", "setDebugObjectColor"),
        *("configureDebugVisualizer", "resetDebugVisualizerCamera"),
    )
)


def changes_contacts(name: str) -> bool:
    """Return whether contacts may be others after a command than those that a detection before it found."""
    return name != DETECTION and name not in _UNMOVING and not name.startswith(_READING)
