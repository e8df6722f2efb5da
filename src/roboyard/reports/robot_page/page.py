"""Write a robot as one HTML file, without addresses of other files or machines."""

from __future__ import annotations

import base64
import json
import math
import zlib
from collections.abc import Mapping
from html import escape
from pathlib import Path
from typing import Any

from roboyard.description.model import Joint, RobotDescription
from roboyard.reports.robot_page.geometry import Triangles, parts_of

FREE = {"revolute": math.pi, "continuous": math.pi, "prismatic": 1.0}
"""Half the range of a joint without limits (rad or m)."""


def robot_page(
    description: RobotDescription,
    positions: Mapping[str, float] | None = None,
    *,
    small: bool = False,
) -> str:
    """Return a page that draws the robot, with a slider per joint and a switch per layer.

    Args:
        description: the robot, its meshes readable.
        positions: joint name to its first position (rad or m); others start at zero, or at the limit nearest
            to it.
        small: simplify dense meshes.
    """
    data = bytearray()
    starts: dict[Triangles, int] = {}
    parts: list[dict[str, Any]] = []
    for part in parts_of(description, small=small):
        triangles = part.triangles
        if triangles not in starts:
            starts[triangles] = len(data)
            data += triangles.vertices + triangles.faces
        parts.append(
            {
                "link": part.link,
                "layer": part.layer,
                "position": list(part.origin.position),
                "quaternion": list(part.origin.quaternion),
                "low": triangles.low,
                "size": triangles.size,
                "at": starts[triangles],
                "vertices": len(triangles.vertices) // 16,
                "faces": len(triangles.faces) // 4,
            }
        )
    robot = {
        "name": description.name,
        "links": [link.name for link in description.links],
        "joints": [_joint(joint, positions or {}) for joint in description.joints],
        "parts": parts,
    }
    packed = base64.b64encode(zlib.compress(bytes(data), 5)).decode("ascii")
    folder = Path(__file__).parent
    text = (folder / "page.html").read_text(encoding="utf-8")
    # "<" would end the script
    text = text.replace("ROBOT_JSON", json.dumps(robot, separators=(",", ":")).replace("<", "\\u003c"), 1)
    text = text.replace("ROBOT_TITLE", escape(description.name))
    return text.replace("ROBOT_DATA", packed, 1)


def _joint(joint: Joint, positions: Mapping[str, float]) -> dict[str, Any]:
    """Return a joint for the script of the page; without a range it does not move."""
    found: dict[str, Any] = {
        "name": joint.name,
        "type": joint.type,
        "parent": joint.parent,
        "child": joint.child,
        "position": list(joint.origin.position),
        "quaternion": list(joint.origin.quaternion),
        "axis": list(joint.axis),
    }
    if joint.type in FREE:
        lower, upper = joint.position_limits() or (-FREE[joint.type], FREE[joint.type])
        found["range"] = [lower, upper]
        found["start"] = min(max(positions.get(joint.name, 0.0), lower), upper)
    if joint.mimic is not None:
        mimic = joint.mimic
        found["mimic"] = {"joint": mimic.joint, "multiplier": mimic.multiplier, "offset": mimic.offset}
    return found
