"""`roboyard repair`: fix the findings that have one safe fix."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import Annotated

import typer

from roboyard.cli.packages import PackageOption
from roboyard.cli.robot_argument import RobotArgument, given_robot
from roboyard.cli.xacro_args import XacroArgOption
from roboyard.untrusted.text import json_text, say

EXAMPLES = """
Examples:

\b
  roboyard repair my_robot.urdf --out repaired
  roboyard repair my_robot.urdf --out repaired --only inertial-missing
"""


def repair(
    robot: RobotArgument,
    out: Annotated[Path, typer.Option("--out", help="Folder to write the repaired robot into.")],
    only: Annotated[
        list[str] | None,
        typer.Option(
            "--only", metavar="CODE", help="Fix only this code; may be given again.", show_default=False
        ),
    ] = None,
    keep: Annotated[
        list[str] | None,
        typer.Option(
            "--keep", metavar="CODE", help="Do not fix this code; may be given again.", show_default=False
        ),
    ] = None,
    package: PackageOption = None,
    xacro_arg: XacroArgOption = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the log as JSON.")] = False,
) -> None:
    """Fix a robot description in a new folder.

    Makes and logs every fix that needs no guess, then reports the remaining findings; the original does not
    change. Exit code 0: the result is usable; 1: it is not.
    """
    from roboyard.audit.report import SHOWN_ONCE, report_lines
    from roboyard.repair import repair_urdf

    given = given_robot(robot, package, xacro_arg)
    file = given.file
    result = repair_urdf(
        file,
        out,
        only=only or (),
        keep=keep or (),
        packages=given.packages,
        xacro_args=given.xacro_args,
    )
    if as_json:
        print(json_text(result.to_json()))
    else:
        counts = Counter(fix.code for fix in result.fixes)
        for fix in result.fixes:
            if fix.code in SHOWN_ONCE and fix.code not in counts:
                continue
            where = f"{file.name}:{fix.line}" if fix.line else file.name
            element = f"{fix.element}: " if fix.element else ""
            say(f"{where}: {element}{fix.before} -> {fix.after} [{fix.code}]")
            more = counts.pop(fix.code) - 1 if fix.code in SHOWN_ONCE else 0
            if more:
                say(f"{file.name}: and {more} more of [{fix.code}], see renames.json")
        say(f"{len(result.fixes)} fixes, {len(result.staged)} files copied; wrote {result.urdf}")
        say(*report_lines(result.after))
    raise typer.Exit(0 if result.after.is_usable else 1)
