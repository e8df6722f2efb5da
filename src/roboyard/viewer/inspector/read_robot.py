"""Load all files of a robot before the page changes, so that an error leaves the page as it is."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from roboyard.audit import Audit, audit_urdf
from roboyard.description import load_description
from roboyard.description.model import RobotDescription
from roboyard.description.urdf.parse import parse_urdf
from roboyard.viewer.inspector.edits.edit_state import EditState, read_edit_state
from roboyard.viewer.inspector.robot_source import RobotSource


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class ReadRobot:
    """The loaded files of one robot."""

    source: RobotSource
    edits: EditState
    description: RobotDescription
    audit: Audit


def read_robot(
    source: RobotSource, packages: Mapping[str, Path] | None, xacro_args: Mapping[str, str] | None = None
) -> ReadRobot:
    """Load and audit a robot.

    Raises:
        DescriptionError: the URDF is invalid.
        ConfigError: the configuration, a planner file or the definition is invalid.
    """
    elements = parse_urdf(source.urdf, packages=packages, xacro_args=xacro_args)
    if elements.refusal is not None:
        raise elements.refusal
    return ReadRobot(
        source=source,
        edits=read_edit_state(source),
        description=load_description(elements, missing_meshes="note"),
        audit=audit_urdf(elements),
    )
