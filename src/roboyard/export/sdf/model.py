"""The SDF document: the model, its links, frames, sensors and joints."""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from roboyard.description.mass_properties import MassProperties, link_masses, trace_mass
from roboyard.description.model import Link, Pose, RobotDescription
from roboyard.export.export_result import ExportResult
from roboyard.export.mjcf.document import CAMERA_FOVY
from roboyard.export.names import free_name
from roboyard.export.sdf.joints import add_joint, add_loop, add_plugins, planar_steps
from roboyard.export.sdf.shapes import Files, add_shapes
from roboyard.export.sdf.xml import add, add_placed, add_pose
from roboyard.morphology.upright import standing_orientation
from roboyard.transforms import matrix_from_quaternion

if TYPE_CHECKING:
    from roboyard.description.robot_model import RobotModel, Sensor

WORLD = "world"
"""SDF's name of what does not move; no link may be called so."""
CAMERA_AXES = np.array([[0.0, -1.0, 0.0], [0.0, 0.0, 1.0], [-1.0, 0.0, 0.0]])
"""Gazebo's camera, which looks along x with z up, in the frame of one that looks along -z with y up."""


def write(
    robot: RobotModel, path: Path | str, *, floating: bool | None = None, shared: Path | str | None = None
) -> ExportResult:
    """Write a robot as SDF, with `model.config` beside it.

    Args:
        robot: what to write.
        path: the `.sdf` file.
        floating: whether the root moves freely, else it is fixed to the world; by default all but robots
            that are mounted or move by virtual joints.
        shared: a folder whose meshes and images are used where they are; others are copied beside the file.

    Raises:
        OSError: a file cannot be written.
    """
    target = Path(path)
    target.parent.mkdir(parents=True, exist_ok=True)
    robot, renamed = _with_sdf_names(robot)
    description = robot.description
    if floating is None:
        floating = robot.semantic.base != "fixed" and not robot.semantic.virtual_joints
    follows = any(joint.mimic is not None for joint in description.joints)
    version = "1.11" if follows else "1.8"
    root = ET.Element("sdf", version=version)
    model = add(root, "model", name=robot.name)
    standing = standing_orientation(robot.semantic)
    if standing is not None and robot.semantic.base_link == description.root.name:
        add_placed(model, np.zeros(3), matrix_from_quaternion(np.array(standing)))
    files = Files(folder=target.parent, shared=None if shared is None else Path(shared))
    files.notes.extend(
        f'joint "{old}" is called "{new}": SDF has one name for one part' for old, new in renamed
    )
    _add_links(model, robot, files)
    leaders = {joint.name for joint in description.joints if joint.is_moving}
    frames = _frames(description)
    for joint in description.depth_first_joints:
        if joint.child in frames:
            continue
        steps = planar_steps(joint) if joint.type == "planar" else (joint,)
        for step in steps:
            note = add_joint(model, step, leaders)
            files.notes.extend([note] if note else [])
        for step in steps[:-1]:
            element = add(model, "link", name=step.child)
            add_pose(element, joint.origin, None if joint.parent == WORLD else joint.parent)
            _add_inertial(element, trace_mass(description, link_masses(description)))
    for loop in description.loops:
        add_loop(model, loop)
    if not floating and description.root.name != WORLD:
        taken = {joint.name for joint in description.joints}
        made = add(model, "joint", name=free_name("world_joint", taken), type="fixed")
        add(made, "parent", WORLD)
        add(made, "child", description.root.name)
    add_plugins(model, robot)
    ET.indent(root)
    target.write_text(ET.tostring(root, encoding="unicode") + "\n", encoding="utf-8")
    config = _write_config(target, robot.name, version)
    return ExportResult(files=(target, config, *files.written()), notes=tuple(files.notes))


def _with_sdf_names(robot: RobotModel) -> tuple[RobotModel, list[tuple[str, str]]]:
    """Return the robot without joints that are called as links are, and old and new names of those joints."""
    description = robot.description
    taken = {link.name for link in description.links} | {joint.name for joint in description.joints}
    clashes = [joint.name for joint in description.joints if joint.name in description.link_by_name]
    new: dict[str, str] = {}
    for name in clashes:
        new[name] = free_name(f"{name}_joint", taken)
        taken.add(new[name])
    if not new:
        return robot, []
    joints = tuple(
        replace(
            joint,
            name=new.get(joint.name, joint.name),
            mimic=joint.mimic
            if joint.mimic is None
            else replace(joint.mimic, joint=new.get(joint.mimic.joint, joint.mimic.joint)),
        )
        for joint in description.joints
    )
    drives = {new.get(name, name): kind for name, kind in robot.drives.items()}
    wheels = tuple(replace(w, joint=new.get(w.joint, w.joint)) for w in robot.semantic.wheels)
    return (
        replace(
            robot,
            description=replace(description, joints=joints),
            semantic=replace(robot.semantic, wheels=wheels),
            drives=drives,
        ),
        list(new.items()),
    )


def _frames(description: RobotDescription) -> set[str]:
    """Return the links that are frames only: leaves on fixed joints, without shape, mass and loop."""
    parents = {joint.parent for joint in description.joints}
    looped = {name for loop in description.loops for name in (loop.first, loop.second)}
    found = set()
    for joint in description.joints:
        link = description.link_by_name[joint.child]
        bare = link.inertial is None and not link.visuals and not link.collisions
        if joint.type == "fixed" and bare and link.name not in parents | looped:
            found.add(link.name)
    return found


def _add_links(model: ET.Element, robot: RobotModel, files: Files) -> None:
    description = robot.description
    masses, frames = link_masses(description), _frames(description)
    trace = trace_mass(description, masses)
    for link in description.links:
        joint = description.parent_joint.get(link.name)
        if link.name == WORLD and joint is None:
            continue
        above = None if joint is None or joint.parent == WORLD else joint.parent
        place = Pose() if joint is None else joint.origin
        if link.name in frames and joint is not None:
            add_pose(add(model, "frame", name=link.name, attached_to=joint.parent), place)
            continue
        element = add(model, "link", name=link.name)
        add_pose(element, place, above)
        mass = masses[link.name]
        if mass is None:
            files.notes.append(f'link "{link.name}": {trace.note}')
        _add_inertial(element, trace if mass is None else mass)
        add_shapes(element, link, files)
        _add_sensors(element, link, robot)


def _add_inertial(element: ET.Element, mass: MassProperties) -> None:
    inertial = add(element, "inertial")
    turn = matrix_from_quaternion(mass.quaternion)
    add_placed(inertial, mass.position, np.eye(3))
    add(inertial, "mass", mass.mass)
    tensor = turn @ np.diag(mass.principal) @ turn.T
    moments = add(inertial, "inertia")
    for name, row, column in (
        *(("ixx", 0, 0), ("ixy", 0, 1), ("ixz", 0, 2)),
        *(("iyy", 1, 1), ("iyz", 1, 2), ("izz", 2, 2)),
    ):
        add(moments, name, tensor[row, column])


def _add_sensors(element: ET.Element, link: Link, robot: RobotModel) -> None:
    used: set[str] = set()
    for sensor in robot.sensors:
        if sensor.link == link.name and sensor.kind in ("camera", "lidar"):
            name = free_name(f"{link.name}_{sensor.kind}", used)
            used.add(name)
            _add_sensor(element, sensor, name)


def _add_sensor(element: ET.Element, sensor: Sensor, name: str) -> None:
    rotation = matrix_from_quaternion(np.array(sensor.offset.quaternion))
    if sensor.kind == "camera":
        made = add(element, "sensor", name=name, type="camera")
        add_placed(made, sensor.offset.position, rotation @ CAMERA_AXES)
        add(made, "update_rate", 30.0)
        camera = add(made, "camera")
        width, height = 640, 480
        wide = 2.0 * math.atan(math.tan(math.radians(CAMERA_FOVY) / 2.0) * width / height)
        add(camera, "horizontal_fov", wide)
        image = add(camera, "image")
        add(image, "width", str(width))
        add(image, "height", str(height))
        clip = add(camera, "clip")
        add(clip, "near", 0.02)
        add(clip, "far", 100.0)
        return
    made = add(element, "sensor", name=name, type="gpu_lidar")
    add_placed(made, sensor.offset.position, rotation)
    add(made, "update_rate", 10.0)
    ray = add(made, "lidar")
    across = add(add(ray, "scan"), "horizontal")
    add(across, "samples", "720")
    add(across, "min_angle", -math.pi)
    add(across, "max_angle", math.pi)
    reach = add(ray, "range")
    add(reach, "min", 0.05)
    add(reach, "max", 30.0)


def _write_config(target: Path, name: str, version: str) -> Path:
    """Write the `model.config` by which Gazebo finds the model."""
    root = ET.Element("model")
    add(root, "name", name)
    add(root, "version", "1.0")
    add(root, "sdf", target.name, version=version)
    add(root, "description", f"{name}, written by Roboyard")
    ET.indent(root)
    file = target.parent / "model.config"
    file.write_text(ET.tostring(root, encoding="unicode") + "\n", encoding="utf-8")
    return file
