"""Texts, numbers and poses in SDF's elements, and new URDF elements with the line of an SDF element."""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET

import numpy as np

from roboyard.description.urdf.numbers import unit_quaternion
from roboyard.description.urdf.xml import LocatedElement, line_of
from roboyard.errors import DescriptionError
from roboyard.transforms import Array, pose_matrix, quaternion_from_rpy, rpy_from_matrix

LARGEST = 1e9
"""Largest part of a pose (m or rad)."""
_SHOWN = 60
_EULER_TURN = "euler_rpy"
_NO_NUMBER = 1e-15
"""Parts of a composed pose that are nothing but rounding (m, or no unit)."""


def made(tag: str, like: ET.Element, **attributes: str) -> LocatedElement:
    """Return a new element with the line number of another one."""
    element = LocatedElement(tag, attributes)
    element.line = line_of(like)
    return element


def text_of(element: ET.Element | None, path: str) -> str | None:
    """Return the text of a descendant, blanks at its ends removed; None where it is absent or blank."""
    found = None if element is None else element.find(path)
    return None if found is None or found.text is None else found.text.strip() or None


def is_true(element: ET.Element, path: str) -> bool:
    """Return whether a descendant states "true" or "1"."""
    return (text_of(element, path) or "").lower() in ("1", "true")


def number_of(element: ET.Element | None, path: str, otherwise: float) -> float:
    """Return the number in a descendant; `otherwise` where it is absent. It may be infinite.

    Raises:
        DescriptionError: it is no number.
    """
    text = text_of(element, path)
    if text is None:
        return otherwise
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if math.isnan(value):
        found = None if element is None else element.find(path)
        tag = path.rpartition("/")[2]
        raise DescriptionError(
            f"<{tag}>{text[:_SHOWN]}</{tag}> is not a number; give one",
            line=None if found is None else line_of(found),
        )
    return value


def numbers_of(text: str, count: int) -> list[float] | None:
    """Return the first `count` numbers of a text; None where they are fewer, or not finite."""
    try:
        numbers = [float(token) for token in text.split()[:count]]
    except ValueError:
        return None
    good = len(numbers) == count and all(math.isfinite(v) and abs(v) <= LARGEST for v in numbers)
    return numbers if good else None


def pose_of(element: ET.Element) -> Array:
    """Return the (4, 4) pose in an element's `<pose>`; the identity where there is none.

    It is x y z (m) and roll pitch yaw (rad, or degrees where `degrees` says so), or a quaternion x y z w
    where `rotation_format` is quat_xyzw.

    Raises:
        DescriptionError: it does not hold six (or seven) finite numbers.
    """
    pose = element.find("pose")
    text = "" if pose is None or pose.text is None else pose.text.strip()
    if pose is None or not text:
        return np.eye(4)
    if pose.get("rotation_format", _EULER_TURN) == "quat_xyzw":
        numbers = numbers_of(text, 7)
        turn = None if numbers is None else unit_quaternion(numbers[3:])
        if numbers is None or turn is None:
            raise DescriptionError(
                f"<pose>{text[:_SHOWN]}</pose> must have seven finite numbers: x y z, a quaternion x y z w",
                line=line_of(pose),
            )
        return pose_matrix(numbers[:3], turn)
    numbers = numbers_of(text, 6)
    if numbers is None:
        raise DescriptionError(
            f"<pose>{text[:_SHOWN]}</pose> must have six finite numbers: x y z roll pitch yaw",
            line=line_of(pose),
        )
    angles = numbers[3:]
    if pose.get("degrees", "false").lower() in ("1", "true"):
        angles = [math.radians(angle) for angle in angles]
    return pose_matrix(numbers[:3], quaternion_from_rpy(angles))


def origin(pose: Array) -> LocatedElement:
    """Return a URDF `<origin>` of a (4, 4) pose, as roll, pitch and yaw."""
    return LocatedElement(
        "origin", {"xyz": joined(pose[:3, 3]), "rpy": joined(rpy_from_matrix(pose[:3, :3]))}
    )


def joined(numbers: Array) -> str:
    """Return (n,) numbers with all their digits, those that are nothing but rounding as 0."""
    return " ".join(repr(0.0 if abs(v) < _NO_NUMBER else float(v)) for v in numbers)
