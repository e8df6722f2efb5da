"""`roboyard repair`: mend what can be mended without guessing."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from roboyard.cli.packages import PackageOption

EXAMPLES = """
Examples:

\b
  roboyard repair my_robot.urdf --out mended
  roboyard repair my_robot.urdf --out mended --only inertial-missing
"""


def repair(
    file: Annotated[Path, typer.Argument(help="A URDF.", metavar="FILE", show_default=False)],
    out: Annotated[Path, typer.Option("--out", help="Folder to write the repaired robot into.")],
    only: Annotated[
        list[str] | None,
        typer.Option(
            "--only", metavar="CODE", help="Mend this code; may be given again.", show_default=False
        ),
    ] = None,
    keep: Annotated[
        list[str] | None,
        typer.Option(
            "--keep", metavar="CODE", help="Leave this code as it is; may be given again.", show_default=False
        ),
    ] = None,
    package: PackageOption = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the log as JSON.")] = False,
) -> None:
    """Mend a robot description in a new folder.

    What needs no guess is mended and logged, then what is left is told; the original stays as it is.
    Exit code 0: the result is usable; 1: something is left that makes it unusable.
    """
    from roboyard.cli.packages import read_packages
    from roboyard.repair import repair_urdf

    result = repair_urdf(file, out, only=only or (), keep=keep or (), packages=read_packages(package or []))
    if as_json:
        import json

        print(json.dumps(result.to_json(), indent=2, ensure_ascii=False))
    else:
        for mend in result.mends:
            where = f"{file.name}:{mend.line}" if mend.line else file.name
            element = f"{mend.element}: " if mend.element else ""
            print(f"{where}: {element}{mend.before} -> {mend.after} [{mend.code}]")
        from roboyard.audit.report import report_lines

        print(f"{len(result.mends)} mends, {len(result.staged)} files staged; wrote {result.urdf}")
        print("\n".join(report_lines(result.after)))
    raise typer.Exit(0 if result.after.is_usable else 1)
