"""Materials as in Bullet: one for each name."""

from __future__ import annotations

from dataclasses import replace

from roboyard.description.model import Link, Material, RobotDescription


def shared_materials(description: RobotDescription) -> RobotDescription:
    """Return the description with one material per name: the last that a visual shape defines with a colour.

    Some exporters give all materials one name; Bullet then shows all links in the last one's colour. A
    reference is the same object as its definition, which distinguishes the two.
    """
    seen = {id(material) for material in description.materials}
    last: dict[str, Material] = {}
    for visual in (visual for link in description.links for visual in link.visuals):
        material = visual.material
        if material is None or material.name is None or material.rgba is None or id(material) in seen:
            continue
        seen.add(id(material))
        last[material.name] = material
    if not last:
        return description
    return replace(description, links=tuple(_with(link, last) for link in description.links))


def _with(link: Link, materials: dict[str, Material]) -> Link:
    visuals = []
    for visual in link.visuals:
        name = visual.material.name if visual.material is not None else None
        found = materials.get(name) if name is not None else None
        visuals.append(
            visual if found is None or found is visual.material else replace(visual, material=found)
        )
    return replace(link, visuals=tuple(visuals))
