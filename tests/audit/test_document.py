"""docs/findings.md lists every code, and is what the registry says."""

import sys
from pathlib import Path

from roboyard.audit import CHECKS

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT / "tools"))
from findings_doc import findings_document  # noqa: E402

PAGE = ROOT / "docs" / "findings.md"


def test_the_page_is_up_to_date() -> None:
    hint = "run: python tools/findings_doc.py > docs/findings.md"
    assert PAGE.read_text(encoding="utf-8") == findings_document(), hint


def test_every_code_stands_in_one_row_with_an_example() -> None:
    rows = [line for line in findings_document().splitlines() if line.startswith("| `")]
    assert [row.split("`")[1] for row in rows if row.split("`")[1] in CHECKS] == [
        row.split("`")[1] for row in rows
    ]
    assert {row.split("`")[1] for row in rows} == set(CHECKS)
    assert all(len(row.replace("\\|", "").split("|")) == 8 for row in rows)
