"""`roboyard audit`: report what is wrong with a robot description."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from roboyard.cli.completion import viewed_names
from roboyard.cli.packages import PackageOption
from roboyard.cli.xacro_args import XacroArgOption
from roboyard.untrusted.text import json_text, one_line, say

if TYPE_CHECKING:
    from roboyard.audit import Audit, Severity

EXAMPLES = """
Examples:

\b
  roboyard audit my_robot.urdf
  roboyard audit my_robot.urdf --html faults.html   with pictures
  roboyard audit mine                               an imported robot
  roboyard audit config.yaml                        an import configuration
"""


def audit(
    robot: Annotated[
        str,
        typer.Argument(
            help="A robot file, the name of a robot, or an import configuration (YAML).",
            metavar="ROBOT",
            show_default=False,
            autocompletion=viewed_names,
        ),
    ],
    as_json: Annotated[bool, typer.Option("--json", help="Print the findings as JSON.")] = False,
    html: Annotated[
        Path | None, typer.Option("--html", help="Write a page with pictures here.", show_default=False)
    ] = None,
    package: PackageOption = None,
    xacro_arg: XacroArgOption = None,
    everything: Annotated[
        bool, typer.Option("--all", help="Show every finding, even if many are alike.")
    ] = False,
) -> None:
    """Report what is wrong with a robot description and how to fix it.

    Each finding names its line, its remedy, and whether `roboyard repair` fixes it. Exit code 0: usable as it
    is or after these fixes; 1: not usable.
    """
    from roboyard.cli.robot_argument import given_robot

    given = given_robot(robot, package, xacro_arg)
    file, packages, xacro_args = given.file, given.packages, given.xacro_args
    if file.suffix.lower() in (".yaml", ".yml"):
        if html is not None:
            raise typer.BadParameter(
                f"{file.name} is a configuration, which has no page; give its URDF", param_hint="--html"
            )
        raise typer.Exit(_audit_configuration(file, packages, as_json=as_json))
    if html is not None:
        from roboyard.reports.audit_page import write_audit_page

        result = write_audit_page(file, html, packages=packages, xacro_args=xacro_args)
    else:
        from roboyard.audit import audit_urdf

        result = audit_urdf(file, packages=packages, xacro_args=xacro_args)
    if as_json:
        _print_json(result.to_json())
    elif sys.stdout.isatty():
        _print_table(result, everything=everything)
    else:
        from roboyard.audit.report import report_lines

        say(*report_lines(result, everything=everything))
    raise typer.Exit(0 if result.is_usable else 1)


def _print_table(result: Audit, *, everything: bool) -> None:
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    from roboyard.audit.report import facts_line, shown_findings, summary

    console = Console()
    console.print(Text(summary(result), style="bold green" if result.is_usable else "bold red"))
    if result.facts.links:
        console.print(Text(facts_line(result), style="dim"))
    if not result.findings:
        return
    table = Table(show_lines=False, expand=False)
    table.add_column("line", justify="right", style="dim")
    table.add_column("element", overflow="fold", max_width=32)
    table.add_column("fault", overflow="fold", ratio=3)
    table.add_column("remedy", overflow="fold", ratio=2)
    table.add_column("code", style="dim", overflow="fold", max_width=24)
    severity: Severity | None = None
    for finding, more in shown_findings(result, everything=everything):
        if finding.severity != severity:
            severity = finding.severity
            style = ("bold red", "bold yellow", "bold blue")[severity]
            table.add_section()
            table.add_row("", Text(severity.label, style=style))
        remedy = Text(one_line(finding.remedy))
        if finding.fixable:
            remedy.append(" (repair fixes it)", style="green")
        line = "" if finding.line is None else str(finding.line)
        table.add_row(
            line, Text(one_line(finding.element)), Text(one_line(finding.message)), remedy, finding.code
        )
        if more > 0:
            table.add_row("", "", Text(f"... and {more} more like this; --all shows them", style="dim"))
    console.print(table)


def _audit_configuration(file: Path, packages: dict[str, Path], *, as_json: bool) -> int:
    """Report what is wrong with an import configuration; without `as_json`, `main` prints the problems."""
    from roboyard.errors import RoboyardError
    from roboyard.importer.config.audit import check_config

    try:
        notes = check_config(file, packages=packages)
    except RoboyardError as error:
        if not as_json:
            raise
        _print_json({"file": str(file), "usable": False, "problems": str(error).splitlines(), "notes": []})
        return 1
    if as_json:
        _print_json({"file": str(file), "usable": True, "problems": [], "notes": list(notes)})
        return 0
    for note in notes:
        say(note)
    say(f"{file.name}: usable")
    return 0


def _print_json(data: dict[str, Any]) -> None:
    print(json_text(data))
