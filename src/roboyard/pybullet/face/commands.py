"""The table of commands: what a client can be asked to do, by PyBullet's function name.

A command is a function `name(client, ...)` with PyBullet's argument names and defaults. The table is all that
a server lets its clients call, and what the public functions are made from.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, TypeVar

F = TypeVar("F", bound=Callable[..., Any])


@dataclass(frozen=True, kw_only=True, slots=True)
class Command:
    function: Callable[..., Any]
    aliases: Mapping[str, str] = field(default_factory=dict)
    """Old spelling of an argument to its name now."""
    is_public: bool = True
    """False where the public function is written by hand because its calling forms are irregular."""


COMMANDS: dict[str, Command] = {}


def command(
    *, name: str | None = None, aliases: Mapping[str, str] | None = None, is_public: bool = True
) -> Callable[[F], F]:
    """Enter a function in the table, under its own name unless another is given."""

    def enter(function: F) -> F:
        entry = Command(function=function, aliases=aliases or {}, is_public=is_public)
        COMMANDS[name or function.__name__] = entry
        return function

    return enter
