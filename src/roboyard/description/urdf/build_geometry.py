"""Build geometries from the elements of visuals and collisions."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from typing import cast

from roboyard.description.model import FLAT, Box, Capsule, Cylinder, Geometry, Mesh, Plane, Sphere, Vector3
from roboyard.description.urdf.build_context import BuildContext
from roboyard.description.urdf.elements import GEOMETRY_TAGS, MeshElement, ShapeElement
from roboyard.description.urdf.problems import Problems


def build_geometry(shape: ShapeElement, context: BuildContext) -> Geometry | None:
    """Build the geometry of a visual or collision; None where it is empty (noted) or wrong (reported)."""
    problems, geometry = context.problems, shape.geometry
    holder = shape.element.find("geometry")
    if geometry is None:
        at = shape.element if holder is None else holder
        problems.note(at, shape.who, f"<{shape.kind}> has no geometry; it is ignored")
        return None
    match geometry.tag:
        case "box":
            if not _is_usable(geometry, "size", shape, shape.sizes, problems):
                return None
            return Box(size=cast(Vector3, shape.sizes))
        case "sphere":
            if not _is_usable(geometry, "radius", shape, shape.sizes, problems):
                return None
            return Sphere(radius=cast(float, shape.sizes[0]))
        case "cylinder" | "capsule":
            usable = [
                _is_usable(geometry, key, shape, (size,), problems)
                for key, size in zip(("radius", "length"), shape.sizes, strict=True)
            ]
            if not all(usable):
                return None
            radius, length = cast(tuple[float, float], shape.sizes)
            kind = Cylinder if geometry.tag == "cylinder" else Capsule
            return kind(radius=radius, length=length)
        case "plane":
            problems.use(geometry)
            normal = shape.normal or (0.0, 0.0, 1.0)
            if not any(normal):
                message = "<plane> has a normal of zero length; give a direction"
                problems.error(geometry, shape.who, message)
                return None
            return Plane(normal=cast(Vector3, normal))
        case _:
            if shape.mesh is not None:
                return _mesh(shape.mesh, shape.who, context)
            known = ", ".join(GEOMETRY_TAGS)
            problems.error(holder, shape.who, f"unknown geometry <{geometry.tag}>; give one of {known}")
            return None


def _mesh(mesh: MeshElement, who: str, context: BuildContext) -> Mesh | None:
    problems, element, scale = context.problems, mesh.element, mesh.scale
    if not mesh.uri.strip():
        problems.error(element, who, '<mesh> names no file; add filename="..."')
        return None
    is_readable, text = problems.use(element), element.get("scale")
    if text is not None and len(text.split()) == 1 and is_readable:
        message = f"<mesh scale> holds one number; {scale[0]:g} is taken for all three axes"
        problems.note(element, who, message)
    if not all(scale) and context.as_bullet:
        scale = tuple(factor or FLAT for factor in scale)
        problems.note(element, who, f'<mesh scale="{text}"> flattens the mesh')
    elif not all(scale):
        problems.error(element, who, f'<mesh scale="{text}"> flattens the mesh; give factors other than zero')
    if mesh.found.path is None:
        report = problems.error if context.missing_meshes == "error" else problems.note
        report(element, who, f"mesh {mesh.uri!r}: {mesh.found.problem}")
    elif mesh.found.note is not None:
        problems.note(element, who, f"mesh {mesh.uri!r}: {mesh.found.note}")
    return Mesh(uri=mesh.uri, path=mesh.found.path, scale=cast(Vector3, scale))


def _is_usable(
    element: ET.Element, key: str, shape: ShapeElement, sizes: tuple[float | None, ...], problems: Problems
) -> bool:
    """True where the sizes that an attribute holds are given and not negative; else that is reported."""
    if element.get(key) is None:
        problems.error(element, shape.who, f"<{element.tag}> has no {key}; add it (m)")
        return False
    problems.use(element, key)
    known = [size for size in sizes if size is not None]
    if len(known) < len(sizes):
        return False
    if min(known) < 0:
        shown = " ".join(f"{size:g}" for size in known)
        message = f"<{element.tag}> has a negative size ({shown}); give lengths above zero"
        problems.error(element, shape.who, message)
        return False
    return True
