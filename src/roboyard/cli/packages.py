"""The option `--package NAME=PATH`, shared by the commands that read robots."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer

from roboyard.errors import ConfigError

PackageOption = Annotated[
    list[str] | None,
    typer.Option(
        "--package",
        metavar="NAME=PATH",
        help="Folder of a package:// name; may be given again.",
        show_default=False,
    ),
]


def read_packages(given: Sequence[str]) -> dict[str, Path]:
    """Return package name to folder.

    Raises:
        ConfigError: an argument is not NAME=PATH, or the path is no folder.
    """
    found = {}
    for text in given:
        name, equals, path = text.partition("=")
        if not (name and equals and path):
            raise ConfigError(f"--package {text}: write NAME=PATH, as in my_robot_description=robots/mine")
        folder = Path(path)
        if not folder.is_dir():
            raise ConfigError(f"--package {text}: {path} is no folder; name the package's own folder")
        found[name] = folder
    return found
