"""Size of the robot, which OmniGibson reads from `misc/metadata.json`, and the understanding of it."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

from roboyard.description.robot_model import Metadata, RobotModel
from roboyard.description.understanding import conclusions, understanding
from roboyard.importer.context import ImportContext
from roboyard.morphology.bounds import robot_bounds


def measure_size(robot: RobotModel, context: ImportContext) -> RobotModel:
    """Return the robot with the bounding box of its visual shapes; of all shapes where it has no visual
    ones.
    """
    bounds = robot_bounds(robot.description, collision=False)
    if bounds is None:
        bounds = robot_bounds(robot.description)
    if bounds is None:
        context.log.warn("the robot has no shape, so it has no size")
        return robot
    sx, sy, sz = (float(value) for value in bounds[1] - bounds[0])
    cx, cy, cz = (float(value) for value in bounds.mean(axis=0))
    return replace(robot, metadata=Metadata(bbox_size=(sx, sy, sz), base_link_offset=(cx, cy, cz)))


def write_metadata(robot: RobotModel, path: Path) -> None:
    """Write `metadata.json`."""
    path.parent.mkdir(parents=True, exist_ok=True)
    data = {
        "meta_links": {},
        "link_tags": {},
        "object_parts": [],
        "base_link_offset": list(robot.metadata.base_link_offset),
        "bbox_size": list(robot.metadata.bbox_size),
        "orientations": [],
    }
    path.write_text(json.dumps(data, indent=2) + "\n", encoding="utf-8", errors="backslashreplace")


def write_understanding(robot: RobotModel, path: Path) -> None:
    """Write `understanding.json`: kind, base, limbs, grippers and sensors, and each conclusion's reasons."""
    data = {"understanding": understanding(robot.semantic), "conclusions": conclusions(robot.semantic)}
    path.write_text(
        json.dumps(data, indent=2, ensure_ascii=False) + "\n", encoding="utf-8", errors="backslashreplace"
    )
