"""The option `--xacro-arg NAME:=VALUE`, shared by the commands that read robots."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated

import typer

from roboyard.errors import ConfigError

XacroArgOption = Annotated[
    list[str] | None,
    typer.Option(
        "--xacro-arg",
        metavar="NAME:=VALUE",
        help="Value of an argument of a xacro file; may be given again.",
        show_default=False,
    ),
]


def read_xacro_args(given: Sequence[str]) -> dict[str, str]:
    """Return argument name to value.

    Raises:
        ConfigError: an argument is not NAME:=VALUE.
    """
    found = {}
    for text in given:
        name, mark, value = text.partition(":=")
        if not (name.strip() and mark):
            raise ConfigError(f"--xacro-arg {text}: write NAME:=VALUE, as in ur_type:=ur5e")
        found[name.strip()] = value
    return found
