"""Joints of a description as MuJoCo joints, with their limits, drives and mimic equalities."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from roboyard.description.model import Joint, RobotDescription
from roboyard.kinematics.joint_models import plane_axes
from roboyard.sim.build.records import BuildOptions, Built, BuiltLink
from roboyard.sim.build.solver_options import CONTACT_SOLREF, LIMIT_SOLIMP

if TYPE_CHECKING:
    from roboyard._mujoco import mujoco

LIMIT_INFINITE = 1e6
"""Range (rad or m) from which a joint has no limit."""
LOCKED_HALF_RANGE = 1e-9
"""Half range (rad or m) of a joint whose lower limit equals its upper one."""
AT_LIMIT = 1e-12
"""Distance (rad or m) from a rigid limit at which it holds a joint, so that one that starts there stays."""
PID_ALL_INPUTS = 7
RIGID = (0.9999, 0.9999, 0.001, 0.5, 2.0)
NO_EFFORT_LIMIT = 1e9
"""Force range (N m or N) where the file gives no effort, or zero effort (a common export error)."""


def add_joint(
    record: BuiltLink, spec: mujoco.MjSpec, prefix: str, options: BuildOptions, built: Built
) -> None:
    """Add a link's joint to its body: the MuJoCo joints, limits and the drive."""
    from roboyard._mujoco import mujoco

    joint, body = record.joint, record.element
    assert joint is not None
    kinds = mujoco.mjtJoint
    name = f"{prefix}{joint.name}"
    common: dict[str, Any] = {}
    if options.joint_damping and joint.damping > 0:
        common["damping"] = [joint.damping, 0, 0]
    if options.joint_friction and joint.friction > 0:
        common["frictionloss"] = joint.friction
    if joint.type == "fixed":
        return
    if joint.type in ("revolute", "continuous", "prismatic"):
        kind = kinds.mjJNT_SLIDE if joint.type == "prismatic" else kinds.mjJNT_HINGE
        element = body.add_joint(name=name, type=kind, axis=joint.axis, **common)
        _set_limits(element, joint, options.scale)
        element.solref_limit = (1e-3, 1.0) if options.hard else CONTACT_SOLREF
        element.solimp_limit = RIGID if options.hard else LIMIT_SOLIMP
        if options.hard:
            is_locked = np.ptp(element.range) < 3 * LOCKED_HALF_RANGE
            element.margin = 2 * LOCKED_HALF_RANGE if is_locked else AT_LIMIT
        record.joint_elements = (element,)
        built.dofs += 1
        if options.drives and joint.mimic is None:
            record.actuator = _add_drive(spec, name, joint)
        return
    if joint.type == "spherical":
        record.joint_elements = (body.add_joint(name=name, type=kinds.mjJNT_BALL, **common),)
        built.dofs += 3
        return
    if joint.type == "planar":
        first, second = plane_axes(joint.axis)
        record.joint_elements = (
            body.add_joint(name=f"{name}/x", type=kinds.mjJNT_SLIDE, axis=first, **common),
            body.add_joint(name=f"{name}/y", type=kinds.mjJNT_SLIDE, axis=second, **common),
            body.add_joint(name=f"{name}/r", type=kinds.mjJNT_HINGE, axis=joint.axis, **common),
        )
        built.dofs += 3
        return
    slides = tuple(
        body.add_joint(name=f"{name}/{letter}", type=kinds.mjJNT_SLIDE, axis=axis, **common)
        for letter, axis in zip("xyz", np.eye(3), strict=True)
    )
    record.joint_elements = (*slides, body.add_joint(name=f"{name}/r", type=kinds.mjJNT_BALL, **common))
    built.dofs += 6


def _set_limits(element: Any, joint: Joint, scale: float) -> None:
    from roboyard._mujoco import mujoco

    limits = joint.position_limits()
    element.limited = mujoco.mjtLimited.mjLIMITED_FALSE
    if limits is None:
        return
    lower, upper = limits
    if joint.type == "prismatic":
        lower, upper = lower * scale, upper * scale
    if max(abs(lower), abs(upper)) > LIMIT_INFINITE:
        return
    element.limited = mujoco.mjtLimited.mjLIMITED_TRUE
    element.range = accepted_range(lower, upper)


def accepted_range(lower: float, upper: float) -> list[float]:
    """Return limits (rad or m) that MuJoCo accepts: those of a locked joint are not equal."""
    if upper - lower < 2 * LOCKED_HALF_RANGE:
        return [lower - LOCKED_HALF_RANGE, upper + LOCKED_HALF_RANGE]
    return [lower, upper]


def _add_drive(spec: mujoco.MjSpec, joint_name: str, joint: Joint) -> Any:
    """Add a PID actuator with position, velocity and feedforward inputs and zero gains."""
    from roboyard._mujoco import mujoco

    actuator = spec.add_actuator(name=joint_name, target=joint_name, trntype=mujoco.mjtTrn.mjTRN_JOINT)
    actuator.set_to_pid(kp=0.0, kv=0.0, ctrlspec=PID_ALL_INPUTS)
    effort = joint.limit.effort if joint.limit is not None else None
    actuator.forcelimited = mujoco.mjtLimited.mjLIMITED_TRUE
    bound = effort if effort is not None and 0 < effort < NO_EFFORT_LIMIT else NO_EFFORT_LIMIT
    actuator.forcerange = [-bound, bound]
    return actuator


def add_mimics(built: Built, spec: mujoco.MjSpec, description: RobotDescription, prefix: str) -> None:
    """Add an equality for each joint that mimics another; a mimic without a moving source stays free."""
    from roboyard._mujoco import mujoco

    scalar = {record.joint.name for record in built.links if record.joint and len(record.joint_elements) == 1}
    for record in built.links:
        joint = record.joint
        if joint is None or joint.mimic is None or len(record.joint_elements) != 1:
            continue
        mimic = joint.mimic
        if mimic.joint not in scalar or mimic.joint == joint.name:
            built.notes.append(
                f'joint "{joint.name}": mimics "{mimic.joint}", which does not move; left free'
            )
            continue
        equality = spec.add_equality(
            name=f"{prefix}{joint.name}/mimic",
            type=mujoco.mjtEq.mjEQ_JOINT,
            name1=f"{prefix}{joint.name}",
            name2=f"{prefix}{mimic.joint}",
            objtype=mujoco.mjtObj.mjOBJ_JOINT,
        )
        data = np.zeros(len(equality.data))
        data[:2] = mimic.offset, mimic.multiplier
        equality.data = data
        equality.solref = [0.005, 1.0]
        equality.solimp = [0.99, 0.999, 0.001, 0.5, 2.0]
        built.equalities.append(equality)
