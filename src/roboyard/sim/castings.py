"""Castings: the moulds of bodies of one simple shape, worked out from its sizes instead of compiled.

Bodies that differ in nothing but numbers (sizes, mass, inertia, poses, colours) have the same mould but for a
few arrays, which are known functions of those numbers.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import sqrt
from typing import Any

import mujoco
import numpy as np

from roboyard.poses import Array, matrix_from_quaternion, to_wxyz
from roboyard.sim.geoms import SMALLEST, paint, plain_size
from roboyard.sim.inertials import MassProperties, mass_properties
from roboyard.sim.moulds import Mould
from roboyard.sim.records import BuildOptions
from roboyard.urdf.model import RGBA, Box, Capsule, Cylinder, Pose, RobotDescription, Sphere

NEARLY = 1e-9
"""m, or of a unit quaternion: what differs by less is either the same or nothing for a casting."""
SHORTEST = 1e-5
"""m: what MuJoCo takes for the reach of a body without shapes."""
_IDENTITY = (0.0, 0.0, 0.0, 1.0)


@dataclass(kw_only=True, slots=True, eq=False)
class Numbers:
    """What tells bodies of one signature apart."""

    signature: tuple[Any, ...]
    """Everything else that tells bodies apart."""
    mass: MassProperties | None
    size: Array
    """(3,) MuJoCo's sizes of all geoms, which coincide; m"""
    pose: Pose
    """Of all geoms in the link frame."""
    colors: list[RGBA]
    """Of the visual geoms."""


def numbers_of(description: RobotDescription, options: BuildOptions) -> Numbers | None:
    """The numbers of a body of one link whose shapes, if any, coincide; None where it takes a compile."""
    link, scale = description.links[0], options.scale
    visuals = link.visuals if options.visual_geoms else ()
    shapes = (*link.collisions, *visuals)
    kind, size, pose = None, np.zeros(3), Pose()
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
        kind, size, used = plain_size(geometry, scale)
        if not used.min() > SMALLEST:
            return None
        x, y, z = origin.position
        pose = Pose(position=(x * scale, y * scale, z * scale), quaternion=origin.quaternion)
    mass = None
    if link.inertial is not None:
        mass = mass_properties(link.inertial, scale)
        if not mass.mass > 0.0 or mass.note:
            return None
    elif not options.fixed_base:
        return None
    layout = _layout(mass, pose)
    if layout is None:
        return None
    return Numbers(
        signature=(options, kind, len(link.collisions), len(visuals), link.contact, mass is None, layout),
        mass=mass,
        size=size,
        pose=pose,
        colors=[paint(visual) for visual in visuals],
    )


def cast(mould: Mould, numbers: Numbers, description: RobotDescription) -> Mould:
    """The mould of a body that differs from another's only in numbers."""
    family, mass = mould.family, numbers.mass
    position, quaternion = np.array(numbers.pose.position), to_wxyz(numbers.pose.quaternion)
    body, blocks = family.body, {}
    if mass is not None:
        wxyz = to_wxyz(mass.quaternion)
        body = body | {"mass": mass.mass, "ipos": mass.position, "iquat": wxyz, "inertia": mass.principal}
        blocks = _mass_blocks(mass, wxyz, is_free=not family.options.fixed_base)
    geoms = [fields | {"size": numbers.size, "pos": position, "quat": quaternion} for fields in family.geoms]
    for fields, color in zip(geoms[family.collisions :], numbers.colors, strict=True):
        fields["rgba"] = color
    reach = None
    if geoms:
        shape_blocks, reach = _geom_blocks(family, numbers, position, quaternion)
        blocks |= shape_blocks
    if not family.options.fixed_base:
        assert mass is not None
        length = _length(mass, reach, position)
        blocks["dof_length"] = np.array([1.0, 1.0, 1.0, length, length, length])
    return Mould(
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
        make=family.make,
        origin=family,
        varied=tuple(blocks),
    )


def _layout(mass: MassProperties | None, pose: Pose) -> tuple[bool, ...] | None:
    """Which of the link's, the geoms' and the inertial frame share an origin or axes; None if it is close.

    MuJoCo leaves out transforms between frames that are the same.
    """
    frames = [((0.0, 0.0, 0.0), _IDENTITY), (pose.position, pose.quaternion)]
    if mass is not None:
        frames.append((tuple(mass.position.tolist()), tuple(mass.quaternion.tolist())))
    layout = []
    for k, (position_a, quaternion_a) in enumerate(frames):
        for position_b, quaternion_b in frames[:k]:
            for a, b in ((position_a, position_b), (quaternion_a, quaternion_b)):
                same = a == b
                if not same and _differ_little(a, b):
                    return None
                layout.append(same)
    return tuple(layout)


def _differ_little(a: tuple[float, ...], b: tuple[float, ...]) -> bool:
    """Also of a quaternion and one that is the same rotation with the other sign."""
    plus = max(abs(p - q) for p, q in zip(a, b, strict=True))
    return plus < NEARLY or (len(a) == 4 and max(abs(p + q) for p, q in zip(a, b, strict=True)) < NEARLY)


def _mass_blocks(mass: MassProperties, wxyz: Array, *, is_free: bool) -> dict[str, np.ndarray]:
    """Arrays that follow from the mass, its place (m) and the principal moments (kg m²)."""
    m, offset, principal = mass.mass, mass.position, mass.principal
    blocks = {
        "body_mass": np.array([m]),
        "body_subtreemass": np.array([m]),
        "body_inertia": principal[None],
        "body_ipos": offset[None],
        "body_iquat": wxyz[None],
    }
    if not is_free:
        return blocks
    turning = float((1.0 / principal).sum()) / 3.0
    blocks["body_invweight0"] = np.array([[1.0 / m, turning]])
    moving, moments = 1.0 / m, principal
    if offset.any() or mass.quaternion[3] != 1.0:
        # of the body frame's origin: v = v_c + r x w, so M^-1 has 1/m - [r] I^-1 [r] for its translation
        axes = matrix_from_quaternion(mass.quaternion)
        x, y, z = offset.tolist()
        cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
        inverse = (axes / principal) @ axes.T
        moving -= float(np.trace(cross @ inverse @ cross)) / 3.0
        moments = np.diag((axes * principal) @ axes.T - m * cross @ cross)
    blocks["dof_M0"] = np.concatenate([np.full(3, m), moments])
    blocks["dof_invweight0"] = np.repeat([moving, turning], 3)
    return blocks


def _geom_blocks(
    family: Mould, numbers: Numbers, position: Array, quaternion: Array
) -> tuple[dict[str, Any], float]:
    """Arrays that follow from the geoms' common size and pose, and the radius around each geom (m)."""
    count, size = len(family.geoms), numbers.size
    kinds = mujoco.mjtGeom
    a, b, c = size.tolist()
    match family.geoms[0]["type"]:
        case kinds.mjGEOM_SPHERE:
            half, reach, size = np.array([a, a, a]), a, np.array([a, 0.0, 0.0])
        case kinds.mjGEOM_CAPSULE:
            half, reach = np.array([a, a, a + b]), a + b
        case kinds.mjGEOM_CYLINDER:
            half, reach = np.array([a, a, b]), sqrt(a * a + b * b)
        case _:
            half, reach = size, sqrt(a * a + b * b + c * c)
    blocks = {
        "geom_size": np.repeat(size[None], count, axis=0),
        "geom_pos": np.repeat(position[None], count, axis=0),
        "geom_quat": np.repeat(quaternion[None], count, axis=0),
        "geom_rbound": np.full(count, reach),
        "geom_aabb": np.repeat(np.concatenate([np.zeros(3), half])[None], count, axis=0),
        "bvh_aabb": np.repeat(_box(numbers, half)[None], len(family.blocks["bvh_aabb"]), axis=0),
    }
    if numbers.colors:
        rgba = family.blocks["geom_rgba"].copy()
        rgba[family.collisions :] = numbers.colors
        blocks["geom_rgba"] = rgba
    return blocks, reach


def _length(mass: MassProperties, reach: float | None, position: Array) -> float:
    """How far the body goes when it turns by 1 rad: what MuJoCo weighs rotations with; m."""
    origin = float(np.linalg.norm(mass.position))
    if reach is None:
        return max(SHORTEST, origin)
    return max(origin, reach + float(np.linalg.norm(position - mass.position)))


def _box(numbers: Numbers, half: Array) -> Array:
    """(6,) centre and half sizes of the geoms' box in the inertial frame; m."""
    pose, mass = numbers.pose, numbers.mass
    centre, turn = np.array(pose.position), None
    if pose.quaternion != _IDENTITY:
        turn = matrix_from_quaternion(pose.quaternion)
    if mass is not None:
        centre = centre - mass.position
        if mass.quaternion[3] != 1.0:
            back = matrix_from_quaternion(mass.quaternion).T
            centre, turn = back @ centre, back if turn is None else back @ turn
    if turn is not None:
        half = np.abs(turn) @ half
    return np.concatenate([centre, half])
