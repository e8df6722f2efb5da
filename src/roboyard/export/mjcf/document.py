"""The MJCF document: defaults, tree, constraints, actuators, sensors."""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from roboyard.description.mass_properties import (
    MassProperties,
    link_masses,
    massless_parts,
    trace_mass,
)
from roboyard.description.model import RobotDescription
from roboyard.export.export_result import ExportResult
from roboyard.export.mjcf.assets import Assets
from roboyard.export.mjcf.geoms import add_collisions, add_visuals
from roboyard.export.mjcf.joints import add_actuators, add_joint
from roboyard.export.mjcf.keyframes import add_keyframes
from roboyard.export.mjcf.loops import add_loops
from roboyard.export.mjcf.xml import add, pose
from roboyard.export.names import free_name
from roboyard.export.start import is_scalar, standing
from roboyard.transforms import to_wxyz

if TYPE_CHECKING:
    from roboyard.description.robot_model import RobotModel

TIMESTEP = 0.002
"""s"""
CAMERA_FOVY = math.degrees(2 * math.atan(15.2908 / 2 / 17.0))
"""Degrees: of a focal length of 17 beside an aperture of 15.2908, the camera of the USD stage."""


def write(robot: RobotModel, path: Path | str, *, floating: bool | None = None) -> ExportResult:
    """Write a robot as MJCF with `meshes/` and `textures/` beside it.

    Args:
        robot: what to write.
        path: the `.xml` file.
        floating: put the root on a free joint, else it is fixed to the world; by default robots on wheels
            that have no virtual joints float, as in OmniGibson.

    Raises:
        MeshError: a mesh file cannot be read.
    """
    target = Path(path)
    target.parent.mkdir(parents=True, exist_ok=True)
    description = robot.description
    if floating is None:
        floating = bool(robot.semantic.wheel_links) and not robot.semantic.virtual_joints
    notes: list[str] = []
    root = ET.Element("mujoco", model=robot.name)
    # strippath off: files keep their folders; inertiafromgeom off: masses are the file's own
    add(root, "compiler", angle="radian", autolimits=True, inertiafromgeom="false")
    add(root, "option", timestep=TIMESTEP, integrator="implicitfast", cone="elliptic", impratio=10)
    _add_defaults(root)
    assets = Assets(folder=target.parent, element=add(root, "asset"))
    names = _body_names(description)
    joints = _add_bodies(root, robot, names, assets, floating, notes)
    _add_equalities(root, description, joints, notes)
    add_loops(root, description, names)
    _add_excludes(root, robot, names)
    actuators = add_actuators(add(root, "actuator"), robot)
    _add_sensors(root, robot, actuators)
    add_keyframes(root, robot, joints, actuators, floating)
    for empty in [child for child in root if not len(child) and not child.attrib]:
        root.remove(empty)
    ET.indent(root)
    target.write_text(ET.tostring(root, encoding="unicode") + "\n", encoding="utf-8")
    return ExportResult(files=(target, *assets.files), notes=tuple(notes))


def _add_defaults(root: ET.Element) -> None:
    defaults = add(root, "default")
    visual = add(defaults, "default", class_="visual")
    add(visual, "geom", group=2, contype=0, conaffinity=0, mass=0)
    collision = add(defaults, "default", class_="collision")
    add(collision, "geom", group=3, mass=0, rgba=(0.3, 0.6, 0.9, 0.4))


def _body_names(description: RobotDescription) -> dict[str, str]:
    """Body name of every link: its own, but for `world`."""
    taken = {link.name for link in description.links}
    return {
        link.name: link.name if link.name != "world" else free_name("world_link", taken)
        for link in description.links
    }


def _add_bodies(
    root: ET.Element,
    robot: RobotModel,
    names: Mapping[str, str],
    assets: Assets,
    floating: bool,
    notes: list[str],
) -> dict[str, tuple[str, ...]]:
    """The tree; returns the MuJoCo joints of every joint."""
    description = robot.description
    masses = link_masses(description)
    weightless = set(massless_parts(description, masses, fixed_base=not floating))
    trace = trace_mass(description, masses)
    placed = pose((0.0, 0.0, 0.0), standing(robot))
    top = add(add(root, "worldbody"), "body", name=names[description.root.name], **placed)
    if floating:
        add(top, "freejoint", name=f"{description.root.name}_free")
    bodies = {description.root.name: top}
    joints: dict[str, tuple[str, ...]] = {}
    for joint in description.depth_first_joints:
        placed = pose(joint.origin.position, joint.origin.quaternion)
        bodies[joint.child] = add(bodies[joint.parent], "body", name=names[joint.child], **placed)
    used_sites: set[str] = set()
    for name, body in bodies.items():
        link = description.link_by_name[name]
        children = list(body)
        for child in children:
            body.remove(child)
        mass = trace if name in weightless else masses[name]
        if mass is not None:
            _add_inertial(body, mass)
            if mass is trace:
                notes.append(f'link "{name}": {mass.note}')
            elif mass.note:
                notes.append(f'link "{name}": {mass.note}; changed to what a body can have')
        if name in description.parent_joint:
            joints[description.parent_joint[name].name] = add_joint(body, description.parent_joint[name])
        else:
            body.extend(child for child in children if child.tag == "freejoint")
        add_visuals(body, link, assets, notes)
        add_collisions(body, link, robot.approximations.get(name, "convexHull"), assets, notes)
        _add_sites(body, robot, name, used_sites)
        body.extend(child for child in children if child.tag == "body")
    return joints


def _add_inertial(body: ET.Element, mass: MassProperties) -> None:
    add(
        body,
        "inertial",
        pos=mass.position,
        quat=to_wxyz(mass.quaternion),
        mass=mass.mass,
        diaginertia=mass.principal,
    )


def _add_sites(body: ET.Element, robot: RobotModel, link: str, used: set[str]) -> None:
    for sensor in robot.sensors:
        if sensor.link != link:
            continue
        placed = pose(sensor.offset.position, sensor.offset.quaternion)
        name = free_name(f"{link}_{sensor.kind}", used)
        used.add(name)
        if sensor.kind == "camera":
            add(body, "camera", name=name, fovy=CAMERA_FOVY, **placed)
        else:
            size = 0.005 if sensor.kind == "visual_sphere" else 0.02
            add(body, "site", name=name, size=size, group=4, **placed)


def _add_equalities(
    root: ET.Element, description: RobotDescription, joints: Mapping[str, tuple[str, ...]], notes: list[str]
) -> None:
    parent = add(root, "equality")
    for joint in description.depth_first_joints:
        if joint.mimic is None or not is_scalar(joint):
            continue
        leader = description.joint_by_name.get(joint.mimic.joint)
        if leader is None or leader is joint or not is_scalar(leader):
            notes.append(
                f'joint "{joint.name}": mimics "{joint.mimic.joint}", which does not move; left free'
            )
            continue
        add(
            parent,
            "joint",
            name=f"{joint.name}_mimic",
            joint1=joint.name,
            joint2=leader.name,
            polycoef=(joint.mimic.offset, joint.mimic.multiplier, 0, 0, 0),
            solref=(0.005, 1),
            solimp=(0.99, 0.999, 0.001, 0.5, 2),
        )


def _add_excludes(root: ET.Element, robot: RobotModel, names: Mapping[str, str]) -> None:
    """Pairs that must not push: joined (also past fixed links without shapes), or overlapping at rest."""
    description = robot.description
    parent = add(root, "contact")
    solid = {link.name for link in description.links if link.collisions}
    pairs: dict[frozenset[str], tuple[str, str]] = {}
    for joint in description.depth_first_joints:
        above: str | None = joint.parent
        while above is not None and above not in solid:
            rigid = description.parent_joint.get(above)
            above = rigid.parent if rigid is not None and not rigid.is_moving else None
        if above is not None and joint.child in solid:
            pairs.setdefault(frozenset((above, joint.child)), (above, joint.child))
    for loop in description.loops:
        pairs.setdefault(frozenset((loop.first, loop.second)), (loop.first, loop.second))
    for one, other in robot.semantic.disabled_collision_pairs:
        pairs.setdefault(frozenset((one, other)), (one, other))
    for one, two in pairs.values():
        add(parent, "exclude", body1=names[one], body2=names[two])


def _add_sensors(root: ET.Element, robot: RobotModel, actuators: tuple[str, ...]) -> None:
    parent = add(root, "sensor")
    for joint in actuators:
        add(parent, "jointpos", name=f"{joint}_position", joint=joint)
        add(parent, "jointvel", name=f"{joint}_velocity", joint=joint)
        add(parent, "jointactuatorfrc", name=f"{joint}_effort", joint=joint)
    sites = [site.get("name", "") for site in root.iter("site")]
    for site in sites:
        add(parent, "framepos", name=f"{site}_position", objtype="site", objname=site)
        add(parent, "framequat", name=f"{site}_orientation", objtype="site", objname=site)
