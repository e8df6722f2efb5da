"""Read a `<geometry>`."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from typing import cast

from roboyard.description.model import Box, Capsule, Cylinder, Geometry, Mesh, Plane, Sphere, Vector3
from roboyard.description.urdf.build_context import Context
from roboyard.description.urdf.numbers import read_number, read_vector
from roboyard.description.urdf.problems import Problems

GEOMETRY_TAGS = ("box", "sphere", "cylinder", "capsule", "plane", "mesh")


def read_geometry(
    element: ET.Element | None, shape: ET.Element, who: str, context: Context
) -> Geometry | None:
    """The geometry of a `<visual>` or `<collision>` (`shape`); None where it is empty (noted) or wrong."""
    problems = context.problems
    if element is None or not any(isinstance(child.tag, str) for child in element):
        at = shape if element is None else element
        problems.note(at, who, f"<{shape.tag}> has no geometry; it is ignored")
        return None
    child = next((child for child in element if child.tag in GEOMETRY_TAGS), None)
    if child is None:
        tag = next(child.tag for child in element if isinstance(child.tag, str))
        known = ", ".join(GEOMETRY_TAGS)
        problems.error(element, who, f"unknown geometry <{tag}>; give one of {known}")
        return None
    match child.tag:
        case "box":
            size = _vector(child, "size", who, problems)
            return None if size is None or _is_negative(child, size, who, problems) else Box(size=size)
        case "sphere":
            radius = _number(child, "radius", who, problems)
            return None if radius is None else Sphere(radius=radius)
        case "cylinder" | "capsule":
            radius, length = (_number(child, key, who, problems) for key in ("radius", "length"))
            if radius is None or length is None:
                return None
            kind = Cylinder if child.tag == "cylinder" else Capsule
            return kind(radius=radius, length=length)
        case "plane":
            normal = read_vector(child, "normal", 3, who, problems) or (0.0, 0.0, 1.0)
            if not any(normal):
                problems.error(child, who, "<plane> has a normal of zero length; give a direction")
                return None
            return Plane(normal=cast(Vector3, normal))
        case _:
            return _read_mesh(child, who, context)


def _read_mesh(element: ET.Element, who: str, context: Context) -> Mesh | None:
    problems = context.problems
    uri = element.get("filename")
    if not uri or not uri.strip():
        problems.error(element, who, '<mesh> names no file; add filename="..."')
        return None
    scale = _read_scale(element, who, problems)
    resolved = context.resolver.resolve(uri)
    if resolved.path is None:
        report = problems.error if context.missing_meshes == "error" else problems.note
        report(element, who, f"mesh {uri!r}: {resolved.problem}")
    elif resolved.note is not None:
        problems.note(element, who, f"mesh {uri!r}: {resolved.note}")
    return Mesh(uri=uri, path=resolved.path, scale=scale)


def _read_scale(element: ET.Element, who: str, problems: Problems) -> Vector3:
    text = element.get("scale")
    if text is not None and len(text.split()) == 1:
        factor = read_number(element, "scale", who, problems)
        if factor is None:
            return (1.0, 1.0, 1.0)
        problems.note(element, who, f"<mesh scale> holds one number; {factor:g} is taken for all three axes")
        scale = (factor, factor, factor)
    else:
        scale = cast(Vector3, read_vector(element, "scale", 3, who, problems) or (1.0, 1.0, 1.0))
    if not all(scale):
        problems.error(element, who, f'<mesh scale="{text}"> flattens the mesh; give factors other than zero')
    return scale


def _vector(element: ET.Element, key: str, who: str, problems: Problems) -> Vector3 | None:
    if element.get(key) is None:
        problems.error(element, who, f"<{element.tag}> has no {key}; add it (m)")
        return None
    return cast(Vector3 | None, read_vector(element, key, 3, who, problems))


def _number(element: ET.Element, key: str, who: str, problems: Problems) -> float | None:
    if element.get(key) is None:
        problems.error(element, who, f"<{element.tag}> has no {key}; add it (m)")
        return None
    value = read_number(element, key, who, problems)
    return None if value is None or _is_negative(element, (value,), who, problems) else value


def _is_negative(element: ET.Element, values: tuple[float, ...], who: str, problems: Problems) -> bool:
    if min(values) >= 0:
        return False
    shown = " ".join(f"{value:g}" for value in values)
    problems.error(element, who, f"<{element.tag}> has a negative size ({shown}); give lengths above zero")
    return True
