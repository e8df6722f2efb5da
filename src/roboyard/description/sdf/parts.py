"""Inertias, shapes and axes of SDF as URDF elements; for robots, and for PyBullet's worlds."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Mapping

from roboyard.description.model import INERTIA_KEYS
from roboyard.description.sdf.values import joined, made, text_of
from roboyard.description.urdf.xml import LocatedElement
from roboyard.transforms import Array

SHAPES: Mapping[str, Mapping[str, str]] = {
    "sphere": {"radius": "radius"},
    "box": {"size": "size"},
    "cylinder": {"radius": "radius", "length": "length"},
    "capsule": {"radius": "radius", "length": "length"},
    "mesh": {"uri": "filename", "scale": "scale"},
    "plane": {"normal": "normal"},
}
"""SDF shape to its child elements and the URDF attributes that they become."""


def inertial_element(
    inertial: ET.Element, origin: ET.Element, *, mass: str = "0", moment: str = "0"
) -> LocatedElement:
    """Return an `<inertial>`.

    Args:
        inertial: SDF's element.
        origin: of the centre of mass in the link frame.
        mass: where the file gives none (kg).
        moment: about x, y and z, where the file gives none (kg m²).
    """
    part = made("inertial", inertial)
    part.append(origin)
    part.append(made("mass", inertial, value=text_of(inertial, "mass") or mass))
    tensor = inertial.find("inertia")
    values = {
        key: text_of(tensor, key) or (moment if key in ("ixx", "iyy", "izz") else "0") for key in INERTIA_KEYS
    }
    part.append(made("inertia", inertial, **values))
    return part


def shape_element(shape: ET.Element, tag: str, origin: ET.Element, *, prefix: str = "") -> LocatedElement:
    """Return a `<visual>` or `<collision>`, without `<geometry>` where URDF has no such shape.

    Args:
        shape: SDF's element.
        tag: "visual" or "collision".
        origin: of the shape in the link frame.
        prefix: of file names without a scheme, those that stand in a file of another folder.
    """
    part = made(tag, shape, name=shape.get("name", tag))
    if tag == "collision" and "concave" in shape.attrib:  # PyBullet's, in SDF as in URDF
        part.set("concave", shape.attrib["concave"])
    part.append(origin)
    geometry = shape.find("geometry")
    for kind in geometry if geometry is not None else ():
        if kind.tag in SHAPES:
            values = {key: text_of(kind, child) for child, key in SHAPES[kind.tag].items()}
            if values.get("filename"):
                values["filename"] = prefixed(values["filename"] or "", prefix)
            holder = made("geometry", kind)
            holder.append(made(kind.tag, kind, **{k: v for k, v in values.items() if v is not None}))
            part.append(holder)
            break
    return part


def prefixed(uri: str, prefix: str) -> str:
    """Return a file name as the first file has to give it."""
    return uri if "://" in uri or uri.startswith("/") else prefix + uri


def colour_element(shape: ET.Element, rgba: str) -> LocatedElement:
    """Return a `<material>` of four numbers from 0 to 1."""
    material = made("material", shape, name="")
    material.append(made("color", shape, rgba=rgba))
    return material


def axis_element(axis: ET.Element, direction: str | Array) -> LocatedElement:
    """Return an `<axis>` along a direction, as text or as a (3,) array."""
    return made("axis", axis, xyz=direction if isinstance(direction, str) else joined(direction))


def dynamics_element(axis: ET.Element) -> LocatedElement | None:
    """Return the `<dynamics>` of an axis; None without."""
    dynamics = axis.find("dynamics")
    if dynamics is None:
        return None
    values = {key: text_of(dynamics, key) for key in ("damping", "friction")}
    return made("dynamics", dynamics, **{k: v for k, v in values.items() if v is not None})
