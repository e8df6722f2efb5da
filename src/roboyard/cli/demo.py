"""`roboyard demo`: a robot description becomes a robot that moves, with pictures."""

from __future__ import annotations

import sys
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from roboyard.cli.completion import viewed_names
from roboyard.cli.packages import PackageOption

if TYPE_CHECKING:
    from collections.abc import Iterator

    from rich.console import Console

    from roboyard.demo.run import Report

EXAMPLES = """
Examples:

\b
  roboyard demo                               the bundled robot r1
  roboyard demo my_robot.urdf --out my_demo   your robot
"""

_ACTS = {
    "reading": ("reading the robot", 0.05),
    "settling": ("dropping it on the floor", 0.15),
    "views": ("taking four views", 0.05),
    "moving": ("moving its joints", 0.65),
    "writing": ("writing the files", 0.10),
}
"""Act to its words and its share of the progress bar."""


def demo(
    source: Annotated[
        str | None,
        typer.Argument(
            help="A URDF file, or the name of a robot; the bundled r1 by default.",
            metavar="SOURCE",
            show_default=False,
            autocompletion=viewed_names,
        ),
    ] = None,
    out: Annotated[Path, typer.Option("--out", help="Folder to write.")] = Path("demo"),
    package: PackageOption = None,
    overwrite: Annotated[
        bool,
        typer.Option("--overwrite/--no-overwrite", help="Write also into a folder that holds other things."),
    ] = False,
    short: Annotated[bool, typer.Option("--short", help="Smaller pictures and fewer of them.")] = False,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print the summary as JSON instead of tables.")
    ] = False,
) -> None:
    """Show a robot that moves: a film, four views, a plot and a summary.

    The robot is read, mended in a copy, dropped on a floor, and every joint goes through its range.
    """
    from rich.console import Console

    from roboyard.cli.packages import read_packages
    from roboyard.demo.run import run_demo

    packages = read_packages(package or [])
    with _progress(Console(stderr=True)) as report:
        result = run_demo(source, out=out, packages=packages, overwrite=overwrite, short=short, report=report)
    if as_json:
        import json

        print(json.dumps(result.summary, indent=2, ensure_ascii=False))
        return
    from roboyard.demo.summary import print_tables

    print_tables(result.summary, str(result.folder), Console(file=sys.stdout))


@contextmanager
def _progress(console: Console) -> Iterator[Report]:
    """A progress bar in a terminal; elsewhere one line for each act."""
    shares = list(_ACTS.values())
    before = {act: sum(share for _, share in shares[:k]) for k, act in enumerate(_ACTS)}
    if not console.is_terminal:
        told: set[str] = set()

        def say(act: str, share: float) -> None:
            if act not in told:
                told.add(act)
                console.print(f"{_ACTS[act][0]} ...", highlight=False)

        yield say
        return
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    columns = (TextColumn("{task.description:<26}"), BarColumn(), TimeElapsedColumn())
    with Progress(*columns, console=console, transient=True) as progress:
        task = progress.add_task("", total=1.0)

        def draw(act: str, share: float) -> None:
            words, part = _ACTS[act]
            progress.update(task, description=words, completed=before[act] + part * share)

        yield draw
