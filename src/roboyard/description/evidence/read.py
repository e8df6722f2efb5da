"""Everything that a robot's files state beyond its links and joints."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from roboyard.description.evidence.model import FileEvidence
from roboyard.description.evidence.simulation import (
    read_actuated,
    read_followers,
    read_plugins,
    read_sensors,
)
from roboyard.description.evidence.srdf import find_srdf
from roboyard.description.model import RobotDescription


def read_evidence(
    description: RobotDescription,
    file: Path | None = None,
    *,
    packages: Mapping[str, Path] | None = None,
    search_paths: Sequence[Path] = (),
) -> FileEvidence:
    """Return what a robot's file and an SRDF beside it state; never fails.

    Args:
        description: the robot, with the elements that its reader kept.
        file: the file it was loaded from; the description's own by default.
        packages: as for `load_description`.
        search_paths: as for `load_description`.
    """
    return FileEvidence(
        sensors=read_sensors(description),
        plugins=read_plugins(description),
        actuated=read_actuated(description),
        followers=read_followers(description),
        srdf=find_srdf(description, file, packages=packages, search_paths=search_paths),
    )
