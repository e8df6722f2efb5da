"""`roboyard doctor`: what is installed, missing or slow on this machine, and why."""

from __future__ import annotations

from typing import Annotated

import typer

EXAMPLES = """
Examples:

\b
  roboyard doctor
  roboyard doctor --json > machine.json      for a bug report
"""
MARKS = {"ok": "ok", "missing": "--", "slow": "slow", "failed": "FAIL"}
"""Status of a check to how it is printed."""


def doctor(
    as_json: Annotated[bool, typer.Option("--json", help="Print the checks as JSON.")] = False,
    speed: Annotated[bool, typer.Option(help="Measure the first steps and pictures.")] = True,
) -> None:
    """Check the installation: packages, extras, folders, robots and speed.

    Exit code 0: every command can run, apart from those that need a missing extra; 1: something failed, with
    its remedy.
    """
    from roboyard.diagnosis import folder_checks, package_checks, robot_checks, speed_checks
    from roboyard.untrusted.text import one_line

    groups = {"Packages": package_checks, "Folders": folder_checks, "Robots": robot_checks}
    if speed:
        groups["Speed"] = speed_checks
    found = []
    for title, checks in groups.items():
        if not as_json:
            print(title)
        for check in checks():
            found.append(check)
            if as_json:
                continue
            print(f"  {MARKS[check.status]:<5} {one_line(check.name):<16} {one_line(check.detail)}")
            if check.remedy:
                print(f"{'':25}{one_line(check.remedy)}")
    failed = sum(check.status == "failed" for check in found)
    if as_json:
        import json

        print(json.dumps({"checks": [check.to_json() for check in found]}, indent=2, ensure_ascii=False))
    else:
        missing = sum(check.status == "missing" for check in found)
        print(f"{len(found)} checks: {failed} failed, {missing} optional ones missing")
    if failed:
        raise typer.Exit(1)
