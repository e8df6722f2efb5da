"""A robot description becomes MuJoCo bodies: every link a body of its own, frames and tensors exact.

| description | MuJoCo |
| --- | --- |
| link | body of the same frame (never fused, also behind a fixed joint) |
| floating base | free joint on the root body |
| revolute, continuous | hinge |
| prismatic | slide |
| spherical | ball |
| planar | two slides in the plane and a hinge about its normal |
| floating (inside the tree) | three slides and a ball |
| mimic | joint equality |
| visual | geom in group 2, no contact |
| collision | geom in group 3; a mesh becomes its convex hull |
| limit.effort | force range of the joint's pid actuator |
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from roboyard.errors import MeshError
from roboyard.poses import Array, to_wxyz
from roboyard.sim.geoms import add_collision, add_visual
from roboyard.sim.inertials import MIN_INERTIA, MassProperties, mass_properties
from roboyard.sim.options import CONTACT_SOLIMP, CONTACT_SOLREF
from roboyard.urdf.model import Joint, Link, RobotDescription, Source

if TYPE_CHECKING:
    import mujoco

    from roboyard.sim.assets import MeshAssets

LIMIT_INFINITE = 1e6
"""rad or m: a range beyond this is no limit."""
LOCKED_HALF_RANGE = 1e-9
"""rad or m: a joint whose lower limit equals its upper one."""
MASSLESS_FRACTION = 1e-6
"""Of the robot's mass: what a moving part without any mass is given, since MuJoCo cannot move nothing."""


@dataclass(kw_only=True, slots=True)
class BuiltLink:
    """The spec's elements of one link and of the joint it hangs from."""

    name: str
    parent: int
    """Index of the parent link; -1 for the root."""
    element: Any
    link: Link | None
    joint: Joint | None = None
    joint_elements: tuple[Any, ...] = ()
    joint_name: str = ""
    """For links without a description (MJCF)."""
    actuator: Any = None
    geoms: list[Any] = field(default_factory=list)
    """Collision geoms."""
    visuals: list[Any] = field(default_factory=list)
    meshes: list[str] = field(default_factory=list)
    mass: MassProperties | None = None


@dataclass(kw_only=True, slots=True)
class Built:
    """Everything a description added to a spec."""

    links: list[BuiltLink]
    free_joint: Any = None
    is_ground: bool = False
    """The shapes belong to MuJoCo's own world body (fixed shapes of an MJCF file)."""
    equalities: list[Any] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    dofs: int = 0


@dataclass(frozen=True, kw_only=True, slots=True)
class BuildOptions:
    fixed_base: bool
    scale: float = 1.0
    visual_geoms: bool = True
    drives: bool = True
    joint_friction: bool = True
    joint_damping: bool = True
    hard: bool = False
    """Joint limits as rigid as can be, for worlds that solve contacts on the velocity level."""
    contype: int = 1
    conaffinity: int = -1


def build(
    spec: mujoco.MjSpec,
    assets: MeshAssets,
    description: RobotDescription,
    prefix: str,
    position: Array,
    quaternion: Array,
    options: BuildOptions,
) -> Built:
    """Add a description to a spec, link by link, depth first, children in file order.

    Args:
        prefix: goes before every name ("arm/" makes "arm/elbow").
        position: (3,) of the root link's frame in the world; m.
        quaternion: (4,) x, y, z, w.
    """
    built = Built(links=[])
    try:
        _build_into(built, spec, assets, description, prefix, position, quaternion, options)
    except Exception:
        discard(built, spec, assets)
        raise
    return built


def is_anchored(description: RobotDescription) -> bool:
    """Whether a description itself says that its root stays where it is: named "world", or of mass 0."""
    root = description.root
    return root.name == "world" or (root.inertial is not None and root.inertial.mass == 0.0)


def discard(built: Built, spec: mujoco.MjSpec, assets: MeshAssets) -> None:
    """Take everything a description added (or began to add) out of a spec."""
    for equality in built.equalities:
        spec.delete(equality)
    terrains = []
    for record in built.links:
        if record.actuator is not None:
            spec.delete(record.actuator)
        terrains += [g.hfieldname for g in (*record.geoms, *record.visuals) if g.hfieldname]
    if built.is_ground:
        for geom in built.links[0].geoms:
            spec.delete(geom)
    elif built.links:
        spec.delete(built.links[0].element)
    for name in terrains:
        spec.delete(spec.hfield(name))
    for record in built.links:
        for mesh in record.meshes:
            assets.release(mesh)


def _build_into(
    built: Built,
    spec: mujoco.MjSpec,
    assets: MeshAssets,
    description: RobotDescription,
    prefix: str,
    position: Array,
    quaternion: Array,
    options: BuildOptions,
) -> None:
    root = description.root
    masses = _all_masses(description, options)
    body = spec.worldbody.add_body(name=f"{prefix}{root.name}", pos=position, quat=to_wxyz(quaternion))
    record = BuiltLink(name=root.name, parent=-1, element=body, link=root, mass=masses[root.name])
    built.links.append(record)
    if not options.fixed_base:
        built.free_joint = body.add_freejoint(name=f"{prefix}{root.name}/free", align=0)
        built.dofs = 6
    _fill_link(record, spec, assets, prefix, options, built.notes)
    index = {root.name: 0}
    for joint in description.depth_first_joints:
        parent = built.links[index[joint.parent]]
        link = description.link_by_name[joint.child]
        body = parent.element.add_body(
            name=f"{prefix}{link.name}",
            pos=np.asarray(joint.origin.position) * options.scale,
            quat=to_wxyz(joint.origin.quaternion),
        )
        record = BuiltLink(
            name=link.name,
            parent=index[joint.parent],
            element=body,
            link=link,
            joint=joint,
            mass=masses[link.name],
        )
        index[link.name] = len(built.links)
        built.links.append(record)
        _add_joint(record, spec, prefix, options, built)
        _fill_link(record, spec, assets, prefix, options, built.notes)
    _add_mimics(built, spec, description, prefix)
    for record in built.links:
        if record.mass is not None and record.mass.note:
            built.notes.append(f'link "{record.name}": {record.mass.note}')


# ------------------------------------------------------------------------------------------------- masses


def _all_masses(description: RobotDescription, options: BuildOptions) -> dict[str, MassProperties | None]:
    """Mass properties by link; parts that move but weigh nothing get a trace of the robot's mass.

    A part is a link on a moving joint together with the links fixed to it.
    """
    masses = {
        link.name: None if link.inertial is None else mass_properties(link.inertial, options.scale)
        for link in description.links
    }
    part_of = {description.root.name: description.root.name}
    moving = [] if options.fixed_base else [description.root.name]
    for joint in description.depth_first_joints:
        part_of[joint.child] = joint.child if joint.is_moving else part_of[joint.parent]
        if joint.is_moving:
            moving.append(joint.child)
    weight = dict.fromkeys(part_of.values(), 0.0)
    for name, part in part_of.items():
        found = masses[name]
        weight[part] += 0.0 if found is None else found.mass
    total = sum(weight.values()) or 1.0
    for name in moving:
        if weight[name] < 1e-12 * total:
            masses[name] = _trace(total * MASSLESS_FRACTION, _reach(description) * options.scale)
    return masses


def _reach(description: RobotDescription) -> float:
    """Longest way from the root to a joint, at least 1 cm; m."""
    distance = {description.root.name: 0.0}
    for joint in description.depth_first_joints:
        distance[joint.child] = distance[joint.parent] + float(np.linalg.norm(joint.origin.position))
    return max(0.01, *distance.values())


def _trace(mass: float, reach: float) -> MassProperties:
    """A millionth of the robot: light enough to change nothing, heavy enough where joint axes line up."""
    moment = max(mass * reach**2, MIN_INERTIA)
    return MassProperties(
        mass=mass,
        position=np.zeros(3),
        quaternion=np.array([0.0, 0.0, 0.0, 1.0]),
        principal=np.full(3, moment),
        note="moves but has no mass; given a trace",
    )


def write_mass(element: Any, mass: MassProperties | None) -> None:
    """Put mass properties on a spec body; None and zero mass leave it massless."""
    element.explicitinertial = True
    element.mass = 0.0
    element.inertia = np.zeros(3)
    if mass is None or mass.mass == 0.0:
        return
    element.mass = mass.mass
    element.ipos = mass.position
    element.iquat = to_wxyz(mass.quaternion)
    element.inertia = mass.principal


def _fill_link(
    record: BuiltLink,
    spec: mujoco.MjSpec,
    assets: MeshAssets,
    prefix: str,
    options: BuildOptions,
    notes: list[str],
) -> None:
    write_mass(record.element, record.mass)
    link = record.link
    assert link is not None
    for collision in link.collisions:
        with _blaming(collision.source, link.name):
            add_collision(record, spec, assets, collision, options, notes)
    if options.visual_geoms:
        for visual in link.visuals:
            with _blaming(visual.source, link.name):
                add_visual(record, spec, assets, visual, options, notes)


@contextmanager
def _blaming(source: Source, link: str) -> Iterator[None]:
    """A mesh that cannot be read is reported where the description names it."""
    try:
        yield
    except MeshError as error:
        element = f'link "{link}"'
        raise MeshError(error.problems[0], file=source.file, line=source.line, element=element) from error


# ------------------------------------------------------------------------------------------------- joints


def _add_joint(
    record: BuiltLink, spec: mujoco.MjSpec, prefix: str, options: BuildOptions, built: Built
) -> None:
    import mujoco

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
        element.solimp_limit = RIGID if options.hard else CONTACT_SOLIMP
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
        first, second = _plane_axes(np.asarray(joint.axis))
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
    import mujoco

    limits = joint.position_limits()
    element.limited = mujoco.mjtLimited.mjLIMITED_FALSE
    if limits is None:
        return
    lower, upper = limits
    if joint.type == "prismatic":
        lower, upper = lower * scale, upper * scale
    if max(abs(lower), abs(upper)) > LIMIT_INFINITE:
        return
    if upper - lower < 2 * LOCKED_HALF_RANGE:
        lower, upper = lower - LOCKED_HALF_RANGE, upper + LOCKED_HALF_RANGE
    element.limited = mujoco.mjtLimited.mjLIMITED_TRUE
    element.range = [lower, upper]


def _plane_axes(normal: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Two unit axes that span the plane of a planar joint; x and y when its normal is z."""
    if abs(normal[2]) > 1 - 1e-9:
        return np.array([1.0, 0.0, 0.0]), np.array([0.0, np.sign(normal[2]), 0.0])
    helper = np.eye(3)[int(np.argmin(np.abs(normal)))]
    first = np.cross(helper, normal)
    first /= np.linalg.norm(first)
    return first, np.cross(normal, first)


def _add_drive(spec: mujoco.MjSpec, joint_name: str, joint: Joint) -> Any:
    """A pid actuator with position, velocity and feedforward inputs, gains zero until someone drives."""
    import mujoco

    actuator = spec.add_actuator(name=joint_name, target=joint_name, trntype=mujoco.mjtTrn.mjTRN_JOINT)
    actuator.set_to_pid(kp=0.0, kv=0.0, ctrlspec=PID_ALL_INPUTS)
    effort = joint.limit.effort if joint.limit is not None else None
    actuator.forcelimited = mujoco.mjtLimited.mjLIMITED_TRUE
    bound = effort if effort is not None and 0 < effort < NO_EFFORT_LIMIT else NO_EFFORT_LIMIT
    actuator.forcerange = [-bound, bound]
    return actuator


PID_ALL_INPUTS = 7
RIGID = (0.9999, 0.9999, 0.001, 0.5, 2.0)
NO_EFFORT_LIMIT = 1e9
"""N m or N: force range where the file gives no effort, or zero effort (a common export error)."""


def _add_mimics(built: Built, spec: mujoco.MjSpec, description: RobotDescription, prefix: str) -> None:
    import mujoco

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
