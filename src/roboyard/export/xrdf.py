"""XRDF: what Isaac Sim's and Isaac ROS' planners need beside the URDF.

| concept | where it goes |
| --- | --- |
| joints that are planned, in order | `cspace.joint_names`, with acceleration and jerk limits |
| positions of all joints | `default_joint_positions` |
| locked joints | not in `cspace`; their positions as above |
| mimic joints | nowhere: the URDF says what they do |
| end effectors | `tool_frames` |
| spheres | `geometry.<name>_spheres.spheres` |
| padding | `collision.buffer_distance`; `self_collision.buffer_distance` |
| pairs not checked | `self_collision.ignore` |

Format version 1.0, which every reader takes. ASCII only.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from roboyard.config.yaml_text import dump
from roboyard.export.export_result import ExportResult
from roboyard.export.names import identifier
from roboyard.export.planner import MAX_ACCELERATION, MAX_JERK, SPHERE_BUFFER, Planner

if TYPE_CHECKING:
    from roboyard.description.robot_model import RobotModel


def write(robot: RobotModel, path: Path | str) -> ExportResult:
    """Write a robot's planning data as XRDF; nothing where it has none."""
    if robot.planning is None:
        return ExportResult(files=(), notes=("no planning data; no XRDF",))
    target = Path(path)
    target.parent.mkdir(parents=True, exist_ok=True)
    planner = Planner(robot=robot, data=robot.planning)
    header = (f"Goes with the URDF of {identifier(robot.name, 'robot')}.",)
    target.write_text(dump(_document(planner), header=header), encoding="utf-8")
    return ExportResult(files=(target,))


def _document(planner: Planner) -> dict[str, Any]:
    own = [joint for joint in planner.joints if joint.mimic is None]
    active = [joint.name for joint in own if joint.name not in planner.locked]
    spheres = planner.spheres()
    group = f"{identifier(planner.robot.name, 'robot')}_spheres"
    extra = {link: float(planner.data.self_collision_buffer.get(link, 0.0)) for link in spheres}
    return {
        "format": "xrdf",
        "format_version": 1.0,
        "default_joint_positions": {
            joint.name: planner.locked.get(joint.name, planner.rest(joint)) for joint in own
        },
        "cspace": {
            "joint_names": active,
            "acceleration_limits": [MAX_ACCELERATION] * len(active),
            "jerk_limits": [MAX_JERK] * len(active),
        },
        "tool_frames": list(planner.end_links),
        "collision": {"geometry": group, "buffer_distance": dict.fromkeys(spheres, SPHERE_BUFFER)},
        "self_collision": {
            "geometry": group,
            "buffer_distance": {link: value for link, value in extra.items() if value},
            "ignore": planner.ignore(attached=False),
        },
        "geometry": {group: {"spheres": spheres}},
    }
