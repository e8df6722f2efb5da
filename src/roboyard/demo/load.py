"""The robot comes in: audited, mended where that takes no guessing, and read."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from roboyard.description.model import RobotDescription
from roboyard.errors import ConfigError, unknown_name


@dataclass(frozen=True, kw_only=True, eq=False)
class LoadedRobot:
    """A robot that can be used, and what stood in the way."""

    description: RobotDescription
    findings: tuple[Mapping[str, Any], ...]
    """Of the audit, worst first, as `Finding.to_json` gives them."""
    repairs: tuple[Mapping[str, Any], ...]
    """As `Mend.to_json` gives them, in the order they were done."""


def find_source(source: str | Path | None) -> tuple[Path, str]:
    """Return the file of a robot and its label for the summary.

    Args:
        source: a robot file, or the name of a robot of the data folder or of a bundled robot or object; None
            is the bundled r1. A `Path`, and a name with a suffix or a folder in it, is always a file.

    Raises:
        ConfigError: `source` is neither a file nor a known name; the message lists the nearest names.
    """
    from roboyard.assets import ROBOTS, THINGS, asset_path

    if source is None:
        return asset_path("r1"), "bundled r1"
    path = Path(source)
    if isinstance(source, Path) or path.is_file() or path.suffix or len(path.parts) != 1:
        return path, str(path)
    from roboyard.robots.registry import REGISTERED_ROBOTS

    registered = REGISTERED_ROBOTS.get(source)
    if registered is not None and not registered.bundled:
        return registered.urdf_of(registered.definition), source
    bundled = ROBOTS | THINGS
    if source in bundled:
        return asset_path(source), f"bundled {source}"
    raise ConfigError(unknown_name("file or robot", source, sorted({*REGISTERED_ROBOTS, *bundled})))


def load_robot(file: Path, *, packages: Mapping[str, Path] | None, folder: Path) -> LoadedRobot:
    """Audit, repair into `folder`, and read the repaired robot; the original stays as it is.

    Raises:
        DescriptionError: the robot is beyond repair; the message names the original file.
    """
    from roboyard.description import load_description
    from roboyard.repair import repair_urdf

    repaired = repair_urdf(file, folder, packages=packages)
    findings = tuple(finding.to_json() for finding in repaired.before.findings)
    if not repaired.before.is_usable:
        return LoadedRobot(
            description=load_description(file, packages=packages), findings=findings, repairs=()
        )
    return LoadedRobot(
        description=load_description(repaired.urdf),
        findings=findings,
        repairs=tuple(mend.to_json() for mend in repaired.mends),
    )


def told_findings(findings: Sequence[Mapping[str, Any]]) -> list[str]:
    """One line for each kind of fault, worst first: how bad, the first place, and in how many more."""
    lines = []
    for first, more in _by_code(findings):
        where = f"{first['element']}: " if first["element"] else ""
        line = f"line {first['line']}: " if first["line"] else ""
        lines.append(f"{first['severity']}: {line}{where}{first['message']}{more}")
    return lines


def told_repairs(repairs: Sequence[Mapping[str, Any]]) -> list[str]:
    """One line for each kind of repair: the first before and after, and how many more there were."""
    lines = []
    for first, more in _by_code(repairs):
        where = f"{first['element']}: " if first["element"] else ""
        lines.append(f"{where}{_short(first['before'])} → {_short(first['after'])}{more}")
    return lines


def _by_code(entries: Sequence[Mapping[str, Any]]) -> list[tuple[Mapping[str, Any], str]]:
    groups: dict[str, list[Mapping[str, Any]]] = {}
    for entry in entries:
        groups.setdefault(entry["code"], []).append(entry)
    found = []
    for group in groups.values():
        found.append((group[0], f" (and {len(group) - 1} more like this)" if len(group) > 1 else ""))
    return found


def _short(text: str, most: int = 60) -> str:
    flat = " ".join(text.split())
    return flat if len(flat) <= most else flat[: most - 1] + "…"
