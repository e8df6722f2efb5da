from __future__ import annotations

from collections.abc import Iterator

import pytest

import roboyard.pybullet as p


@pytest.fixture
def client() -> Iterator[int]:
    """A DIRECT client of its own; every client that a test leaves open is closed."""
    number = p.connect(p.DIRECT)
    yield number
    close_all()


def close_all() -> None:
    from roboyard.pybullet.connections import CLIENTS

    for number in list(CLIENTS):
        p.disconnect(number)
