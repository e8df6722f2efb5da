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
    """Package name to folder.

    Raises:
        ConfigError: a word is not NAME=PATH, or the path is no folder.
    """
    found = {}
    for word in given:
        name, equals, path = word.partition("=")
        if not (name and equals and path):
            raise ConfigError(f"--package {word}: write NAME=PATH, as in my_robot_description=robots/mine")
        folder = Path(path)
        if not folder.is_dir():
            raise ConfigError(f"--package {word}: {path} is no folder; name the package's own folder")
        found[name] = folder
    return found
