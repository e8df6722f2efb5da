from __future__ import annotations

import json
import math
import sys
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import roboyard.pybullet as p

sys.path.insert(0, str(Path(__file__).parent))

RECORDED = Path(__file__).parent / "data" / "recorded_api.json"
"""Results of the `record_...` functions of `api/` in PyBullet 3.2.7, written by tools/record_pybullet.py."""


@pytest.fixture
def client() -> Iterator[int]:
    """A DIRECT client; every client that a test leaves open is closed."""
    number = p.connect(p.DIRECT)
    yield number
    close_all()


@pytest.fixture
def window(monkeypatch: pytest.MonkeyPatch) -> Iterator[int]:
    """A GUI client without a page; every client that a test leaves open is closed."""
    monkeypatch.setenv("ROBOYARD_VIEWER", "0")
    number = p.connect(p.GUI)
    yield number
    close_all()


def close_all() -> None:
    from roboyard.pybullet.connections import CLIENTS
    from roboyard.pybullet.state.file_search import OF_PROCESS

    for number in list(CLIENTS):
        p.disconnect(number)
    OF_PROCESS.folder = None


@pytest.fixture
def agrees(request: pytest.FixtureRequest, client: int, tmp_path: Path) -> Callable[..., None]:
    """`agrees(record_function, tolerance)` compares a result with the one recorded from PyBullet."""

    def check(scenario: Callable[..., Any], tolerance: float = 1e-9) -> None:
        key = f"{request.path.stem}.{scenario.__name__}"
        expected = json.loads(RECORDED.read_text(encoding="utf-8"))[key]
        compare(expected, plain(scenario(p, tmp_path)), tolerance, key)

    return check


def plain(value: Any) -> Any:
    """A result as JSON has it: lists, numbers, texts."""
    if isinstance(value, bytes):
        return value.decode()
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    if isinstance(value, tuple | list):
        return [plain(item) for item in value]
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    return value


def compare(expected: Any, actual: Any, tolerance: float, where: str) -> None:
    """Fail where two results differ; numbers may differ by `tolerance`, absolute or relative."""
    if isinstance(expected, list):
        assert isinstance(actual, list), f"{where}: expected a list, got {actual!r}"
        assert len(actual) == len(expected), f"{where}: {len(expected)} items expected, got {actual!r}"
        for index, (one, other) in enumerate(zip(expected, actual, strict=True)):
            compare(one, other, tolerance, f"{where}[{index}]")
    elif isinstance(expected, dict):
        assert isinstance(actual, dict), f"{where}: expected a mapping, got {actual!r}"
        assert sorted(actual) == sorted(expected), where
        for key, one in expected.items():
            compare(one, actual[key], tolerance, f"{where}[{key!r}]")
    elif isinstance(expected, float) and isinstance(actual, int | float):
        both_nan = math.isnan(expected) and math.isnan(actual)
        near = abs(actual - expected) <= tolerance * max(1.0, abs(expected))
        assert both_nan or near, f"{where}: PyBullet has {expected!r}, got {actual!r}"
    else:
        assert actual == expected, f"{where}: PyBullet has {expected!r}, got {actual!r}"
