"""The option `--missing-meshes`, shared by the commands that import robots."""

from __future__ import annotations

from enum import StrEnum
from typing import Annotated, Literal

import typer


class MissingMeshes(StrEnum):
    """Whether shapes whose mesh file is missing are omitted with a warning, or are an error."""

    warn = "warn"
    error = "error"


MissingMeshesOption = Annotated[
    MissingMeshes | None,
    typer.Option(
        "--missing-meshes",
        help="Shapes whose mesh file is missing: warn omits them, error refuses the robot. "
        "By default visual shapes are omitted, collision shapes refused.",
        show_default=False,
    ),
]


def read_missing_meshes(given: MissingMeshes | None) -> Literal["warn", "error"] | None:
    """Return the option as text."""
    if given is None:
        return None
    return "warn" if given is MissingMeshes.warn else "error"
