"""Joints with frames, limits, drives and what they mimic."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from roboyard.description.model import Joint
from roboyard.export.usd.geometry import frame_to
from roboyard.export.usd.library import Sdf, UsdPhysics
from roboyard.export.usd.naming import Paths, keep_name
from roboyard.export.usd.values import apply_by_name, quatf, set_attribute, vec3f
from roboyard.transforms import multiply

if TYPE_CHECKING:
    from roboyard.description.robot_model import DriveKind, RobotModel

POSITION_GAINS = (1e7, 1e5)
"""Stiffness and damping of a position drive: what OmniGibson sets when it takes a joint over."""
VELOCITY_GAINS = (0.0, 1e7)
"""Of a velocity drive, likewise."""
INFINITE = 1e6
"""rad, m, and their like: a limit beyond this is none."""
LOCKED = (1.0, -1.0)
"""Lower above upper: how UsdPhysics says that an axis is locked."""


def add_joints(stage: Any, robot: RobotModel, paths: Paths, notes: list[str]) -> None:
    """Define every joint under its parent link."""
    for joint in robot.description.joints:
        if joint.type == "floating":
            notes.append(f'joint "{joint.name}": floating; its child is a free body without a joint')
            continue
        prim = _define(stage, joint, paths.joint(joint.parent, joint.name))
        keep_name(prim, joint.name, robot)
        _connect(prim, joint, paths)
        if joint.type in ("revolute", "continuous", "prismatic"):
            _limit(prim, joint)
            _drive(prim, joint, robot.drives.get(joint.name, "none"))
            if joint.mimic is not None:
                _mimic(prim, joint, robot, paths, notes)
        if joint.damping:
            prim.SetCustomDataByKey("urdf_damping", joint.damping)
        for key in ("effort", "velocity"):  # drives state them only where there is one
            value = getattr(joint.limit, key, None)
            if value is not None:
                prim.SetCustomDataByKey(f"urdf_{key}", value)


def _define(stage: Any, joint: Joint, path: str) -> Any:
    kinds = {
        "revolute": UsdPhysics.RevoluteJoint,
        "continuous": UsdPhysics.RevoluteJoint,
        "prismatic": UsdPhysics.PrismaticJoint,
        "fixed": UsdPhysics.FixedJoint,
        "spherical": UsdPhysics.SphericalJoint,
        "planar": UsdPhysics.Joint,
    }
    return kinds[joint.type].Define(stage, path).GetPrim()


def _connect(prim: Any, joint: Joint, paths: Paths) -> None:
    """Bodies and frames. The frame of both is the child link's, turned so that an axis token fits."""
    base = UsdPhysics.Joint(prim)
    base.CreateBody0Rel().SetTargets([Sdf.Path(paths.link(joint.parent))])
    base.CreateBody1Rel().SetTargets([Sdf.Path(paths.link(joint.child))])
    turn = np.array([0.0, 0.0, 0.0, 1.0])
    if joint.type in ("revolute", "continuous", "prismatic"):
        token, turn = frame_to(joint.axis)
        UsdPhysics.RevoluteJoint(prim).CreateAxisAttr(token)
    elif joint.type == "planar":
        _, turn = _frame_with_normal(joint.axis)
        for axis in ("transZ", "rotX", "rotY"):
            lock = UsdPhysics.LimitAPI.Apply(prim, axis)
            lock.CreateLowAttr(LOCKED[0])
            lock.CreateHighAttr(LOCKED[1])
    base.CreateLocalPos0Attr(vec3f(joint.origin.position))
    base.CreateLocalRot0Attr(quatf(multiply(joint.origin.quaternion, turn)))
    base.CreateLocalPos1Attr(vec3f((0, 0, 0)))
    base.CreateLocalRot1Attr(quatf(turn))
    base.CreateJointEnabledAttr(True)
    base.CreateExcludeFromArticulationAttr(False)


def _frame_with_normal(normal: tuple[float, float, float]) -> tuple[str, np.ndarray]:
    """A frame whose z axis is the normal of the plane, its x and y the axes that joint values count along."""
    from roboyard.kinematics.joint_models import plane_axes
    from roboyard.transforms import quaternion_from_matrix

    first, second = plane_axes(normal)
    return "Z", quaternion_from_matrix(np.column_stack([first, second, normal]))


def _is_angular(joint: Joint) -> bool:
    return joint.type != "prismatic"


def _in_stage_units(joint: Joint, value: float) -> float:
    """Degrees for revolute joints, metres for prismatic ones."""
    return math.degrees(value) if _is_angular(joint) else value


def _limit(prim: Any, joint: Joint) -> None:
    range_ = joint.position_limits()
    if range_ is not None and max(map(abs, range_)) < INFINITE:
        api = UsdPhysics.RevoluteJoint(prim) if _is_angular(joint) else UsdPhysics.PrismaticJoint(prim)
        api.CreateLowerLimitAttr(_in_stage_units(joint, range_[0]))
        api.CreateUpperLimitAttr(_in_stage_units(joint, range_[1]))
    apply_by_name(prim, "PhysxJointAPI")
    velocity = joint.limit.velocity if joint.limit is not None else None
    if velocity is not None and 0 < velocity < INFINITE:
        value = _in_stage_units(joint, velocity)
        set_attribute(prim, "physxJoint:maxJointVelocity", Sdf.ValueTypeNames.Float, value)
    if joint.friction > 0:
        set_attribute(prim, "physxJoint:jointFriction", Sdf.ValueTypeNames.Float, joint.friction)


def _drive(prim: Any, joint: Joint, kind: DriveKind) -> None:
    instance = "angular" if _is_angular(joint) else "linear"
    apply_by_name(prim, f"PhysicsJointStateAPI:{instance}")
    for name in ("position", "velocity"):
        set_attribute(prim, f"state:{instance}:physics:{name}", Sdf.ValueTypeNames.Float, 0.0)
    if kind == "none" or joint.mimic is not None:
        return
    stiffness, damping = {"effort": (0.0, 0.0), "velocity": VELOCITY_GAINS, "position": POSITION_GAINS}[kind]
    drive = UsdPhysics.DriveAPI.Apply(prim, instance)
    drive.CreateTypeAttr(UsdPhysics.Tokens.force)
    drive.CreateStiffnessAttr(stiffness)
    drive.CreateDampingAttr(damping)
    drive.CreateTargetPositionAttr(0.0)
    drive.CreateTargetVelocityAttr(0.0)
    effort = joint.limit.effort if joint.limit is not None else None
    if effort is not None and 0 < effort < 1e10:
        drive.CreateMaxForceAttr(effort)


def _mimic(prim: Any, joint: Joint, robot: RobotModel, paths: Paths, notes: list[str]) -> None:
    """Both engines' words for position = multiplier * leader + offset."""
    mimic = joint.mimic
    assert mimic is not None
    leader = robot.description.joint_by_name.get(mimic.joint)
    prim.SetCustomDataByKey("urdf_mimic:joint", mimic.joint)
    prim.SetCustomDataByKey("urdf_mimic:multiplier", mimic.multiplier)
    prim.SetCustomDataByKey("urdf_mimic:offset", mimic.offset)
    if leader is None or leader is joint or leader.type not in ("revolute", "continuous", "prismatic"):
        notes.append(f'joint "{joint.name}": mimics "{mimic.joint}", which does not move; left free')
        return
    target = [Sdf.Path(paths.joint(leader.parent, leader.name))]
    apply_by_name(prim, "NewtonMimicAPI")
    prim.CreateRelationship("newton:mimicJoint", custom=False).SetTargets(target)
    offset = _in_stage_units(joint, mimic.offset)
    set_attribute(prim, "newton:mimicCoef0", Sdf.ValueTypeNames.Float, offset)
    # the gear ratio of PhysX is between stage units, degrees and metres
    ratio = _in_stage_units(joint, 1.0) / _in_stage_units(leader, 1.0)
    set_attribute(prim, "newton:mimicCoef1", Sdf.ValueTypeNames.Float, mimic.multiplier)
    axis = "rot" + UsdPhysics.RevoluteJoint(prim).GetAxisAttr().Get()
    leads = "rot" + frame_to(leader.axis)[0]
    apply_by_name(prim, f"PhysxMimicJointAPI:{axis}")
    name = f"physxMimicJoint:{axis}"
    prim.CreateRelationship(f"{name}:referenceJoint", custom=False).SetTargets(target)
    set_attribute(prim, f"{name}:referenceJointAxis", Sdf.ValueTypeNames.Token, leads, uniform=True)
    set_attribute(prim, f"{name}:gearing", Sdf.ValueTypeNames.Float, -mimic.multiplier * ratio)
    set_attribute(prim, f"{name}:offset", Sdf.ValueTypeNames.Float, -offset)
