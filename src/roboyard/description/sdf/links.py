"""Links of SDF as URDF links, and what URDF has no place for as `<gazebo>` elements."""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from collections.abc import Callable

import numpy as np

from roboyard.description.geometry import capsule_like
from roboyard.description.model import Sphere
from roboyard.description.sdf.frames import Frame, pose_of_frame
from roboyard.description.sdf.materials import material_element
from roboyard.description.sdf.parts import SHAPES, inertial_element, shape_element
from roboyard.description.sdf.values import joined, made, number_of, numbers_of, origin, pose_of, text_of
from roboyard.description.urdf.xml import LocatedElement, copy_tree, line_of
from roboyard.errors import DescriptionError
from roboyard.transforms import Array, rpy_from_matrix

MOST_FRICTION = 1000.0
"""Coefficients above mean "does not slide"."""
_READ = ("pose", "inertial", "visual", "collision", "must_be_base_link")


def link_element(
    link: Frame, T_model_frame: Array, note: Callable[[str], None], *, is_static: bool
) -> LocatedElement:
    """Return a link as URDF.

    Args:
        link: SDF's link.
        T_model_frame: (4, 4) pose of the URDF link's frame in the outermost model (m).
        note: takes each note on what is omitted.
        is_static: whether it never moves, so that it needs no mass.
    """
    element = made("link", link.element, name=link.name)
    T_frame_link = np.linalg.inv(T_model_frame) @ pose_of_frame(link)
    inertial = link.element.find("inertial")
    if inertial is None:
        if not is_static:
            inertial = made("inertial", link.element)
            note(f"link {link.name!r} has no <inertial>: it has 1 kg and 1 kg m², as SDF defines it")
    elif inertial.get("auto", "false").lower() in ("1", "true") and inertial.find("mass") is None:
        note(f"the inertia of link {link.name!r} that is to be computed from its shapes is omitted")
        inertial = None
    if inertial is not None:
        place = origin(T_frame_link @ pose_of(inertial))
        element.append(inertial_element(inertial, place, mass="1", moment="1"))
    for tag in ("visual", "collision"):
        for shape in link.element.findall(tag):
            part = _shape(shape, tag, link, T_model_frame, note)
            element.extend([] if part is None else [part])
    contact = _contact(link)
    if contact is not None:
        element.append(contact)
    return element


def kept_elements(link: Frame, T_model_frame: Array) -> LocatedElement | None:
    """Return the sensors, lights and settings of a link as a `<gazebo>` element; None without any.

    Args:
        link: SDF's link.
        T_model_frame: (4, 4) pose of the URDF link's frame in the outermost model (m).
    """
    holder = made("gazebo", link.element, reference=link.name)
    for child in link.element:
        if child.tag in _READ:
            continue
        copied = copy_tree(child)
        posed = child.find("pose") is not None or child.tag in ("sensor", "light", "projector")
        T = _placed(child, link, T_model_frame) if posed else np.eye(4)
        for pose in copied.findall("pose"):
            copied.remove(pose)
        if not np.allclose(T, np.eye(4), atol=1e-12):
            pose = made("pose", child)
            pose.text = f"{joined(T[:3, 3])} {joined(rpy_from_matrix(T[:3, :3]))}"
            copied.insert(0, pose)
        holder.append(copied)
    return holder if len(holder) else None


def _placed(element: ET.Element, link: Frame, T_model_frame: Array) -> Array:
    """Return the (4, 4) pose of something in a link, in the URDF link's frame."""
    pose = element.find("pose")
    name = "" if pose is None else (pose.get("relative_to") or "").strip()
    above = link.scope.find(name, element) if name else link
    return np.linalg.inv(T_model_frame) @ pose_of_frame(above) @ pose_of(element)


def _shape(
    shape: ET.Element, tag: str, link: Frame, T_model_frame: Array, note: Callable[[str], None]
) -> LocatedElement | None:
    T = _placed(shape, link, T_model_frame)
    geometry = shape.find("geometry")
    kinds = [] if geometry is None else [str(child.tag) for child in geometry]
    if not kinds or "empty" in kinds:
        return None
    if not any(kind in (*SHAPES, "ellipsoid") for kind in kinds):
        note(f"a {tag} that is a {kinds[0][:40]} is omitted: a robot description has none")
        return None
    if text_of(geometry, "mesh/submesh/name") is not None:
        note("parts of meshes (<submesh>) are not taken alone: the whole mesh is used")
    if "ellipsoid" in kinds:
        part = _ellipsoid(shape, tag, T, note)
    else:
        part = shape_element(shape, tag, origin(T), prefix=link.scope.model.prefix)
    if tag == "visual":
        material = material_element(shape, link.scope.model.prefix)
        part.extend([] if material is None else [material])
    return part


def _ellipsoid(shape: ET.Element, tag: str, T: Array, note: Callable[[str], None]) -> LocatedElement:
    text = text_of(shape, "geometry/ellipsoid/radii") or "1 1 1"
    radii = numbers_of(text, 3)
    if radii is None or min(radii) <= 0:
        raise DescriptionError(
            f"<radii>{text[:60]}</radii> must be three lengths above zero", line=line_of(shape)
        )
    note("ellipsoids are written as capsules of the same length")
    like, turn = capsule_like((radii[0], radii[1], radii[2]))
    part = made(tag, shape, name=shape.get("name", tag))
    part.append(origin(T @ turn))
    holder = made("geometry", shape)
    if isinstance(like, Sphere):
        holder.append(made("sphere", shape, radius=repr(like.radius)))
    else:
        holder.append(made("capsule", shape, radius=repr(like.radius), length=repr(like.length)))
    part.append(holder)
    return part


def _contact(link: Frame) -> LocatedElement | None:
    """Return the `<contact>` of a link: the largest friction and restitution that its collisions state."""
    contact = made("contact", link.element)
    for tag, paths in (
        ("lateral_friction", ("surface/friction/ode/mu", "surface/friction/bullet/friction")),
        ("restitution", ("surface/bounce/restitution_coefficient",)),
    ):
        stated = [
            number_of(shape, path, math.nan) for shape in link.element.findall("collision") for path in paths
        ]
        found = [min(value, MOST_FRICTION) for value in stated if value >= 0]
        if found:
            contact.append(made(tag, link.element, value=repr(max(found))))
    return contact if len(contact) else None
