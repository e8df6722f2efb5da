"""Colours and textures of SDF's visuals."""

from __future__ import annotations

import xml.etree.ElementTree as ET

from roboyard.description.sdf.parts import colour_element, prefixed
from roboyard.description.sdf.values import made, number_of, numbers_of, text_of
from roboyard.description.urdf.xml import LocatedElement

GAZEBO_COLOURS = {
    "black": (0.0, 0.0, 0.0),
    "blue": (0.0, 0.0, 1.0),
    "darkgray": (0.175, 0.175, 0.175),
    "darkgrey": (0.175, 0.175, 0.175),
    "darkyellow": (0.7, 0.7, 0.0),
    "flatblack": (0.1, 0.1, 0.1),
    "gold": (0.8, 0.649, 0.121),
    "gray": (0.7, 0.7, 0.7),
    "green": (0.0, 1.0, 0.0),
    "grey": (0.7, 0.7, 0.7),
    "indigo": (0.33, 0.0, 0.5),
    "orange": (1.0, 0.509, 0.047),
    "purple": (1.0, 0.0, 1.0),
    "red": (1.0, 0.0, 0.0),
    "skyblue": (0.13, 0.44, 0.7),
    "turquoise": (0.0, 1.0, 1.0),
    "white": (1.0, 1.0, 1.0),
    "yellow": (1.0, 1.0, 0.0),
}
"""Name in `Gazebo/Name`, in lower case, to red, green and blue."""


def material_element(visual: ET.Element, prefix: str) -> LocatedElement | None:
    """Return the `<material>` of a visual; None where it states no colour and no texture.

    Args:
        visual: SDF's element.
        prefix: of file names (see `description.sdf.parts`).
    """
    material = visual.find("material")
    colour = None if material is None else _colour(material)
    texture = None
    for way in ("pbr/metal/albedo_map", "pbr/specular/albedo_map"):
        texture = texture or text_of(material, way)
    if colour is None and texture is None:
        return None
    red, green, blue, alpha = colour or (1.0, 1.0, 1.0, 1.0)
    clear = min(max(number_of(visual, "transparency", 0.0), 0.0), 1.0)
    made_of = colour_element(visual, f"{red!r} {green!r} {blue!r} {alpha * (1.0 - clear)!r}")
    if texture is not None:
        made_of.append(made("texture", visual, filename=prefixed(texture, prefix)))
    return made_of


def _colour(material: ET.Element) -> tuple[float, float, float, float] | None:
    for tag in ("diffuse", "ambient"):
        tokens = (text_of(material, tag) or "").replace(",", " ").split()
        numbers = numbers_of(" ".join([*tokens, "1"][:4]), 4)
        if numbers is not None:
            red, green, blue, alpha = (min(max(number, 0.0), 1.0) for number in numbers)
            return red, green, blue, alpha
    name = (text_of(material, "script/name") or "").rpartition("/")[2].lower()
    known = GAZEBO_COLOURS.get(name)
    return None if known is None else (*known, 1.0)
