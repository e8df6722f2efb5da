"""`roboyard demo`: load a robot, move its joints and write pictures of it."""

from __future__ import annotations

import sys
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from roboyard.cli.completion import viewed_names
from roboyard.cli.packages import PackageOption
from roboyard.cli.xacro_args import XacroArgOption
from roboyard.untrusted.text import json_text

if TYPE_CHECKING:
    from collections.abc import Iterator

    from rich.console import Console

    from roboyard.demo.run import Progress

EXAMPLES = """
Examples:

\b
  roboyard demo                               the bundled robot r1
  roboyard demo my_robot.urdf --out my_demo   your robot
"""

_PHASES = {
    "reading": ("loading the robot", 0.05),
    "settling": ("dropping it on the floor", 0.15),
    "views": ("rendering four views", 0.05),
    "moving": ("moving its joints", 0.65),
    "writing": ("writing the files", 0.10),
}
"""Phase to its text and its share of the progress bar."""


def demo(
    source: Annotated[
        str | None,
        typer.Argument(
            help="A URDF file, or the name of a robot; the bundled r1 by default.",
            metavar="[ROBOT]",
            show_default=False,
            autocompletion=viewed_names,
        ),
    ] = None,
    out: Annotated[Path, typer.Option("--out", help="Folder to write.")] = Path("demo"),
    package: PackageOption = None,
    xacro_arg: XacroArgOption = None,
    overwrite: Annotated[
        bool,
        typer.Option("--overwrite/--no-overwrite", help="Write also into a folder that holds other files."),
    ] = False,
    short: Annotated[bool, typer.Option("--short", help="Render fewer and smaller pictures.")] = False,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print the summary as JSON instead of tables.")
    ] = False,
) -> None:
    """Show a robot in motion: a video, four views, a plot and a summary.

    The robot is audited, repaired in a copy and dropped on a floor; then every joint moves through its range.
    """
    from rich.console import Console

    from roboyard.cli.robot_argument import given_robot
    from roboyard.demo.run import run_demo

    given = given_robot(source or "r1", package, xacro_arg)
    with _progress(Console(stderr=True)) as progress:
        result = run_demo(
            None if source is None else given.robot,
            out=out,
            packages=given.packages,
            xacro_args=given.xacro_args,
            overwrite=overwrite,
            short=short,
            progress=progress,
        )
    if as_json:
        print(json_text(result.summary))
        return
    from roboyard.demo.summary import print_tables

    print_tables(result.summary, str(result.folder), Console(file=sys.stdout))


@contextmanager
def _progress(console: Console) -> Iterator[Progress]:
    """Show a progress bar in a terminal; elsewhere print one line for each phase."""
    shares = list(_PHASES.values())
    before = {phase: sum(share for _, share in shares[:k]) for k, phase in enumerate(_PHASES)}
    if not console.is_terminal:
        printed: set[str] = set()

        def print_phase(phase: str, share: float) -> None:
            if phase not in printed:
                printed.add(phase)
                console.print(f"{_PHASES[phase][0]} ...", highlight=False)

        yield print_phase
        return
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    columns = (TextColumn("{task.description:<26}"), BarColumn(), TimeElapsedColumn())
    with Progress(*columns, console=console, transient=True) as progress:
        task = progress.add_task("", total=1.0)

        def draw(phase: str, share: float) -> None:
            text, part = _PHASES[phase]
            progress.update(task, description=text, completed=before[phase] + part * share)

        yield draw
