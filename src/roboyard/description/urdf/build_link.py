"""Read a `<link>` and `<material>`."""

from __future__ import annotations

import dataclasses
import xml.etree.ElementTree as ET
from collections.abc import Sequence
from pathlib import Path
from typing import cast

from roboyard.description.model import (
    CONTACT_TAGS,
    INERTIA_KEYS,
    RGBA,
    Collision,
    Contact,
    Inertial,
    Link,
    Material,
    Visual,
)
from roboyard.description.urdf.build_context import (
    Context,
    children_of,
    read_pose,
    unread_attributes,
    unread_part,
)
from roboyard.description.urdf.build_geometry import GEOMETRY_TAGS, read_geometry
from roboyard.description.urdf.numbers import read_number, read_vector
from roboyard.description.urdf.problems import Problems


def read_link(element: ET.Element, context: Context) -> Link | None:
    """The link; None where it has no name, which is reported."""
    problems = context.problems
    name = element.get("name")
    if not name:
        problems.error(element, "link", "a <link> has no name; give it a unique name")
        return None
    who = f'link "{name}"'
    visuals: list[Visual] = []
    collisions: list[Collision] = []
    found, others = children_of(element, ("inertial", "contact"))
    extra: list[ET.Element] = []
    for child in others:
        if child.tag == "visual":
            visual = _read_visual(child, who, context)
            visuals += [] if visual is None else [visual]
            extra += [child] if visual is None else []
        elif child.tag == "collision":
            collision = _read_collision(child, who, context)
            collisions += [] if collision is None else [collision]
            extra += [child] if collision is None else []
        else:
            extra.append(child)
    inertial, unread_inertial = _read_inertial(found.get("inertial"), who, problems)
    contact, unread_contact = _read_contact(found.get("contact"), who, problems)
    return Link(
        name=name,
        inertial=inertial,
        visuals=tuple(visuals),
        collisions=tuple(collisions),
        contact=contact,
        extra=(*extra, *unread_inertial, *unread_contact),
        attributes=unread_attributes(element, "name"),
        source=problems.source(element),
    )


def read_material(element: ET.Element, context: Context) -> Material:
    """A `<material>`, global or of one visual; its texture is looked for, and noted where it is missing."""
    problems = context.problems
    name = element.get("name")
    who = f'material "{name or ""}"'
    found, rest = children_of(element, ("color", "texture"))
    rgba = _read_color(found.get("color"), who, problems)
    texture, uri = None, None
    if "texture" in found:
        uri = found["texture"].get("filename")
        texture = _find_texture(uri, found["texture"], who, context)
    return Material(
        name=name,
        rgba=rgba,
        texture=texture,
        texture_uri=uri,
        extra=(
            *rest,
            *unread_part(found.get("color"), ("rgba",)),
            *unread_part(found.get("texture"), ("filename",)),
        ),
    )


def resolve_materials(links: Sequence[Link], materials: Sequence[Material], context: Context) -> list[Link]:
    """Give each visual that only names its material the definition of that name.

    Definitions are the robot's global materials, else the first visual that defines the name.
    """
    defined: dict[str, Material] = {}
    in_visuals = [visual.material for link in links for visual in link.visuals]
    for material in (*materials, *in_visuals):
        if material is not None and material.name and not _is_bare(material):
            defined.setdefault(material.name, material)
    unknown: dict[str, Visual] = {}

    def resolved(visual: Visual) -> Visual:
        material = visual.material
        if material is None or not material.name or not _is_bare(material):
            return visual
        if material.name not in defined:
            unknown.setdefault(material.name, visual)
            return visual
        return dataclasses.replace(visual, material=defined[material.name])

    out = [dataclasses.replace(link, visuals=tuple(map(resolved, link.visuals))) for link in links]
    for name, visual in unknown.items():
        context.problems.note(
            visual.source.line, f'material "{name}"', "is named but nowhere defined; no colour"
        )
    return out


def _is_bare(material: Material) -> bool:
    """True for a material that is a name alone."""
    return material.rgba is None and material.texture_uri is None


def _read_color(element: ET.Element | None, who: str, problems: Problems) -> RGBA | None:
    if element is None:
        return None
    text = element.get("rgba")
    if text is not None and len(text.split()) == 3:
        rgb = read_vector(element, "rgba", 3, who, problems)
        problems.note(element, who, "<color rgba> holds 3 numbers; opaque")
        return None if rgb is None else (rgb[0], rgb[1], rgb[2], 1.0)
    return cast(RGBA | None, read_vector(element, "rgba", 4, who, problems))


def _find_texture(uri: str | None, element: ET.Element, who: str, context: Context) -> Path | None:
    if not uri:
        context.problems.note(element, who, "<texture> names no file; left out")
        return None
    resolved = context.resolver.resolve(uri)
    if resolved.path is None:
        context.problems.note(element, who, f"texture {uri!r}: {resolved.problem}")
    elif resolved.note is not None:
        context.problems.note(element, who, f"texture {uri!r}: {resolved.note}")
    return resolved.path


def _read_visual(element: ET.Element, who: str, context: Context) -> Visual | None:
    problems = context.problems
    found, rest = children_of(element, ("origin", "geometry", "material"))
    geometry = read_geometry(found.get("geometry"), element, who, context)
    if geometry is None:
        return None
    material = found.get("material")
    return Visual(
        geometry=geometry,
        origin=read_pose(found.get("origin"), who, problems),
        material=None if material is None else read_material(material, context),
        name=element.get("name"),
        extra=(*rest, *_unread_shape(found)),
        attributes=unread_attributes(element, "name"),
        source=problems.source(element),
    )


def _read_collision(element: ET.Element, who: str, context: Context) -> Collision | None:
    problems = context.problems
    found, rest = children_of(element, ("origin", "geometry"))
    geometry = read_geometry(found.get("geometry"), element, who, context)
    if geometry is None:
        return None
    return Collision(
        geometry=geometry,
        origin=read_pose(found.get("origin"), who, problems),
        name=element.get("name"),
        concave=element.get("concave", "").strip().lower() in ("yes", "true", "1"),
        extra=(*rest, *_unread_shape(found)),
        attributes=unread_attributes(element, "name", "concave"),
        source=problems.source(element),
    )


def _unread_shape(found: dict[str, ET.Element]) -> tuple[ET.Element, ...]:
    return (
        *unread_part(found.get("origin"), ("xyz", "rpy", "quat_xyzw")),
        *unread_part(found.get("geometry"), (), GEOMETRY_TAGS),
    )


def _read_inertial(
    element: ET.Element | None, who: str, problems: Problems
) -> tuple[Inertial | None, tuple[ET.Element, ...]]:
    if element is None:
        return None, ()
    found, _ = children_of(element, ("origin", "mass", "inertia"))
    origin = read_pose(found.get("origin"), who, problems)
    mass = None
    before = len(problems.errors)
    if "mass" in found:
        mass = read_number(found["mass"], "value", who, problems)
    if mass is None and len(problems.errors) == before:
        problems.error(element, who, '<inertial> has no mass; add <mass value="..."/> (kg)')
    tensor = [0.0] * 6
    if "inertia" not in found:
        problems.note(element, who, "<inertial> has no <inertia>; the tensor is read as zero")
    else:
        values = [read_number(found["inertia"], key, who, problems) for key in INERTIA_KEYS]
        tensor = [value or 0.0 for value in values]
        absent = [key for key in ("ixx", "iyy", "izz") if found["inertia"].get(key) is None]
        if absent:
            problems.note(found["inertia"], who, f"<inertia> has no {', '.join(absent)}; read as zero")
    unread = ET.Element("inertial", dict(element.attrib))
    unread.extend(child for child in element if child.tag not in found)
    for tag, known in (
        ("origin", ("xyz", "rpy", "quat_xyzw")),
        ("mass", ("value",)),
        ("inertia", INERTIA_KEYS),
    ):
        unread.extend(unread_part(found.get(tag), known))
    left = (unread,) if len(unread) or unread.attrib else ()
    inertial = Inertial(
        mass=mass or 0.0,
        origin=origin,
        inertia=(tensor[0], tensor[1], tensor[2], tensor[3], tensor[4], tensor[5]),
        source=problems.source(element),
    )
    return inertial, left


def _read_contact(
    element: ET.Element | None, who: str, problems: Problems
) -> tuple[Contact | None, tuple[ET.Element, ...]]:
    if element is None:
        return None, ()
    found, _ = children_of(element, CONTACT_TAGS)
    values = {tag: read_number(child, "value", who, problems) for tag, child in found.items()}
    return Contact(**values), unread_part(element, (), tuple(found))
