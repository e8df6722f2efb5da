"""Numbers and elements of MJCF."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Iterable
from typing import Any

import numpy as np

from roboyard._arrays import ArrayLike
from roboyard.transforms import to_wxyz


def add(parent: ET.Element, tag: str, **attributes: Any) -> ET.Element:
    """A child element; None leaves an attribute out, `class_` is written as `class`."""
    written = {key.rstrip("_"): text(value) for key, value in attributes.items() if value is not None}
    return ET.SubElement(parent, tag, written)


def text(value: Any) -> str:
    """Text of a name, a flag, a number or a vector; numbers read back as the same."""
    if isinstance(value, str):
        return value
    if isinstance(value, bool | np.bool_):
        return "true" if value else "false"
    if isinstance(value, int | np.integer):
        return str(int(value))
    if isinstance(value, float | np.floating):
        return _number(float(value))
    return " ".join(_number(float(v)) for v in _flat(value))


def pose(position: ArrayLike, quaternion: ArrayLike) -> dict[str, Any]:
    """`pos` and `quat` of a pose (x, y, z, w), None where they are the identity."""
    p = np.asarray(position, dtype=float)
    q = to_wxyz(quaternion)
    identity = bool(np.all(q == (1.0, 0.0, 0.0, 0.0)))
    return {"pos": p if p.any() else None, "quat": None if identity else q}


def _number(value: float) -> str:
    return repr(value + 0.0).removesuffix(".0")


def _flat(value: ArrayLike) -> Iterable[Any]:
    return np.asarray(value, dtype=float).ravel()
