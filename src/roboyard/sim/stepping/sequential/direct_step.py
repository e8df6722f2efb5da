"""The last step as compiled calls, for machine code that makes them again."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from roboyard._records import NamedTuple


class DirectStep(NamedTuple):
    """The calls of a step, which are the same as long as some attributes are."""

    kept: tuple[tuple[Any, str], ...]
    """Owner and name of each of these attributes."""
    manifolds: Any
    """Whose `_new` has to be empty."""
    find: Callable[..., Any]
    found: tuple[Any, ...]
    """Arguments of `find`."""
    execute: Callable[..., Any]
    executed: tuple[Any, ...]
    """Arguments of `execute`."""
    integrate: Callable[..., Any]
    """Called with model and data where `execute` returns DONE; else the step ends otherwise. External forces
    are cleared then."""
