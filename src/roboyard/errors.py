"""Every error Roboyard raises on purpose.

    RoboyardError
    ├── DescriptionError      a robot description (URDF, MJCF, USD) says something that cannot be used
    │   └── MeshError         a mesh file is missing, unreadable or empty
    ├── ConfigError           a YAML or command line configuration is wrong
    ├── ModelError            the physics engine refuses the world that was asked for
    ├── StaleHandleError      a handle outlived the body it points to
    └── MissingExtraError     an optional dependency is not installed

Messages read `file:line: element: what is wrong; how to mend it` on one line.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from difflib import get_close_matches
from pathlib import Path


class RoboyardError(Exception):
    """Base of every error that Roboyard raises on purpose."""


class DescriptionError(RoboyardError):
    """A robot description says something that cannot be used.

    Attributes:
        problems: one line for each problem found; the first is the message's first line.
        file: the description's path, where there is one.
        line: line in `file` (1-based), where known.
        element: the element at fault, as in `joint "elbow"`.
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
        """Join several errors into one that reports them all, in order."""
        if len(errors) == 1:
            return errors[0]
        lines = [line for error in errors for line in error.problems]
        joined = cls("several problems", file=errors[0].file, line=errors[0].line, problems=lines)
        joined.element = errors[0].element
        return joined


class MeshError(DescriptionError):
    """A mesh file is missing, unreadable or empty."""


class ConfigError(RoboyardError):
    """A configuration is wrong."""


class ModelError(RoboyardError):
    """The physics engine refuses the world that was asked for."""


class StaleHandleError(RoboyardError):
    """A handle outlived the body it points to."""


class MissingExtraError(RoboyardError):
    """An optional dependency is not installed."""

    def __init__(self, package: str, extra: str, what_for: str) -> None:
        super().__init__(f'{what_for} needs {package}; install it with: pip install "roboyard[{extra}]"')


def unknown_name(kind: str, name: str, known: Iterable[str]) -> str:
    """Message for an unknown name, with the nearest and the available ones."""
    names = list(known)
    near = get_close_matches(name, names, n=1)
    hint = f"; did you mean {near[0]!r}?" if near else ""
    shown = ", ".join(names[:12]) + (f", ... ({len(names)} in all)" if len(names) > 12 else "")
    return f"no {kind} named {name!r}{hint} (available: {shown or 'none'})"
