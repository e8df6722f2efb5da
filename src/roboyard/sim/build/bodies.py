"""Build MuJoCo bodies from a robot description: each link is a body of its own, frames and tensors exact.

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
| loop joint | one or two `connect`, or `weld`, between sites; its links do not collide |
| visual | geom in group 2, no contact |
| collision | geom in group 3; a mesh becomes its convex hull |
| limit.effort | force range of the joint's PID actuator |
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

import numpy as np

from roboyard.description.model import RobotDescription, Source
from roboyard.errors import MeshError
from roboyard.sim.build.geoms import add_collision, add_visual, hull_meshes
from roboyard.sim.build.joints import add_joint, add_mimics
from roboyard.sim.build.loops import add_loops
from roboyard.sim.build.masses import masses_of, write_mass
from roboyard.sim.build.mesh_assets import HullGroup
from roboyard.sim.build.records import BuildOptions, Built, BuiltLink
from roboyard.transforms import Array, to_wxyz

if TYPE_CHECKING:
    from roboyard._mujoco import mujoco
    from roboyard.sim.build.mesh_assets import MeshAssets


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
        spec: the spec.
        assets: its meshes.
        description: the robot.
        prefix: of all names ("arm/" makes "arm/elbow").
        position: (3,) of the root link's frame in the world frame (m).
        quaternion: (4,) x, y, z, w of the root link's frame.
        options: how to build it.

    Raises:
        MeshError: a mesh cannot be read.
    """
    built = Built(links=[])
    try:
        _build_into(built, spec, assets, description, prefix, position, quaternion, options)
    except Exception:
        discard(built, spec, assets)
        raise
    return built


def is_anchored(description: RobotDescription) -> bool:
    """Return whether a description fixes its root: a root named "world", or of mass 0."""
    root = description.root
    return root.name == "world" or (root.inertial is not None and root.inertial.mass == 0.0)


def discard(built: Built, spec: mujoco.MjSpec, assets: MeshAssets) -> None:
    """Remove all elements that a description added (or began to add) from a spec."""
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


def is_plain(built: Built) -> bool:
    """Return whether a body is one link whose elements no other element of the spec refers to."""
    if len(built.links) != 1 or built.equalities or built.is_ground:
        return False
    record = built.links[0]
    if record.terrains or record.windows or record.actuator is not None or record.joint_elements:
        return False
    element = record.element
    return not (element.sites or element.cameras or element.lights or element.bodies)


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
    masses = masses_of(description, options)
    body = spec.worldbody.add_body(name=f"{prefix}{root.name}", pos=position, quat=to_wxyz(quaternion))
    record = BuiltLink(name=root.name, parent=-1, element=body, link=root, mass=masses[root.name])
    record.is_static = options.fixed_base
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
        add_joint(record, spec, prefix, options, built)
        record.is_static = built.links[record.parent].is_static and not record.joint_elements
        _fill_link(record, spec, assets, prefix, options, built.notes)
    for place, record in enumerate(built.links):
        record.place = place
    add_mimics(built, spec, description, prefix)
    add_loops(built, spec, description, prefix, options.scale)
    if options.keep_link_order:
        _reorder(built, description)
    for record in built.links:
        if record.mass is not None and record.mass.note:
            built.notes.append(f'link "{record.name}": {record.mass.note}')


def _reorder(built: Built, description: RobotDescription) -> None:
    """Sort links in the description's order, the root first."""
    names = [record.name for record in built.links]
    order = [names[0], *(link.name for link in description.links if link.name != names[0])]
    new = {name: i for i, name in enumerate(order)}
    for record in built.links:
        if record.parent >= 0:
            record.parent = new[names[record.parent]]
    built.links.sort(key=lambda record: new[record.name])


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
    hulls = HullGroup(hull_meshes(link.collisions, options.scale), options.hull_steps)
    for collision in link.collisions:
        with _blaming(collision.source, link.name):
            add_collision(record, spec, assets, collision, options, notes)
    hulls.store()
    if options.visual_geoms:
        for visual in link.visuals:
            with _blaming(visual.source, link.name):
                add_visual(record, spec, assets, visual, options, notes)


@contextmanager
def _blaming(source: Source, link: str) -> Iterator[None]:
    """Raise errors of meshes with the place in the description."""
    try:
        yield
    except MeshError as error:
        element = f'link "{link}"'
        raise MeshError(error.problems[0], file=source.file, line=source.line, element=element) from error
