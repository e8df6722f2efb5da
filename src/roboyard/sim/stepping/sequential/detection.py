"""The compiled calls that find the contacts of the present positions, for machine code that makes them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from roboyard._records import NamedTuple


class Detection(NamedTuple):
    """The compiled calls, which are the same as long as some attributes are."""

    kept: tuple[Any, ...]
    """Owner, name and value of each of these attributes, one after another."""
    manifolds: Any
    """Whose `_new` has to be empty."""
    collide: Callable[..., Any]
    collided: tuple[Any, ...]
    """Arguments of `collide`."""
    execute: Callable[..., Any]
    executed: tuple[Any, ...]
    """Arguments of `execute`."""
    finish: Callable[[int], None]
    """Takes the answer of `execute` where that is not DONE and not ROWS_ARE_OLD, instead of `shift`."""
    shift: Callable[..., Any]
    shifted: tuple[Any, ...]
    """Arguments of `shift`."""
