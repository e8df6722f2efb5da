"""The list of commands in `roboyard --help`, by what one wants to do."""

from __future__ import annotations

from typing import Any

from typer.core import TyperGroup

GROUPS = {
    "See it": ("demo", "view"),
    "Read and mend it": ("audit", "repair"),
    "Make a robot of it": ("import", "robots", "validate"),
    "Drive it": ("drive", "replay"),
    "PyBullet scripts": ("run", "serve"),
    "About": ("version",),
}
"""Heading to its commands, in the order of the help text."""

EXAMPLES = """
Examples:

\b
  roboyard demo                              the bundled robot moves
  roboyard audit my_robot.urdf               what is wrong with your robot
  roboyard import my_robot.urdf              USD, MJCF, planner files
  roboyard drive r1 --scene home --browser   drive a robot on a web page

`roboyard COMMAND --help` says more. Exit codes: 0 done, 1 bad input, 2 wrong usage.
"""


class GroupedHelp(TyperGroup):
    """Commands under headings; no sentence is cut."""

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        """Write one list for each heading, all with one width."""
        there = {name: self.get_command(ctx, name) for name in self.list_commands(ctx)}
        width = max((len(name) for name in there), default=0)
        for heading, names in GROUPS.items():
            rows = [
                (name.ljust(width), command.get_short_help_str(limit=200))
                for name in names
                if (command := there.get(name)) is not None
            ]
            if rows:
                with formatter.section(heading):
                    formatter.write_dl(rows)
