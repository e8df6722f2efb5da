"""`roboyard import-all`: import every robot of a folder, on all cores or on a cluster."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from roboyard.cli.missing_meshes import MissingMeshesOption
from roboyard.untrusted.text import json_text, say

if TYPE_CHECKING:
    from roboyard.importer.collection.tasks import TaskResult

EXAMPLES = """
Examples:

\b
  roboyard import-all robots --jobs 8        all robots of a folder; again to continue after a stop
  roboyard import-all robots --retry         also those that failed before
  roboyard import-all robots --ray auto      on a Ray cluster
"""


def import_all(
    folder: Annotated[
        Path, typer.Argument(help="Folder with robot files.", metavar="DIR", show_default=False)
    ],
    jobs: Annotated[
        int | None,
        typer.Option(
            "--jobs", "-j", help="Robots at a time; the number of cores by default.", show_default=False
        ),
    ] = None,
    ray: Annotated[
        str | None,
        typer.Option(
            "--ray",
            metavar="ADDRESS",
            help="Import on the Ray cluster at this address (auto, local, ray://HOST:PORT).",
            show_default=False,
        ),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option("--out", "--data", help="Data folder, as in `roboyard import`.", show_default=False),
    ] = None,
    dataset: Annotated[
        str | None, typer.Option("--dataset", help="Folder below the data folder.", show_default=False)
    ] = None,
    timeout: Annotated[float, typer.Option(help="Longest time of one robot (s).")] = 900.0,
    retry: Annotated[
        bool, typer.Option("--retry", help="Import again what failed in an earlier run.")
    ] = False,
    overwrite: Annotated[
        bool, typer.Option("--overwrite", help="Replace robots that other imports made.")
    ] = False,
    missing_meshes: MissingMeshesOption = None,
    validate: Annotated[
        bool, typer.Option("--validate/--no-validate", help="Test each robot, as `roboyard validate` does.")
    ] = True,
    report: Annotated[bool, typer.Option("--report/--no-report", help="Write a page for each robot.")] = True,
    as_json: Annotated[bool, typer.Option("--json", help="Print the table as JSON.")] = False,
) -> None:
    """Import every robot below a folder, each in a process of its own.

    A robot that hangs, dies or is refused costs only itself. A run that was stopped continues where it was
    when it is started again; a robot whose file has changed since is imported again. At the end there is one
    table (table.csv, table.json) and one page with a picture of each robot (index.html).
    """
    from dataclasses import asdict

    from roboyard.cli.missing_meshes import read_missing_meshes
    from roboyard.importer.collection.run import import_collection

    made = import_collection(
        folder,
        out=out,
        dataset=dataset,
        jobs=jobs,
        ray=ray,
        timeout=timeout,
        retry=retry,
        overwrite=overwrite,
        validate=validate,
        report=report,
        missing_meshes=read_missing_meshes(missing_meshes),
        progress=_show,
    )
    if as_json:
        print(json_text([asdict(result) for result in made.results]))
        return
    counts: dict[str, int] = {}
    for result in made.results:
        counts[result.outcome] = counts.get(result.outcome, 0) + 1
    shown = ", ".join(f"{count} {outcome}" for outcome, count in counts.items())
    say(f"{len(made.results)} robots: {shown}; {made.reused} of them in an earlier run")
    say(f"table: {made.folder / 'table.csv'}")
    say(f"page: {made.page}")


def _show(result: TaskResult, done: int, count: int) -> None:
    """Print one line for each robot to standard error."""
    note = f": {result.message}" if result.message else ""
    say(f"{done}/{count} {result.name}: {result.outcome} in {result.seconds:.1f} s{note}", to_errors=True)
