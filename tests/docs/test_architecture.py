"""The files that the architecture pages name exist, and the picture is drawn from today's tree."""

from __future__ import annotations

import re
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT / "tools"))
import architecture_picture  # noqa: E402

PAGES = ("architecture.md", "where_to_change.md")


@pytest.mark.parametrize("page", PAGES)
def test_named_files_exist(page: str) -> None:
    text = (ROOT / "docs" / page).read_text(encoding="utf-8")
    paths = re.findall(r"`([\w/]+(?:\.py|/))`", text)
    assert len(paths) > 10
    missing = [
        p for p in paths if not any((ROOT / base / p).exists() for base in ("", "src", "src/roboyard"))
    ]
    assert not missing


def test_the_table_has_every_folder_in_its_layer() -> None:
    text = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
    for number, names in enumerate(architecture_picture.LAYERS, 1):
        for name in names:
            if (ROOT / "src" / "roboyard" / name).is_dir():
                assert re.search(rf"^\| {number} \|.*`{name}/`", text, flags=re.MULTILINE), name


def test_the_picture_is_up_to_date(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    drawn = tmp_path / "architecture.svg"
    monkeypatch.setattr(architecture_picture, "PICTURE", drawn)
    architecture_picture.main()
    hint = "run: python tools/architecture_picture.py"
    assert drawn.read_text() == (ROOT / "docs" / "images" / "architecture.svg").read_text(), hint
