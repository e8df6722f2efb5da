"""Scales and units of meshes."""

from __future__ import annotations

import numpy as np

from roboyard.audit.checks.meshes import file_name, first_uses
from roboyard.audit.findings import ERROR, INFO, WARNING
from roboyard.audit.registry import Fault, Faults, check
from roboyard.description.urdf.elements import ShapeElement
from roboyard.description.urdf.parse import UrdfElements
from roboyard.description.urdf.xml import line_of
from roboyard.transforms import Array

UNITS = (
    (1000.0, "millimetres"),
    (100.0, "centimetres"),
    (39.3701, "inches"),
    (25.4, "inches in millimetres"),
)


@check(
    "mesh-scale-zero",
    ERROR,
    remedy="give factors other than zero",
    example='<mesh scale="1 0 1" .../>',
)
def mesh_scale_zero(urdf: UrdfElements) -> Faults:
    """A mesh's scale is zero along some axis."""
    for shape, mesh in urdf.mesh_shapes:
        if not all(mesh.scale):
            shown = " ".join(f"{factor:g}" for factor in mesh.scale)
            yield Fault(
                at=shape, line=line_of(mesh.element), message=f"mesh scale ({shown}) flattens the mesh"
            )


@check(
    "mesh-scale-single",
    INFO,
    remedy="write three numbers",
    fixable=True,
    example='<mesh scale="0.001" .../>',
)
def mesh_scale_single(urdf: UrdfElements) -> Faults:
    """A mesh's scale is one number; Roboyard takes it for all three axes, others refuse it."""
    for shape, mesh in urdf.mesh_shapes:
        if len((mesh.element.get("scale") or "").split()) == 1:
            message = f"mesh scale is one number ({mesh.element.get('scale')})"
            yield Fault(at=shape, line=line_of(mesh.element), message=message)


@check(
    "mesh-scale-negative",
    INFO,
    remedy="nothing to do in Roboyard; export the mesh mirrored where another program turns it inside out",
    example='<mesh scale="1 -1 1" .../>',
)
def mesh_scale_negative(urdf: UrdfElements) -> Faults:
    """A mesh is mirrored by a negative scale; some programs turn it inside out."""
    for shape, mesh, more in first_uses(urdf):
        if min(mesh.scale) < 0:
            shown = " ".join(f"{factor:g}" for factor in mesh.scale)
            message = f"mesh {mesh.uri!r} is mirrored by its scale ({shown}){more}"
            yield Fault(at=shape, line=line_of(mesh.element), message=message)


@check(
    "mesh-huge",
    ERROR,
    remedy="give sizes in metres",
    example='<mesh scale="1e9 1e9 1e9" .../>',
)
def mesh_huge(urdf: UrdfElements) -> Faults:
    """A mesh is over 10 km large as scaled: its scale is wrong."""
    for shape, mesh in urdf.mesh_shapes:
        if mesh.extents is not None and mesh.extents.max() > 1e4:
            message = f"mesh {file_name(mesh)} is {mesh.extents.max():.3g} m large as scaled"
            yield Fault(at=shape, line=line_of(mesh.element), message=message)


@check(
    "mesh-units",
    WARNING,
    remedy='set its scale, as in scale="0.001 0.001 0.001" for millimetres, or export it in metres',
    example="(a gripper of 90 m on an arm that reaches 0.6 m)",
)
def mesh_units(urdf: UrdfElements) -> Faults:
    """A mesh is over 5 m large and over 20 times as large as the robot's reach: millimetres or inches."""
    reach = urdf.reach
    if reach <= 0:
        return
    for shape, mesh in urdf.mesh_shapes:
        size = 0.0 if mesh.extents is None else float(mesh.extents.max())
        if 5.0 < size <= 1e4 and size > 20.0 * reach:
            guess = "millimetres" if size / 1000.0 > 0.02 * reach else "another unit"
            message = (
                f"mesh {file_name(mesh)} is {size:.3g} m large as scaled, the robot reaches {reach:.3g} m; "
                f"its unit may be {guess}, or inches ({size / 1000:.3g} m or {size * 0.0254:.3g} m then)"
            )
            yield Fault(at=shape, line=line_of(mesh.element), message=message)


@check(
    "mesh-tiny",
    WARNING,
    remedy="correct its scale; the file may be in metres already",
    example='(a mesh in metres with scale="0.001 0.001 0.001")',
)
def mesh_tiny(urdf: UrdfElements) -> Faults:
    """A mesh is under 1 mm large as scaled, on a robot over 200 times as large: scaled twice."""
    for shape, mesh in urdf.mesh_shapes:
        size = None if mesh.extents is None else float(mesh.extents.max())
        if size is not None and size < 1e-3 and urdf.reach > 200.0 * size:
            message = f"mesh {file_name(mesh)} is {size * 1000:.3g} mm large as scaled"
            yield Fault(at=shape, line=line_of(mesh.element), message=message)


def unit_slip(shapes: list[ShapeElement], others: list[ShapeElement]) -> tuple[float, str] | None:
    """(factor, unit) by which a link's one kind of shapes is larger than the other along every axis."""
    ours, theirs = _extents(shapes), _extents(others)
    if ours is None or theirs is None or theirs.min() < 1e-6:
        return None
    ratio = np.sort(ours) / np.sort(theirs)
    for factor, unit in UNITS:
        if (np.abs(ratio / factor - 1.0) < 0.1).all():
            return factor, unit
    return None


def _extents(shapes: list[ShapeElement]) -> Array | None:
    """(3,) of the box round the shapes of one link, origins left aside."""
    boxes = [shape.bounds for shape in shapes]
    known = [box for box in boxes if box is not None]
    if not known or len(known) < len(boxes):
        return None
    return np.max([box[1] - box[0] for box in known], axis=0)


@check(
    "mesh-units-differ",
    WARNING,
    remedy="divide its scale by the factor",
    fixable=True,
    example="(a collision mesh 1000 times as large as the visual one of the same link)",
)
def mesh_units_differ(urdf: UrdfElements) -> Faults:
    """A link's collision shape is larger or smaller than its visual one by just 1000, 100, 39.37 or 25.4."""
    for link in urdf.links:
        for big, small in ((link.collisions, link.visuals), (link.visuals, link.collisions)):
            slip = unit_slip(big, small)
            if slip is not None:
                factor, unit = slip
                what = f"its {big[0].kind} shapes are {factor:g} times as large as its {small[0].kind} ones"
                sure = factor == 1000.0 and is_plainly_in_millimetres(big, small)
                yield Fault(at=link, line=big[0].line, message=f"{what} ({unit})", fixable=sure)


def is_plainly_in_millimetres(big: list[ShapeElement], small: list[ShapeElement]) -> bool:
    """True where the larger shapes are meshes over 3 m and the smaller ones are not."""
    return all(shape.mesh is not None for shape in big) and _size(big) > 3.0 > _size(small)


def _size(shapes: list[ShapeElement]) -> float:
    extents = _extents(shapes)
    return 0.0 if extents is None else float(extents.max())
