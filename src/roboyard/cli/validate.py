"""`roboyard validate`: run a robot's pass/fail tests."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from roboyard.cli.packages import PackageOption
from roboyard.cli.robot_argument import RobotArgument, robot_source
from roboyard.cli.xacro_args import XacroArgOption
from roboyard.untrusted.text import json_text, say

EXAMPLES = """
Examples:

\b
  roboyard validate r1
  roboyard validate mine --gate settle --html report.html
  roboyard validate my_robot.urdf --definition my_robot.yaml
"""


def validate(
    robot: RobotArgument,
    definition: Annotated[
        Path | None,
        typer.Option(
            "--definition", help="A definition file instead of the robot's own.", show_default=False
        ),
    ] = None,
    only: Annotated[
        list[str] | None,
        typer.Option(
            "--gate", metavar="NAME", help="Run only this gate; may be repeated.", show_default=False
        ),
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the report as JSON.")] = False,
    html: Annotated[
        Path | None,
        typer.Option("--html", help="Write an HTML page with curves to this file.", show_default=False),
    ] = None,
    seed: Annotated[int, typer.Option("--seed", help="Seed of the random arm poses.")] = 0,
    package: PackageOption = None,
    xacro_arg: XacroArgOption = None,
) -> None:
    """Test resting stability, controllers, IK reach and cameras.

    Exit code 0: every gate passed; 1: a gate failed, with advice on what to check.
    """
    from roboyard.validation import validate as run_validation

    report = run_validation(
        robot_source(robot, package, xacro_arg), definition=definition, gates=only or None, seed=seed
    )
    if html is not None:
        from roboyard.validation.page import write_page

        write_page(report, html)
    if as_json:
        print(json_text(report.to_json()))
    else:
        say(f"{report.robot}: {'passed' if report.passed else 'failed'} in {report.seconds:.1f} s")
        for gate in report.gates:
            say(gate.line())
            if not gate.passed:
                for finding in list(gate.findings)[:8]:
                    say(f"        {finding}")
                say(f"        check: {gate.advice}")
        if html is not None:
            say(f"wrote {html}")
    raise typer.Exit(0 if report.passed else 1)
