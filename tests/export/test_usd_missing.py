"""Without OpenUSD, writing USD says what to install."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from roboyard.description.robot_model import RobotModel
from roboyard.errors import MissingExtraError
from roboyard.export import usd


def test_the_message_names_the_extra(
    robot: RobotModel, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in [name for name in sys.modules if name.startswith(("pxr", "roboyard.export.usd."))]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "pxr", None)
    with pytest.raises(MissingExtraError, match='the extra "usd": pip install "usd-core'):
        usd.write(robot, tmp_path / "a.usda")
    assert not list(tmp_path.iterdir())
