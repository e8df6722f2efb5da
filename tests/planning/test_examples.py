"""The example that plans for a body loaded through PyBullet's functions."""

from __future__ import annotations

import importlib
import sys
from pathlib import Path

import pytest

EXAMPLES = Path(__file__).parents[2] / "examples"


@pytest.mark.slow
def test_a_pybullet_script_plans_around_a_wall(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.syspath_prepend(str(EXAMPLES))
    example = importlib.import_module("pybullet_planning")
    picture = tmp_path / "arm.png"
    assert example.main(picture) > 0.0005, "the planner keeps half a millimetre"
    assert picture.stat().st_size > 1000
    assert "planned in" in capsys.readouterr().out
    sys.modules.pop("pybullet_planning")
