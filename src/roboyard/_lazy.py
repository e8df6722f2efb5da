"""Modules that are imported when they are first needed: numba takes a while to load."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache, partial
from importlib import import_module
from typing import Any


def lazy_module(name: str) -> Callable[[], Any]:
    """What gives the module of this name; cheaper than an import statement where every step passes."""
    return cache(partial(import_module, name))
