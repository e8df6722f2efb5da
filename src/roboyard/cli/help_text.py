"""The list of commands in `roboyard --help`, grouped by task."""

from __future__ import annotations

from typing import Any

from typer.core import TyperGroup

GROUPS = {
    "View": ("demo", "view"),
    "Audit and repair": ("audit", "repair"),
    "Import and validate": ("infer", "import", "import-all", "robots", "validate"),
    "Control": ("drive", "plan", "replay"),
    "PyBullet scripts": ("run", "serve"),
    "About": ("doctor", "version"),
}
"""Heading to its commands, in the order of the help text."""

EXAMPLES = """
Examples:

\b
  roboyard demo                              move the bundled robot
  roboyard audit my_robot.urdf               errors of your robot
  roboyard import my_robot.urdf              USD, MJCF and planner files
  roboyard drive r1 --scene home --browser   control it in the browser

`roboyard COMMAND --help` has details. Exit codes: 0 success, 1 error, 2 usage error.
"""


class GroupedHelp(TyperGroup):
    """A command group whose help lists the commands under headings, without truncating sentences."""

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        """Write one list for each heading, all with the same width."""
        commands = {name: self.get_command(ctx, name) for name in self.list_commands(ctx)}
        width = max((len(name) for name in commands), default=0)
        for heading, names in GROUPS.items():
            rows = [
                (name.ljust(width), command.get_short_help_str(limit=200))
                for name in names
                if (command := commands.get(name)) is not None
            ]
            if rows:
                with formatter.section(heading):
                    formatter.write_dl(rows)
