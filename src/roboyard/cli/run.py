"""`roboyard run`: run an unmodified PyBullet script."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

EXAMPLES = """
Examples:

\b
  roboyard run my_script.py
  roboyard run my_script.py --its-own flags
"""

CONTEXT_SETTINGS = {"allow_interspersed_args": False, "ignore_unknown_options": True}
"""Arguments after the script belong to the script."""


def run(
    script: Annotated[
        Path, typer.Argument(help="Python file that imports pybullet.", metavar="SCRIPT", show_default=False)
    ],
    arguments: Annotated[
        list[str] | None, typer.Argument(help="Passed to the script.", metavar="[ARGS]...")
    ] = None,
) -> None:
    """Run an unmodified PyBullet script on Roboyard.

    The exit code is the script's. ROBOYARD_VIEWER=0 disables the page of connect(GUI).
    """
    if not script.exists():
        raise typer.BadParameter(
            f"there is no file {str(script)!r}; give the path of a Python script", param_hint="SCRIPT"
        )
    from roboyard.pybullet.running import run_script

    raise typer.Exit(run_script(script, arguments or ()))
