"""Planned bodies of one link of primitive shapes: their elements get all fields as they are made.

What elements of a description have is found once for all bodies of it. A program that begins with hundreds of
boxes spends a third of its first compile on elements otherwise.
"""

from __future__ import annotations

from typing import Any

from roboyard._records import dataclass
from roboyard.description.model import Box, Capsule, Cylinder, RobotDescription, Sphere
from roboyard.sim.build.geoms import COLLISION_GROUP, contact_fields, plain_arguments
from roboyard.sim.build.masses import mass_fields, masses_of
from roboyard.sim.build.planned import Friction, PlannedBody
from roboyard.sim.build.records import BuildOptions, Built, BuiltLink
from roboyard.transforms import to_wxyz

_MOST = 64
_CONDIM = 3
"""Dimensions of a contact with sliding friction only."""
Key = tuple[int, int, tuple[Friction, ...]]


@dataclass(kw_only=True, slots=True, eq=False)
class Elements:
    """Fields of elements that bodies of one description have in common."""

    description: RobotDescription
    options: BuildOptions
    mass: Any
    """Of the link, as `BuiltLink` has it."""
    body: dict[str, Any]
    """Fields of the body."""
    geoms: list[dict[str, Any]]
    """Fields of each geom."""


_KNOWN: dict[Key, Elements] = {}


def build_plain(spec: Any, plan: PlannedBody) -> Built | None:
    """Add the elements of a planned body of one link to a spec, its friction included.

    Returns:
        None where `build` has to: with joints, meshes, planes, or shapes without size.
    """
    description, options = plan.description, plan.options
    if description.joints or plan.armatures:
        return None
    key = id(description), id(options), tuple(plan.frictions)
    known = _KNOWN.get(key)
    if known is None or known.description is not description or known.options is not options:
        known = _elements(plan)
        if known is None:
            return None
        _keep(_KNOWN, key, known)
    root = description.root
    name = f"{plan.prefix}{root.name}"
    body = spec.worldbody.add_body(name=name, pos=plan.position, quat=to_wxyz(plan.quaternion), **known.body)
    built = Built(links=[])
    if not options.fixed_base:
        built.free_joint, built.dofs = body.add_freejoint(name=f"{name}/free", align=0), 6
    record = BuiltLink(name=root.name, parent=-1, element=body, link=root, mass=known.mass)
    record.is_static = options.fixed_base
    record.geoms = [body.add_geom(**fields) for fields in known.geoms]
    built.links.append(record)
    return built


def _keep(table: dict[Key, Any], key: Key, value: Any) -> None:
    table[key] = value
    while len(table) > _MOST:
        del table[next(iter(table))]


def _elements(plan: PlannedBody) -> Elements | None:
    description, options = plan.description, plan.options
    root = description.root
    if options.visual_geoms:
        return None
    mass = masses_of(description, options)[root.name]
    if mass is not None and mass.note:
        return None
    fields = contact_fields(root.contact, options)
    for _, *given in plan.frictions:
        kept = zip(fields["friction"], given, strict=True)
        fields["friction"] = [old if value is None else value for old, value in kept]
        sliding_only = 4 if given[1] else _CONDIM
        fields["condim"] = max(fields["condim"], 6 if given[2] else sliding_only)
    geoms: list[dict[str, Any]] = []
    for shape in root.collisions:
        if not isinstance(shape.geometry, (Box, Sphere, Cylinder, Capsule)):
            return None
        arguments = plain_arguments(shape.geometry, shape.origin, options.scale)
        if arguments is None:
            return None
        geoms.append({"group": COLLISION_GROUP, "mass": 0.0, **fields, **arguments})
    return Elements(description=description, options=options, mass=mass, body=mass_fields(mass), geoms=geoms)
