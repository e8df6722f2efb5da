"""The table of commands of a client, by PyBullet's function name.

A command is a function `name(client, ...)` with PyBullet's argument names and defaults. The public functions
are created from the table, and a server accepts no other calls. A command's module is imported when the
command is first looked up, since a script uses few of them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from importlib import import_module
from typing import Any, TypeVar

from roboyard._lazy import paused_collection
from roboyard._records import NamedTuple
from roboyard.pybullet.face.command_names import HOMES

F = TypeVar("F", bound=Callable[..., Any])


class Command(NamedTuple):
    """One entry of the table."""

    function: Callable[..., Any]
    """`name(client, ...)`."""
    aliases: Mapping[str, str]
    """Old spelling of a parameter to its current name."""
    is_public: bool
    """False if the public function is in `calling_forms` because its calling forms are irregular."""


class CommandTable(Mapping[str, Command]):
    """All commands by name; those of a module are entered when it is imported."""

    def __init__(self, homes: Mapping[str, str]) -> None:
        """Create the table.

        Args:
            homes: name of every command to the full name of the module that defines it.
        """
        self._homes = homes
        self.entered: dict[str, Command] = {}
        """Commands whose modules are imported."""

    def __getitem__(self, name: str) -> Command:
        """Return a command, importing its module; raise KeyError where there is none of this name."""
        if name not in self.entered:
            with paused_collection():
                import_module(self._homes[name])
        return self.entered[name]

    def __contains__(self, name: object) -> bool:
        return name in self._homes

    def __iter__(self) -> Iterator[str]:
        return iter(self._homes)

    def __len__(self) -> int:
        return len(self._homes)


COMMANDS = CommandTable(HOMES)


def command(
    *, name: str | None = None, aliases: Mapping[str, str] | None = None, is_public: bool = True
) -> Callable[[F], F]:
    """Return a decorator that enters a function in the table.

    Args:
        name: name in the table; None for the function's own.
        aliases: old spelling of a parameter to its current name.
        is_public: whether a public function is created from it.
    """

    def enter(function: F) -> F:
        COMMANDS.entered[name or function.__name__] = Command(function, aliases or {}, is_public)
        return function

    return enter
