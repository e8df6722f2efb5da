"""Everything of a robot that may be wrong, read before anything changes on the page."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from roboyard.audit import Audit, audit_urdf
from roboyard.description import load_description
from roboyard.description.model import RobotDescription
from roboyard.viewer.inspector.edits.edit_state import EditState, read_edit_state
from roboyard.viewer.inspector.robot_source import RobotSource


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class ReadRobot:
    """What was read of one robot."""

    source: RobotSource
    notes: EditState
    description: RobotDescription
    audit: Audit


def read_robot(source: RobotSource, packages: Mapping[str, Path] | None) -> ReadRobot:
    """Read and audit a robot.

    Raises:
        DescriptionError: the URDF cannot be used.
        ConfigError: a file beside it is wrong.
    """
    return ReadRobot(
        source=source,
        notes=read_edit_state(source),
        description=load_description(source.urdf, packages=packages, missing_meshes="note"),
        audit=audit_urdf(source.urdf, packages=packages),
    )
