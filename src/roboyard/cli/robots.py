"""`roboyard robots`: list the registered robots."""

from __future__ import annotations

from contextlib import suppress
from typing import TYPE_CHECKING, Annotated, Any

import typer

from roboyard.untrusted.text import json_text, say

EXAMPLES = """
Examples:

\b
  roboyard robots
  roboyard robots --json --no-pictures
"""

if TYPE_CHECKING:
    from roboyard.robots import RegisteredRobot


def robots(
    as_json: Annotated[bool, typer.Option("--json", help="Print the list as JSON.")] = False,
    pictures: Annotated[bool, typer.Option(help="Render missing pictures.")] = True,
) -> None:
    """List your imported robots and the bundled ones.

    Each with its joints, capabilities and a picture. An invalid definition is listed with its problem; the
    exit code is still 0.
    """
    from roboyard.robots.registry import REGISTERED_ROBOTS

    rows = [_row(robot, pictures) for robot in REGISTERED_ROBOTS.values()]
    if as_json:
        print(json_text({"data": str(REGISTERED_ROBOTS.data), "robots": rows}))
        return
    for row in rows:
        if row["problem"]:
            say(f"{row['name']}: invalid: {row['problem'].splitlines()[0]}")
            continue
        where = "bundled" if row["bundled"] else row["file"]
        capabilities = ", ".join(row["capabilities"]) or "no capabilities"
        say(f"{row['name']}: {row['joints']} joints; {capabilities} ({where})")
        if row["picture"]:
            say(f"    picture: {row['picture']}")
    say(f"{len(rows)} robots; data folder: {REGISTERED_ROBOTS.data}")


def _row(robot: RegisteredRobot, render: bool) -> dict[str, Any]:
    from roboyard.errors import RoboyardError
    from roboyard.kinematics.joint_order import breadth_first_joint_names
    from roboyard.robots.pictures import picture_of
    from roboyard.robots.registry import REGISTERED_ROBOTS

    row: dict[str, Any] = {
        "name": robot.name,
        "file": str(robot.file),
        "bundled": robot.bundled,
        "capabilities": [],
        "groups": {},
        "joints": None,
        "picture": None if robot.picture is None else str(robot.picture),
        "problem": None,
    }
    try:
        definition = robot.definition
        row["capabilities"] = list(definition.capabilities)
        row["groups"] = definition.controller_names()
        row["joints"] = len(breadth_first_joint_names(robot.description(definition)))
        if render and row["picture"] is None:
            with suppress(OSError):  # the data folder may be read-only
                row["picture"] = str(picture_of(robot, REGISTERED_ROBOTS))
    except RoboyardError as error:
        row["problem"] = str(error)
    return row
