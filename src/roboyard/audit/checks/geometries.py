"""Geometries of visuals and collisions."""

from __future__ import annotations

from roboyard.audit.findings import ERROR, INFO, WARNING
from roboyard.audit.registry import Fault, Faults, check
from roboyard.description.urdf.elements import PRIMITIVES
from roboyard.description.urdf.parse import UrdfElements
from roboyard.description.urdf.xml import line_of

NOTHING = 1e-9
"""m: below this a length is zero."""
_SIZES = {
    "box": ("size",),
    "sphere": ("radius",),
    "cylinder": ("radius", "length"),
    "capsule": ("radius", "length"),
}


@check(
    "geometry-missing",
    INFO,
    remedy="remove the element, or give it a shape",
    fixable=True,
    example="<visual><geometry/></visual>",
)
def geometry_missing(urdf: UrdfElements) -> Faults:
    """A visual or collision has no shape; it is ignored."""
    for shape in urdf.shapes:
        if shape.geometry is None:
            yield Fault(at=shape, message=f"<{shape.kind}> has no geometry; it is ignored")


@check(
    "geometry-unknown",
    ERROR,
    remedy=f"give one of {', '.join((*PRIMITIVES, 'mesh'))}",
    example="<geometry><cone .../></geometry>",
)
def geometry_unknown(urdf: UrdfElements) -> Faults:
    """A geometry is not one of URDF or Bullet."""
    for shape in urdf.shapes:
        if shape.geometry is not None and shape.geometry.tag not in (*PRIMITIVES, "mesh"):
            message = f"unknown geometry <{str(shape.geometry.tag)[:60]}> in its {shape.kind}"
            yield Fault(at=shape, line=line_of(shape.geometry), message=message)


@check(
    "geometry-size-missing",
    ERROR,
    remedy="add it, in metres",
    example="<sphere/>",
)
def geometry_size_missing(urdf: UrdfElements) -> Faults:
    """A primitive lacks a size."""
    for shape in urdf.shapes:
        if shape.geometry is not None:
            absent = [
                k for k in _SIZES.get(shape.geometry.tag, ()) if not (shape.geometry.get(k) or "").strip()
            ]
            if absent:
                message = f"<{shape.geometry.tag}> in its {shape.kind} has no {' and no '.join(absent)}"
                yield Fault(at=shape, line=line_of(shape.geometry), message=message)


@check("geometry-size-negative", ERROR, remedy="give lengths above zero", example='<sphere radius="-0.1"/>')
def geometry_size_negative(urdf: UrdfElements) -> Faults:
    """A primitive has a negative size."""
    for shape in urdf.shapes:
        if shape.size is not None and shape.geometry is not None and min(shape.size) < 0:
            shown = " ".join(f"{value:g}" for value in shape.size)
            message = f"<{shape.geometry.tag}> in its {shape.kind} has a negative size ({shown})"
            yield Fault(at=shape, line=line_of(shape.geometry), message=message)


@check(
    "geometry-size-zero",
    WARNING,
    remedy="give lengths above zero, or remove the shape",
    example='<box size="0.1 0 0.1"/>',
)
def geometry_size_zero(urdf: UrdfElements) -> Faults:
    """A primitive has no extent along some axis."""
    for shape in urdf.shapes:
        if shape.size is not None and shape.geometry is not None and 0 <= min(shape.size) < NOTHING:
            if shape.geometry.tag == "capsule" and shape.size[0] >= NOTHING:
                continue  # a capsule of no length is a sphere
            shown = " ".join(f"{value:g}" for value in shape.size)
            message = f"<{shape.geometry.tag}> in its {shape.kind} has a size of zero ({shown})"
            yield Fault(at=shape, line=line_of(shape.geometry), message=message)


@check(
    "geometry-size-implausible",
    WARNING,
    remedy="give sizes in metres",
    example='<sphere radius="50"/> on an arm of 0.5 m',
)
def geometry_size_implausible(urdf: UrdfElements) -> Faults:
    """A primitive on a jointed robot is over 20 m large and over 20 times as large as the robot's reach."""
    reach = urdf.reach
    for shape in urdf.shapes:
        if shape.mesh is None and shape.size is not None and shape.geometry is not None and reach > 0:
            size = max(shape.size)
            if size > 20.0 and size > 20.0 * reach:
                what = f"<{shape.geometry.tag}> in its {shape.kind}"
                message = f"{what} is {size:g} m large, but the robot reaches {reach:.3g} m"
                yield Fault(at=shape, line=line_of(shape.geometry), message=message)
