"""The table of commands of a client, by PyBullet's function name.

A command is a function `name(client, ...)` with PyBullet's argument names and defaults. The public functions
are created from the table, and a server accepts no other calls.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, TypeVar

F = TypeVar("F", bound=Callable[..., Any])


@dataclass(frozen=True, kw_only=True, slots=True)
class Command:
    """One entry of the table."""

    function: Callable[..., Any]
    """`name(client, ...)`."""
    aliases: Mapping[str, str] = field(default_factory=dict)
    """Old spelling of a parameter to its current name."""
    is_public: bool = True
    """False if the public function is in `calling_forms` because its calling forms are irregular."""


COMMANDS: dict[str, Command] = {}


def command(
    *, name: str | None = None, aliases: Mapping[str, str] | None = None, is_public: bool = True
) -> Callable[[F], F]:
    """Return a decorator that adds a function to the table.

    Args:
        name: name in the table; None for the function's own.
        aliases: old spelling of a parameter to its current name.
        is_public: whether a public function is created from it.
    """

    def enter(function: F) -> F:
        entry = Command(function=function, aliases=aliases or {}, is_public=is_public)
        COMMANDS[name or function.__name__] = entry
        return function

    return enter
