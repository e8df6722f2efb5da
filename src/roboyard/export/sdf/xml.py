"""Elements, numbers and poses of SDF."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from typing import Any

import numpy as np

from roboyard._arrays import ArrayLike
from roboyard.description.model import Pose
from roboyard.transforms import rpy_from_matrix


def add(parent: ET.Element, tag: str, value: Any = None, **attributes: str) -> ET.Element:
    """Return a new child element with a text, a flag, a number or a vector; numbers read back as the same."""
    element = ET.SubElement(parent, tag, attributes)
    if value is not None:
        element.text = text(value)
    return element


def text(value: Any) -> str:
    """Return the text of a value."""
    if isinstance(value, str):
        return value
    if isinstance(value, bool | np.bool_):
        return "true" if value else "false"
    return " ".join(repr(float(v) + 0.0) for v in np.asarray(value, dtype=float).ravel())


def add_pose(parent: ET.Element, pose: Pose, relative_to: str | None = None) -> None:
    """Add a `<pose>` with roll, pitch and yaw; none for the identity in the parent's own frame."""
    matrix = pose.matrix()
    add_placed(parent, matrix[:3, 3], matrix[:3, :3], relative_to)


def add_placed(
    parent: ET.Element, position: ArrayLike, rotation: ArrayLike, relative_to: str | None = None
) -> None:
    """Add a `<pose>` from a (3,) position (m) and a (3, 3) rotation."""
    position, rotation = np.asarray(position, dtype=float), np.asarray(rotation, dtype=float)
    if relative_to is None and not position.any() and np.array_equal(rotation, np.eye(3)):
        return
    numbers = np.concatenate([position, rpy_from_matrix(rotation)])
    add(parent, "pose", numbers, **({} if relative_to is None else {"relative_to": relative_to}))
