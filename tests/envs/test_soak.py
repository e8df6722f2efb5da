"""Random actions for simulated hours: finite numbers, memory that does not grow (`benchmarks/soak.py`)."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path
from typing import Any

import pytest

from roboyard.envs import task_ids

HOURS = 0.2
FILE = Path(__file__).parents[2] / "benchmarks" / "soak.py"


@pytest.fixture(scope="module")
def tool() -> Any:
    spec = importlib.util.spec_from_file_location("soak", FILE)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules["soak"] = module
    spec.loader.exec_module(module)
    return module


@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc/self/statm").is_file(), reason="reads memory from /proc")
@pytest.mark.parametrize("task", [id for id in task_ids() if id.startswith("roboyard/")])
def test_every_task_survives_random_actions(tool: Any, task: str) -> None:
    found = tool.soak(task, HOURS, 32, threads=1)
    assert found.hours == pytest.approx(HOURS, rel=0.02)
    assert found.episodes >= 32
    assert found.diverged == 0
    assert found.grown < 16.0 * HOURS  # MB; below 0.1 where nothing leaks
    assert 0.0 < found.largest < 1e3


def test_a_run_that_was_cut_short_goes_on(
    tool: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    ran: list[tuple[str, float, int]] = []

    def soak(task: str, hours: float, count: int, *, seed: int, threads: int) -> Any:
        ran.append((task, hours, seed))
        if len(ran) == 2:
            raise KeyboardInterrupt
        return tool.Soaked(hours=hours, episodes=count, diverged=0, grown=float(seed), cpu=1.0, largest=2.0)

    log = tmp_path / "parts.jsonl"
    monkeypatch.setattr(tool, "soak", soak)
    monkeypatch.setattr(
        sys, "argv", ["soak", "--hours", "7", "--log", str(log), "--tasks", "roboyard/Push-v0"]
    )
    with pytest.raises(KeyboardInterrupt):
        tool.main()
    assert tool.main() == 0
    assert ran == [("roboyard/Push-v0", hours, seed) for hours, seed in [(3, 0), (3, 1), (3, 1), (1, 2)]]
    row = capsys.readouterr().out.splitlines()[-1].split()
    assert row == ["roboyard/Push-v0", "7.0", "192", "0", "2.0", "2", "3"]
