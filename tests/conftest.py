"""Python's garbage collector does not pass through the tests themselves.

Collecting the tests leaves a million objects that live to the end: each full pass through them takes half a
second, and some tests, and every few hundred worlds, need one.
"""

from __future__ import annotations

import gc
from collections.abc import Generator

import pytest


@pytest.hookimpl(wrapper=True, tryfirst=True)
def pytest_collection() -> Generator[None, object, object]:
    """Pause the collector while tests are collected, and except what there is then."""
    gc.disable()
    try:
        return (yield)
    finally:
        gc.collect()
        gc.freeze()
        gc.enable()
