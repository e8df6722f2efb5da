"""Materials as in Bullet: one for each name."""

from __future__ import annotations

from dataclasses import replace

from roboyard.description.model import Link, Material, RobotDescription

GREY = (0.8, 0.8, 0.8, 1.0)
"""Colour of a material that is defined without one."""


def shared_materials(description: RobotDescription) -> RobotDescription:
    """Return the description with one material per name: the last that a visual shape defines with a colour.

    Some exporters give all materials one name; Bullet then shows all links in the last one's colour. A
    reference is the same object as its definition, which distinguishes the two. Materials of a texture alone,
    and those that the robot defines by nothing but a name, are grey. Shapes without a material are shown in
    the one whose name is blank.
    """
    named = {material.name for material in description.materials}
    seen = {id(material) for material in description.materials}
    last: dict[str, Material] = {}
    has_grey = False
    for visual in (visual for link in description.links for visual in link.visuals):
        material = visual.material
        has_grey |= material is not None and _is_grey(material, named)
        if material is None or material.name is None or material.rgba is None or id(material) in seen:
            continue
        seen.add(id(material))
        last[material.name] = material
    blank = next((material for material in description.materials if material.name == ""), None)
    if blank is not None:
        last.setdefault("", blank)
    if not last and not has_grey:
        return description
    return replace(description, links=tuple(_with(link, last, named) for link in description.links))


def _with(link: Link, materials: dict[str, Material], named: set[str | None]) -> Link:
    visuals = []
    for visual in link.visuals:
        material = visual.material
        name = "" if material is None else material.name
        if name is not None:
            material = materials.get(name, material)
        if material is not None and _is_grey(material, named):
            material = replace(material, rgba=GREY)
        visuals.append(visual if material is visual.material else replace(visual, material=material))
    return replace(link, visuals=tuple(visuals))


def _is_grey(material: Material, named: set[str | None]) -> bool:
    """Return whether a material is defined without a colour; `named` are the robot's own."""
    is_defined = material.texture_uri is not None or (material.name is not None and material.name in named)
    return material.rgba is None and is_defined
