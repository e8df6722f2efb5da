"""Load all files of a robot before the page changes, so that an error leaves the page as it is."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from roboyard.audit import Audit, audit_urdf
from roboyard.description import load_description
from roboyard.description.model import RobotDescription
from roboyard.description.urdf.parse import UrdfElements, parse_urdf
from roboyard.viewer.inspector.edits.edit_state import EditState, read_edit_state
from roboyard.viewer.inspector.robot_source import RobotSource


@dataclass(frozen=True, kw_only=True, eq=False)
class ReadRobot:
    """The loaded files of one robot."""

    source: RobotSource
    edits: EditState
    elements: UrdfElements
    description: RobotDescription

    @cached_property
    def audit(self) -> Audit:
        """Faults of the robot's file; looked for when first asked for, as all meshes are read."""
        return audit_urdf(self.elements)


def read_robot(
    source: RobotSource, packages: Mapping[str, Path] | None, xacro_args: Mapping[str, str] | None = None
) -> ReadRobot:
    """Load a robot; its meshes are not opened.

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
        elements=elements,
        description=load_description(elements, missing_meshes="note"),
    )
