"""Every Python block of the README and the documentation runs as printed, page by page, in order."""

from __future__ import annotations

import re
import shutil
import textwrap
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from roboyard.assets import asset_path
from roboyard.audit.registry import CHECKS
from roboyard.pybullet.face.command_names import HOMES
from roboyard.pybullet.face.commands import COMMANDS
from roboyard.robots.control import REGISTERED_CONTROLLERS
from roboyard.robots.definition.schema import ADDED_CONTROLLERS

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
LONG = "README.md", "sensors.md", "skills.md"
"""Pages whose blocks take more than five seconds."""
BLOCK = re.compile(r"^```python\n(.*?)^```", re.MULTILINE | re.DOTALL)
OUTPUT = re.compile(r"^```python\n.*?^```\n\n((?:    [^\n]+\n)+)", re.MULTILINE | re.DOTALL)


def blocks(page: Path) -> list[tuple[int, str]]:
    """Line number and text of each block."""
    text = page.read_text(encoding="utf-8")
    return [(text.count("\n", 0, found.start(1)), found[1]) for found in BLOCK.finditer(text)]


@pytest.fixture
def registries() -> Iterator[None]:
    """Forget the entries of a page after it."""
    found: list[dict[str, Any]] = [CHECKS, REGISTERED_CONTROLLERS, HOMES]  # type: ignore[list-item]
    before, names = [dict(registry) for registry in found], list(ADDED_CONTROLLERS)
    yield
    for registry, content in zip(found, before, strict=True):
        for name in set(registry) - set(content):
            del registry[name]
            COMMANDS.entered.pop(name, None)
    ADDED_CONTROLLERS[:] = names


@pytest.mark.usefixtures("registries")
@pytest.mark.parametrize(
    "page",
    [
        pytest.param(page, marks=pytest.mark.slow) if page.name in LONG else page
        for page in PAGES
        if blocks(page)
    ],
    ids=lambda page: page.name,
)
def test_the_blocks_of_a_page_run(
    page: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("ROBOYARD_DATA", str(tmp_path / "data"))
    if page.name == "importing.md":  # its robot has an arm
        shutil.copytree(asset_path("arm7").parent, tmp_path, dirs_exist_ok=True)
        (tmp_path / "arm7.urdf").rename(tmp_path / "my_robot.urdf")
    else:
        shutil.copy(asset_path("cartpole"), tmp_path / "my_robot.urdf")
    names: dict[str, object] = {"__name__": "__main__"}
    for line, text in blocks(page):
        if "roboyard.viewer" in text:
            pytest.importorskip("viser")
            # a page is served for as long as the script runs; here for a few steps
            text = text.replace("while True:", "for _ in range(3):").replace("(world)", "(world, port=0)")
        if "run_demo" in text:
            text = text.replace("run_demo(", "run_demo(short=True, source=")
        code = compile("\n" * line + text, str(page), "exec")
        exec(code, names)
    viewer = names.get("viewer")
    if viewer is not None:
        viewer.close()  # type: ignore[attr-defined]
    printed = capsys.readouterr().out
    for found in OUTPUT.finditer(page.read_text(encoding="utf-8")):
        assert textwrap.dedent(found[1]) in printed
