"""Errors that Roboyard raises.

    RoboyardError
    ├── DescriptionError      a robot description (URDF, MJCF, USD, ...) is invalid or missing
    │   └── MeshError         a mesh file is missing, unreadable or empty
    ├── ConfigError           a YAML or command line configuration is invalid
    ├── ModelError            the physics engine rejects the world
    ├── StaleHandleError      a handle refers to a body that was removed
    └── MissingExtraError     an optional dependency is not installed

Messages have one line: `file:line: element: cause; remedy`.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from pathlib import Path


class RoboyardError(Exception):
    """Base class of all errors that Roboyard raises."""


class DescriptionError(RoboyardError):
    """A robot description is invalid or missing.

    Attributes:
        problems: one line for each error; the first is the first line of the message.
        file: path of the description, if it has one.
        line: line number in `file` (1-based), if known.
        element: the element concerned, such as `joint "elbow"`.
    """

    def __init__(
        self,
        message: str,
        *,
        file: Path | str | None = None,
        line: int | None = None,
        element: str | None = None,
        problems: Sequence[str] = (),
    ) -> None:
        self.file = None if file is None else Path(file)
        self.line = line
        self.element = element
        where = ""
        if self.file is not None:
            where = f"{self.file.name}:{line}: " if line else f"{self.file.name}: "
        what = f"{element}: " if element else ""
        first = f"{where}{what}{message}"
        self.problems: tuple[str, ...] = tuple(problems) or (first,)
        super().__init__("\n".join(self.problems))

    @classmethod
    def collect(cls, errors: Sequence[DescriptionError]) -> DescriptionError:
        """Return one error that reports several, in order."""
        if len(errors) == 1:
            return errors[0]
        lines = [line for error in errors for line in error.problems]
        joined = cls("several problems", file=errors[0].file, line=errors[0].line, problems=lines)
        joined.element = errors[0].element
        return joined


class MeshError(DescriptionError):
    """A mesh file is missing, unreadable or empty."""


class ConfigError(RoboyardError):
    """A configuration is invalid."""


class ModelError(RoboyardError):
    """The physics engine rejects the world."""


class StaleHandleError(RoboyardError):
    """A handle refers to a body that was removed."""


class MissingExtraError(RoboyardError):
    """An optional dependency is not installed."""

    def __init__(self, package: str, extra: str, what_for: str) -> None:
        super().__init__(f'{what_for} needs {package}; install the extra "{extra}": {install_command(extra)}')


def install_command(extra: str) -> str:
    """Return the command that installs the packages of an extra, however Roboyard itself was installed."""
    from importlib import metadata

    try:
        requirements = metadata.requires("roboyard") or []
    except metadata.PackageNotFoundError:
        requirements = []
    marked = (line.partition(";") for line in requirements)
    wanted = [
        name.strip() for name, _, marker in marked if re.search(rf"extra\s*==\s*['\"]{extra}['\"]", marker)
    ]
    return "pip install " + " ".join(f'"{name}"' for name in wanted or [f"roboyard[{extra}]"])


def unknown_name(kind: str, name: str, known: Iterable[str]) -> str:
    """Return the message for an unknown name, with the nearest and the available names."""
    from difflib import get_close_matches

    names = list(known)
    near = get_close_matches(name, names, n=1)
    hint = f"; did you mean {near[0]!r}?" if near else ""
    shown = ", ".join(names[:12]) + (f", ... ({len(names)} in all)" if len(names) > 12 else "")
    return f"no {kind} named {name!r}{hint} (available: {shown or 'none'})"
