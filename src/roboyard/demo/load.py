"""Find the robot of a demo, audit it, repair it in a copy and load the copy."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from roboyard.description.model import RobotDescription
from roboyard.errors import ConfigError, unknown_name


@dataclass(frozen=True, kw_only=True, eq=False)
class LoadedRobot:
    """A robot that can be simulated, with the findings of its audit and the fixes made to it."""

    description: RobotDescription
    findings: tuple[Mapping[str, Any], ...]
    """Findings of the audit, worst first, as `Finding.to_json` returns them."""
    repairs: tuple[Mapping[str, Any], ...]
    """Fixes in the order in which they were made, as `Fix.to_json` returns them."""


def find_source(source: str | Path | None) -> tuple[Path, str]:
    """Return the file of a robot and its label for the summary.

    Args:
        source: a robot file, or the name of a robot of the data folder or of a bundled robot or object; None
            is the bundled r1. A `Path`, and a name with a suffix or a folder in it, is always a file.

    Raises:
        ConfigError: `source` is neither a file nor a known name; the message lists the nearest names.
    """
    from roboyard.assets import OBJECTS, ROBOTS, asset_path

    if source is None:
        return asset_path("r1"), "bundled r1"
    path = Path(source)
    if isinstance(source, Path) or path.is_file() or path.suffix or len(path.parts) != 1:
        return path, str(path)
    from roboyard.robots.registry import REGISTERED_ROBOTS

    registered = REGISTERED_ROBOTS.get(source)
    if registered is not None and not registered.bundled:
        return registered.urdf_of(registered.definition), source
    bundled = ROBOTS | OBJECTS
    if source in bundled:
        return asset_path(source), f"bundled {source}"
    from roboyard.robots.public_names import public_names

    names = sorted({*REGISTERED_ROBOTS, *bundled}) + sorted(public_names())
    raise ConfigError(unknown_name("file or robot", source, names))


def load_robot(
    file: Path,
    *,
    packages: Mapping[str, Path] | None,
    folder: Path,
    xacro_args: Mapping[str, str] | None = None,
) -> LoadedRobot:
    """Audit a robot file, write a repaired copy to `folder` and load the copy; the original is not changed.

    Args:
        file: the robot file.
        packages: ROS package name to its folder, for `package://`.
        folder: where the copy is written.
        xacro_args: values of `<xacro:arg>` by name, for a xacro file.

    Raises:
        DescriptionError: the robot cannot be repaired; the message names the original file.
    """
    from roboyard.description import load_description
    from roboyard.description.urdf.parse import parse_urdf
    from roboyard.repair import repair_urdf

    source = parse_urdf(file, packages=packages, xacro_args=xacro_args)
    repaired = repair_urdf(source, folder)
    findings = tuple(finding.to_json() for finding in repaired.before.findings)
    if not repaired.before.is_usable:
        description = load_description(source)
        return LoadedRobot(description=description, findings=findings, repairs=())
    return LoadedRobot(
        description=load_description(repaired.elements),
        findings=findings,
        repairs=tuple(fix.to_json() for fix in repaired.fixes),
    )
