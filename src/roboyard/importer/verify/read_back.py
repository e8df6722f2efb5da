"""Read the written files of a package and compare them with the robot."""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from roboyard.description.model import RobotDescription
from roboyard.description.robot_model import RobotModel
from roboyard.description.urdf.parse import UrdfElements
from roboyard.importer.context import ImportContext
from roboyard.kinematics.description_poses import forward_kinematics
from roboyard.transforms import Array
from roboyard.untrusted.yaml_reading import read_yaml

POSITION, ROTATION = 1e-5, 1e-4
"""Largest error of a link's position (m) and of the entries of its rotation matrix."""
MASS = 1e-6
"""Largest relative error of a mass."""


def check_files(robot: RobotModel, context: ImportContext, written: UrdfElements) -> None:
    """Check each written file; differences are logged as warnings, no error is raised."""
    build, name = context.build, robot.name
    checks: tuple[tuple[str, Callable[[], list[str]]], ...] = (
        ("urdf", lambda: check_urdf(robot, written)),
        ("mjcf", lambda: check_mjcf(robot, build / "mjcf" / f"{name}.xml")),
        ("usd", lambda: check_usd(robot, build / "usd" / f"{name}.usda")),
        ("curobo", lambda: check_curobo(robot, build / "curobo" / f"{name}_description_curobo_default.yaml")),
    )
    results: dict[str, Any] = {}
    for index, (kind, check) in enumerate(checks):
        context.log.report_progress(index / len(checks), kind)
        try:
            problems = check()
        except Exception as error:  # a check that cannot run is reported like a difference
            problems = [f"{type(error).__name__}: {' '.join(str(error).split())[:300]}"]
        results[kind] = problems
        for problem in problems:
            context.log.warn(f"{kind}: {problem}")
        if not problems:
            context.log.note(f"{kind}: read back and equal")
    context.log.facts["read_back"] = results


def check_urdf(robot: RobotModel, written: Path | UrdfElements) -> list[str]:
    """Compare links, joints, masses and poses of the written URDF; returns the differences."""
    from roboyard.description import load_description

    found = load_description(written)
    problems = _names("link", robot.description.link_by_name, found.link_by_name)
    problems += _names("joint", robot.description.joint_by_name, found.joint_by_name)
    for link in robot.description.links:
        other = found.link_by_name.get(link.name)
        if other is None or link.inertial is None:
            continue
        mass = other.inertial.mass if other.inertial is not None else 0.0
        if abs(mass - link.inertial.mass) > MASS * max(link.inertial.mass, 1e-9):
            problems.append(
                f"link {link.name!r} has a mass of {mass:g} kg, expected {link.inertial.mass:g} kg"
            )
    return problems + _poses(robot.description, forward_kinematics(found))


def check_mjcf(robot: RobotModel, file: Path) -> list[str]:
    """Compile the MJCF with MuJoCo and compare the poses of its bodies; returns the differences."""
    from roboyard._mujoco import mujoco

    model = mujoco.MjModel.from_xml_path(str(file))
    data = mujoco.MjData(model)
    for row in range(model.njnt):
        if model.jnt_type[row] in (mujoco.mjtJoint.mjJNT_HINGE, mujoco.mjtJoint.mjJNT_SLIDE):
            data.qpos[model.jnt_qposadr[row]] = 0.0
    mujoco.mj_kinematics(model, data)
    rows = {mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_BODY, i): i for i in range(1, model.nbody)}
    root = robot.description.root.name
    if root not in rows:
        return [] if root == "world" else [f"there is no body {root!r}"]
    frames: dict[str, Array] = {}
    for name, row in rows.items():
        frames[name] = np.eye(4)
        frames[name][:3, :3] = data.xmat[row].reshape(3, 3)
        frames[name][:3, 3] = data.xpos[row]
    to_root = np.linalg.inv(frames[root])
    problems = _names("body", robot.description.link_by_name, rows)
    return problems + _poses(robot.description, {name: to_root @ frame for name, frame in frames.items()})


def check_usd(robot: RobotModel, file: Path) -> list[str]:
    """Open the USD stage and count its rigid bodies and joints; returns the differences."""
    try:
        usd: Any = import_module("pxr.Usd")
        physics: Any = import_module("pxr.UsdPhysics")
    except ImportError:
        return ["not checked: usd-core is not installed"]
    stage = usd.Stage.Open(str(file))
    prims = list(stage.Traverse())
    bodies = sum(prim.HasAPI(physics.RigidBodyAPI) for prim in prims)
    joints = sum(prim.IsA(physics.Joint) for prim in prims)
    problems = []
    wanted_joints = sum(joint.type != "floating" for joint in robot.description.joints)
    if bodies != len(robot.description.links):
        problems.append(f"{bodies} rigid bodies for {len(robot.description.links)} links")
    if joints < wanted_joints:
        problems.append(f"{joints} joints for {wanted_joints}")
    if not stage.GetDefaultPrim():
        problems.append("there is no default prim")
    return problems


def check_curobo(robot: RobotModel, file: Path) -> list[str]:
    """Check that each name in the planner file is a link or joint, or is defined by it; returns the
    others.
    """
    data = read_yaml(file, 64 << 20)["robot_cfg"]
    fields = data.get("kinematics", data)
    made = set(fields.get("extra_links") or ())
    links = set(robot.description.link_by_name) | made
    joints = set(robot.description.joint_by_name)
    cspace = fields["cspace"]
    names = cspace["joint_names"] if isinstance(cspace, dict) else cspace
    problems = [f"no joint {name!r}" for name in (*names, *fields["lock_joints"]) if name not in joints]
    for key in ("collision_link_names", "collision_spheres", "self_collision_ignore", "link_names"):
        problems += [f"{key}: no link {name!r}" for name in fields.get(key) or () if name not in links]
    return problems


def _names(kind: str, wanted: object, found: object) -> list[str]:
    missing = [name for name in wanted if name not in found]  # type: ignore[operator, attr-defined]
    return [f"{kind} {name!r} is missing" for name in missing]


def _poses(description: RobotDescription, found: dict[str, Array]) -> list[str]:
    problems = []
    for name, wanted in forward_kinematics(description).items():
        if name not in found:
            continue
        off = np.abs(found[name] - wanted)
        if off[:3, 3].max() > POSITION or off[:3, :3].max() > ROTATION:
            problems.append(f"link {name!r} is {np.linalg.norm(off[:3, 3]):.3g} m off its pose")
    return problems
