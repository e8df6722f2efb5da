"""Modules that are imported when one of their names is first used."""

from __future__ import annotations

import subprocess
import sys
from types import ModuleType

import pytest

from roboyard._lazy import Deferred, LazyLogger, deferred


def _printed(code: str) -> str:
    return subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    ).stdout.strip()


def test_a_deferred_module_gives_the_names_of_the_real_one_when_it_is_used() -> None:
    sys.modules.pop("colorsys", None)
    with deferred("colorsys", "sys") as waiting:
        import colorsys

        assert waiting == ["colorsys"]
        assert isinstance(colorsys, Deferred)
    assert "colorsys" not in sys.modules
    assert colorsys.rgb_to_hsv(1.0, 0.0, 0.0) == (0.0, 1.0, 1.0)
    assert type(sys.modules["colorsys"]) is ModuleType


def test_a_module_that_is_used_meanwhile_stays_imported() -> None:
    sys.modules.pop("colorsys", None)
    with deferred("colorsys"):
        import colorsys

        assert colorsys.hsv_to_rgb(0.0, 1.0, 1.0) == (1.0, 0.0, 0.0)
    assert type(sys.modules["colorsys"]) is ModuleType


def test_a_logger_is_the_one_of_its_name(caplog: pytest.LogCaptureFixture) -> None:
    LazyLogger("roboyard.of.this.test").warning("%s happened", "it")
    assert [(r.name, r.getMessage()) for r in caplog.records] == [("roboyard.of.this.test", "it happened")]


def test_programs_start_without_modules_that_they_do_not_use() -> None:
    code = """
import sys
sys.argv = ["roboyard"]
from roboyard.pybullet.running import preload
preload()
unused = "zipfile", "subprocess", "logging", "difflib"
print([name for name in unused if name in sys.modules])
"""
    assert _printed(code) == "[]"
