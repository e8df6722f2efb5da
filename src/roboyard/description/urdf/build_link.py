"""Build links and materials from their elements."""

from __future__ import annotations

import dataclasses
import xml.etree.ElementTree as ET
from collections.abc import Sequence
from typing import cast

from roboyard.description.model import (
    CONTACT_TAGS,
    INERTIA_KEYS,
    RGBA,
    Collision,
    Contact,
    Geometry,
    Inertial,
    Link,
    Material,
    Mesh,
    Visual,
)
from roboyard.description.urdf.build_context import (
    ORIGIN,
    BuildContext,
    children_of,
    unread_attributes,
    unread_part,
)
from roboyard.description.urdf.build_geometry import build_geometry
from roboyard.description.urdf.elements import (
    GEOMETRY_TAGS,
    InertialElement,
    LinkElement,
    MaterialElement,
    ShapeElement,
)
from roboyard.description.urdf.problems import Problems


def build_link(link: LinkElement, context: BuildContext) -> Link | None:
    """Build a link; None where it has no name, which is reported."""
    problems, element = context.problems, link.element
    if not link.name:
        problems.error(element, "link", "a <link> has no name; give it a unique name")
        return None
    visuals: list[Visual] = []
    collisions: list[Collision] = []
    found, others = children_of(element, ("inertial", "contact"))
    extra: list[ET.Element] = []
    shapes = iter(link.shapes)
    for child in others:
        if child.tag == "visual":
            visual = _visual(next(shapes), context)
            visuals += [] if visual is None else [visual]
            extra += [child] if visual is None else []
        elif child.tag == "collision":
            collision = _collision(next(shapes), context)
            collisions += [] if collision is None else [collision]
            extra += [child] if collision is None else []
        else:
            extra.append(child)
    inertial: Inertial | None = None
    if link.inertial is not None:
        inertial, unread = _inertial(link.inertial, link.who, problems)
        extra += unread
    contact: Contact | None = None
    if "contact" in found:
        contact, unread = _contact(found["contact"], link, problems)
        extra += unread
    return Link(
        name=link.name,
        inertial=inertial,
        visuals=tuple(visuals),
        collisions=tuple(collisions),
        contact=contact,
        extra=tuple(extra),
        attributes=unread_attributes(element, "name"),
        source=problems.source(element),
    )


def build_material(material: MaterialElement, problems: Problems) -> Material:
    """Build a material, global or of one visual; a missing texture is noted."""
    element, who = material.element, material.who
    found, rest = children_of(element, ("color", "texture"))
    uri = None
    problems.use(found.get("color"))
    if "color" in found and len((found["color"].get("rgba") or "").split()) == 3:
        problems.note(found["color"], who, "<color rgba> holds 3 numbers; opaque")
    if "texture" in found:
        uri = found["texture"].get("filename")
        texture = material.texture
        if texture is None:
            problems.note(found["texture"], who, "<texture> names no file; skipped")
        elif texture.path is None:
            problems.note(found["texture"], who, f"texture {uri!r}: {texture.problem}")
        elif texture.note is not None:
            problems.note(found["texture"], who, f"texture {uri!r}: {texture.note}")
    rgba = material.rgba
    return Material(
        name=element.get("name"),
        rgba=None if rgba is None else cast(RGBA, (*rgba, 1.0)[:4]),
        texture=None if material.texture is None else material.texture.path,
        texture_uri=uri,
        extra=(
            *rest,
            *unread_part(found.get("color"), ("rgba",)),
            *unread_part(found.get("texture"), ("filename",)),
        ),
    )


def resolve_materials(links: Sequence[Link], materials: Sequence[Material], problems: Problems) -> list[Link]:
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
        problems.note(visual.source.line, f'material "{name}"', "is named but nowhere defined; no colour")
    return out


def _is_bare(material: Material) -> bool:
    """True for a material that is a name alone."""
    return material.rgba is None and material.texture_uri is None


def _visual(shape: ShapeElement, context: BuildContext) -> Visual | None:
    problems, element = context.problems, shape.element
    found, rest = children_of(element, ("origin", "geometry", "material"))
    geometry = build_geometry(shape, context)
    if geometry is None:
        return None
    problems.use(found.get("origin"))
    material = found.get("material")
    return Visual(
        geometry=geometry,
        origin=shape.pose,
        material=None if material is None else build_material(context.materials[material], problems),
        name=element.get("name"),
        extra=(*rest, *_unread_shape(found)),
        attributes=unread_attributes(element, "name"),
        source=problems.source(element),
    )


def _is_concave(given: str | None, geometry: Geometry, context: BuildContext) -> bool:
    if given is None:
        return False
    if context.as_bullet:
        return isinstance(geometry, Mesh)
    return given.strip().lower() in ("yes", "true", "1")


def _collision(shape: ShapeElement, context: BuildContext) -> Collision | None:
    problems, element = context.problems, shape.element
    found, rest = children_of(element, ("origin", "geometry"))
    geometry = build_geometry(shape, context)
    if geometry is None:
        return None
    problems.use(found.get("origin"))
    return Collision(
        geometry=geometry,
        origin=shape.pose,
        name=element.get("name"),
        concave=_is_concave(element.get("concave"), geometry, context),
        extra=(*rest, *_unread_shape(found)),
        attributes=unread_attributes(element, "name", "concave"),
        source=problems.source(element),
    )


def _unread_shape(found: dict[str, ET.Element]) -> tuple[ET.Element, ...]:
    return (
        *unread_part(found.get("origin"), ORIGIN),
        *unread_part(found.get("geometry"), (), GEOMETRY_TAGS),
    )


def _inertial(
    inertial: InertialElement, who: str, problems: Problems
) -> tuple[Inertial, tuple[ET.Element, ...]]:
    """The inertial and the unread part of its element."""
    element = inertial.element
    found, _ = children_of(element, ("origin", "mass", "inertia"))
    problems.use(found.get("origin"))
    before = len(problems.errors)
    problems.use(found.get("mass"))
    if inertial.mass is None and len(problems.errors) == before:
        problems.error(element, who, '<inertial> has no mass; add <mass value="..."/> (kg)')
    if inertial.inertia is None:
        problems.note(element, who, "<inertial> has no <inertia>; the tensor is read as zero")
    else:
        problems.use(inertial.inertia)
        absent = [key for key in ("ixx", "iyy", "izz") if inertial.inertia.get(key) is None]
        if absent:
            problems.note(inertial.inertia, who, f"<inertia> has no {', '.join(absent)}; read as zero")
    unread = ET.Element("inertial", dict(element.attrib))
    unread.extend(child for child in element if child.tag not in found)
    for tag, known in (("origin", ORIGIN), ("mass", ("value",)), ("inertia", INERTIA_KEYS)):
        unread.extend(unread_part(found.get(tag), known))
    xx, xy, xz, yy, yz, zz = (moment or 0.0 for moment in inertial.moments)
    built = Inertial(
        mass=inertial.mass or 0.0,
        origin=inertial.pose,
        inertia=(xx, xy, xz, yy, yz, zz),
        source=problems.source(element),
    )
    return built, (unread,) if len(unread) or unread.attrib else ()


def _contact(
    element: ET.Element, link: LinkElement, problems: Problems
) -> tuple[Contact, tuple[ET.Element, ...]]:
    """The contact parameters and the unread part of their element."""
    found, _ = children_of(element, CONTACT_TAGS)
    for child in found.values():
        problems.use(child)
    return Contact(**link.contact), unread_part(element, (), tuple(found))
