"""MJCF files in a world: attached to the spec, actuators, tendons and sensors included."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from roboyard._arrays import ArrayLike
from roboyard._mujoco import mujoco
from roboyard.description.mass_properties import MassProperties
from roboyard.description.mjcf.checked import checked_mjcf
from roboyard.description.mjcf.parse import parse_mjcf
from roboyard.errors import DescriptionError, RoboyardError
from roboyard.sim.body import Body
from roboyard.sim.build.records import Built, BuiltLink
from roboyard.sim.simulation import Simulation
from roboyard.transforms import from_wxyz


def add_mjcf(
    world: Simulation,
    source: str | Path,
    position: ArrayLike = (0, 0, 0),
    *,
    search_paths: Sequence[Path] = (),
) -> tuple[Body, ...]:
    """Add an MJCF file to a world, whose own options (time step, gravity, solver) are kept.

    Args:
        world: the world.
        source: path of the file, or the XML itself.
        position: (3,) offset of everything in it (m).
        search_paths: folders whose files it may name, besides its own (see `description.mjcf.checked`).

    Returns:
        One body for the file's fixed shapes (if it has any), then one for each top-level body.

    Raises:
        DescriptionError: the file is refused (see `description.mjcf.checked`), or MuJoCo rejects it.
    """
    offset = np.asarray(position, dtype=float)
    if offset.shape != (3,) or not np.isfinite(offset).all():
        raise RoboyardError(f"position must be three finite numbers, got {offset.tolist()}")
    checked = checked_mjcf(source, search_paths)
    path = checked.file
    try:
        # compiled from the text again: a copy of a spec loses actuators whose joint does not exist
        child = parse_mjcf(checked)
        compiled = parse_mjcf(checked).compile()
    except Exception as error:  # MuJoCo raises several types
        message = " ".join(str(error).split())[:500]
        raise DescriptionError(f"MuJoCo cannot read it: {message}", file=path) from error
    name = world.reserve_name(child.modelname or (path.stem if path else "mjcf"))
    tops = [body.name for body in child.worldbody.bodies]
    loose = [
        *child.worldbody.geoms,
        *child.worldbody.sites,
        *child.worldbody.cameras,
        *child.worldbody.lights,
    ]
    _take_over_options(child, world)
    ground = world.spec.worldbody
    before = len(ground.geoms)
    with warnings.catch_warnings():  # of specs that have files in memory and are attached to yet another one
        warnings.simplefilter("ignore")
        world.spec.attach(child, prefix=f"{name}/", frame=ground.add_frame(pos=offset))
    fixed = Built(links=[BuiltLink(name="world", parent=-1, element=ground, link=None)], is_ground=True)
    fixed.links[0].geoms = list(ground.geoms)[before:]
    bodies: list[Body] = []
    if loose or not tops:
        bodies.append(world.register(f"{name}", fixed, None, fixed_base=True))
    for top in tops:
        element = world.spec.body(f"{name}/{top}")
        built = _collect(element, f"{name}/", compiled)
        bodies.append(world.register(f"{name}/{top}", built, None, fixed_base=built.free_joint is None))
    for body in bodies:
        world.pool.note_added(body, None)
    world.mark_stale()
    return tuple(bodies)


def _take_over_options(child: Any, world: Simulation) -> None:
    """Overwrite the file's options with the world's before it is attached."""
    for name in dir(child.option):
        if name.startswith("_"):
            continue
        value = getattr(world.spec.option, name)
        if isinstance(value, np.ndarray):
            getattr(child.option, name)[:] = value
        else:
            setattr(child.option, name, value)


def _collect(top: Any, prefix: str, compiled: Any) -> Built:
    """Collect an attached tree depth first as link records.

    A body with several joints becomes a chain of links with a joint each; a top-level body with a joint gets
    a fixed base.
    """
    built = Built(links=[])
    stack = [(top, -1)]
    while stack:
        element, parent = stack.pop()
        joints = list(element.joints)
        name = element.name.removeprefix(prefix)
        if joints and joints[0].type == mujoco.mjtJoint.mjJNT_FREE:
            built.free_joint = joints.pop(0)
            built.dofs += 6
        elif parent == -1 and joints:
            built.links.append(BuiltLink(name=f"{name}/base", parent=-1, element=element, link=None))
            parent = 0
        for joint in joints[:-1]:
            between = BuiltLink(
                name=f"{name}/{joint.name.removeprefix(prefix)}",
                parent=parent,
                element=element,
                link=None,
                joint_elements=(joint,),
                joint_name=joint.name.removeprefix(prefix),
            )
            parent = len(built.links)
            built.links.append(between)
        record = BuiltLink(
            name=name, parent=parent, element=element, link=None, mass=_mass(compiled.body(name))
        )
        if joints:
            record.joint_elements = (joints[-1],)
            record.joint_name = joints[-1].name.removeprefix(prefix)
        built.dofs += sum(3 if joint.type == mujoco.mjtJoint.mjJNT_BALL else 1 for joint in joints)
        record.geoms = [g for g in element.geoms if g.contype or g.conaffinity]
        record.visuals = [g for g in element.geoms if not (g.contype or g.conaffinity)]
        index = len(built.links)
        built.links.append(record)
        stack.extend((child, index) for child in reversed(list(element.bodies)))
    return built


def _mass(body: Any) -> MassProperties:
    """Mass properties of a body of a compiled model."""
    return MassProperties(
        mass=float(body.mass[0]),
        position=body.ipos.copy(),
        quaternion=from_wxyz(body.iquat),
        principal=body.inertia.copy(),
    )
