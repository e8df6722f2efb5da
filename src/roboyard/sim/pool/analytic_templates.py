"""Analytic templates: templates of bodies of one simple shape, computed from its sizes instead of compiled.

Bodies that differ in numbers only (sizes, mass, inertia, poses, colours) have equal templates except for a
few arrays, which are known functions of those numbers.
"""

from __future__ import annotations

from math import dist, hypot, sqrt
from typing import Any

import numpy as np

from roboyard._mujoco import mujoco
from roboyard._records import dataclass
from roboyard.description.mass_properties import ORIGIN, UNTURNED, MassProperties, mass_properties
from roboyard.description.model import RGBA, Box, Capsule, Cylinder, Pose, RobotDescription, Sphere
from roboyard.sim.build.geoms import SMALLEST, paint, sizes_of
from roboyard.sim.build.records import BuildOptions
from roboyard.sim.pool.templates import BodyTemplate
from roboyard.transforms import Array, matrix_from_quaternion, to_wxyz

NEARLY = 1e-9
"""Difference (m, or of a unit quaternion) below which frames count as equal or prevent an analytic
template."""
SHORTEST = 1e-5
"""Length scale (m) that MuJoCo assumes for a body without shapes."""
_NOWHERE, _IDENTITY = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0)
_NO_POSE = Pose()
_ALL, _ONE = (True,) * 6, (True, True, None, None)
"""Layouts of frames that are the same, with and without an inertial."""


@dataclass(kw_only=True, slots=True, eq=False)
class Numbers:
    """Numbers in which bodies of one signature differ."""

    signature: tuple[Any, ...]
    """All other properties of the body."""
    mass: MassProperties | None
    kind: int
    """MuJoCo's type of all geoms, which coincide; -1 without any."""
    sizes: tuple[float, float, float]
    """MuJoCo's sizes of the geoms (m)."""
    is_plain: bool
    """Whether geoms and inertial are at the link's frame, and no geom is a visual one."""
    pose: Pose
    """Pose of all geoms in the link frame."""
    colors: list[RGBA]
    """Colours of the visual geoms."""


def numbers_of(description: RobotDescription, options: BuildOptions) -> Numbers | None:
    """Return the numbers of a body of one link of one shape; None where a compile is needed."""
    if description.joints:
        return None
    link, scale = description.links[0], options.scale
    visuals = link.visuals if options.visual_geoms else ()
    shapes = (*link.collisions, *visuals)
    kind, sizes, pose = -1, (0.0, 0.0, 0.0), _NO_POSE
    if shapes:
        geometry, origin = shapes[0].geometry, shapes[0].origin
        if not isinstance(geometry, Box | Sphere | Cylinder | Capsule):
            return None
        for shape in shapes[1:]:
            place = shape.origin
            if shape.geometry != geometry or (place.position, place.quaternion) != (
                origin.position,
                origin.quaternion,
            ):
                return None
        found, sizes, count = sizes_of(geometry, scale)
        kind = int(found)
        if not min(sizes[:count]) > SMALLEST:
            return None
        if origin.position != _NOWHERE or origin.quaternion != _IDENTITY:
            x, y, z = origin.position
            pose = Pose(position=(x * scale, y * scale, z * scale), quaternion=origin.quaternion)
    inertial, mass, centre = link.inertial, None, None
    if inertial is not None:
        mass = mass_properties(inertial, scale)
        if not mass.mass > 0.0 or mass.note:
            return None
        if mass.position is ORIGIN and mass.quaternion is UNTURNED:
            centre = _NO_POSE
        else:
            place, turn = _tuple(mass.position), _tuple(mass.quaternion)
            is_there = place == _NOWHERE and turn == _IDENTITY
            centre = _NO_POSE if is_there else Pose(position=place, quaternion=turn)
    elif not options.fixed_base:
        return None
    is_plain = pose is _NO_POSE and (centre is None or centre is _NO_POSE)
    layout = _layout(_NO_POSE, pose, centre) if not is_plain else _ONE if centre is None else _ALL
    if layout is None:
        return None
    return Numbers(
        signature=(options, kind, len(link.collisions), len(visuals), link.contact, layout),
        mass=mass,
        kind=kind,
        sizes=sizes,
        is_plain=is_plain and kind >= 0 and not visuals,
        pose=pose,
        colors=[paint(visual) for visual in visuals],
    )


def analytic_template(
    template: BodyTemplate, numbers: Numbers, description: RobotDescription
) -> BodyTemplate:
    """Return the template of a body that differs from another one only in numbers."""
    family, mass = template.family, numbers.mass
    position, quaternion = np.array(numbers.pose.position), to_wxyz(numbers.pose.quaternion)
    body, geoms, blocks, is_free = family.body, family.geoms, {}, not family.options.fixed_base
    if mass is not None:
        wxyz = to_wxyz(mass.quaternion)
        body = body | {"mass": mass.mass, "ipos": mass.position, "iquat": wxyz, "inertia": mass.principal}
        blocks = _mass_blocks(mass, wxyz, is_free=is_free)
    reach = None
    if geoms:
        own = {"size": np.array(numbers.sizes), "pos": position, "quat": quaternion}
        geoms = [fields | own for fields in geoms]
        for fields, color in zip(geoms[family.collisions :], numbers.colors, strict=True):
            fields["rgba"] = color
        reach = _add_geom_blocks(blocks, family, numbers, position, quaternion.tolist())
    if is_free:
        assert mass is not None
        length = _length(mass, reach, numbers.pose)
        blocks["dof_length"] = np.array([1.0, 1.0, 1.0, length, length, length])
    return BodyTemplate(
        description=description,
        options=family.options,
        mass=mass,
        notes=(),
        meshes=(),
        files=(),
        collisions=family.collisions,
        body=body,
        geoms=geoms,
        blocks=family.blocks | blocks,
        kinds=family.kinds,
        counts=family.counts,
        layout=family.layout,
        origin=family,
        varied=tuple(blocks),
    )


def _layout(*frames: Pose | None) -> tuple[bool | None, ...] | None:
    """Return which of three frames share an origin or axes; None where some almost do.

    MuJoCo omits transforms between equal frames.

    Args:
        frames: of the link, the geoms and the inertial.
    """
    layout: list[bool | None] = []
    for k, a in enumerate(frames):
        for b in frames[:k]:
            if a is None or b is None:
                layout.append(None)
                continue
            for p, q in ((a.position, b.position), (a.quaternion, b.quaternion)):
                same = p == q
                if not same and _differ_little(p, q):
                    return None
                layout.append(same)
    return tuple(layout)


def _differ_little(a: tuple[float, ...], b: tuple[float, ...]) -> bool:
    """Return whether values are almost equal, for quaternions also up to the sign."""
    plus = max(abs(p - q) for p, q in zip(a, b, strict=True))
    return plus < NEARLY or (len(a) == 4 and max(abs(p + q) for p, q in zip(a, b, strict=True)) < NEARLY)


def _tuple(values: Array) -> tuple[Any, ...]:
    return tuple(values.tolist())


def _mass_blocks(mass: MassProperties, wxyz: Array, *, is_free: bool) -> dict[str, np.ndarray]:
    """Return the arrays that depend on mass (kg), its place (m) and principal moments (kg m²)."""
    m, offset, principal = mass.mass, mass.position, mass.principal
    blocks = {
        "body_mass": np.array([m]),
        "body_subtreemass": np.array([m]),
        "body_inertia": principal[None],
    }
    x, y, z = offset.tolist()
    is_moved, is_turned = bool(x or y or z), bool(wxyz[0] != 1.0)
    if is_moved:  # else the family's is the same
        blocks["body_ipos"] = offset[None]
    if is_turned:
        blocks["body_iquat"] = wxyz[None]
    if not is_free:
        return blocks
    moments = principal.tolist()
    inverse = [1.0 / moment for moment in moments]
    turning, moving = sum(inverse) / 3.0, 1.0 / m
    if is_moved or is_turned:
        # The frame's origin goes with v = v_c + r x w, so to its share of 1/m come the terms of -[r] I^-1 [r]
        # (written in principal axes, where I is diagonal), and m (r r - r_i r_i) to the moments about it.
        axes = matrix_from_quaternion(mass.quaternion)
        square = x * x + y * y + z * z
        along = (offset @ axes).tolist()
        moving += sum(k * (square - a * a) for k, a in zip(inverse, along, strict=True)) / 3.0
        moments = ((axes * axes) @ principal + m * (square - offset * offset)).tolist()
    blocks["body_invweight0"] = np.array([[1.0 / m, turning]])
    blocks["dof_M0"] = np.array([m, m, m, *moments])
    blocks["dof_invweight0"] = np.array([moving, moving, moving, turning, turning, turning])
    return blocks


def _add_geom_blocks(
    blocks: dict[str, np.ndarray], family: BodyTemplate, numbers: Numbers, position: Array, wxyz: list[float]
) -> float:
    """Add the arrays that depend on the geoms' size and pose; return the radius around each geom (m)."""
    count, kinds = len(family.geoms), mujoco.mjtGeom
    a, b, c = numbers.sizes
    match family.geoms[0]["type"]:
        case kinds.mjGEOM_SPHERE:
            half, reach, b = (a, a, a), a, 0.0
        case kinds.mjGEOM_CAPSULE:
            half, reach = (a, a, a + b), a + b
        case kinds.mjGEOM_CYLINDER:
            half, reach = (a, a, b), sqrt(a * a + b * b)
        case _:
            half, reach = (a, b, c), sqrt(a * a + b * b + c * c)
    blocks["geom_size"] = np.array([(a, b, c)] * count)
    if any(numbers.pose.position):  # else the family's is the same
        blocks["geom_pos"] = np.array([numbers.pose.position] * count)
    if wxyz[0] != 1.0:
        blocks["geom_quat"] = np.array([wxyz] * count)
    blocks["geom_rbound"] = np.array([reach] * count)
    blocks["geom_aabb"] = np.array([(0.0, 0.0, 0.0, *half)] * count)
    box = _box(numbers, position, np.array(half))
    blocks["bvh_aabb"] = np.array([box] * len(family.blocks["bvh_aabb"]))
    if numbers.colors:
        blocks["geom_rgba"] = rgba = family.blocks["geom_rgba"].copy()
        rgba[family.collisions :] = numbers.colors
    return reach


def _length(mass: MassProperties, reach: float | None, pose: Pose) -> float:
    """Return the motion of the body for a rotation by 1 rad (m)."""
    centre = mass.position.tolist()
    origin = hypot(*centre)
    return max(SHORTEST, origin) if reach is None else max(origin, reach + dist(pose.position, centre))


def _box(numbers: Numbers, centre: Array, half: Array) -> list[float]:
    """Return centre and half sizes (m) of the geoms' box in the inertial frame."""
    pose, mass, turn = numbers.pose, numbers.mass, None
    if pose.quaternion != _IDENTITY:
        turn = matrix_from_quaternion(pose.quaternion)
    if mass is not None:
        centre = centre - mass.position
        if mass.quaternion[3] != 1.0:
            back = matrix_from_quaternion(mass.quaternion).T
            centre, turn = back @ centre, back if turn is None else back @ turn
    if turn is not None:
        half = np.abs(turn) @ half
    return [*centre.tolist(), *half.tolist()]
