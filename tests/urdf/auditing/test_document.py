"""docs/findings.md lists every code, and is what the registry says."""

from pathlib import Path

from roboyard.urdf.auditing import CHECKS
from roboyard.urdf.auditing.document import findings_document

PAGE = Path(__file__).parents[3] / "docs" / "findings.md"


def test_the_page_is_up_to_date() -> None:
    hint = "run: python -m roboyard.urdf.auditing.document > docs/findings.md"
    assert PAGE.read_text(encoding="utf-8") == findings_document(), hint


def test_every_code_stands_in_one_row_with_an_example() -> None:
    rows = [line for line in findings_document().splitlines() if line.startswith("| `")]
    assert [row.split("`")[1] for row in rows if row.split("`")[1] in CHECKS] == [
        row.split("`")[1] for row in rows
    ]
    assert {row.split("`")[1] for row in rows} == set(CHECKS)
    assert all(len(row.replace("\\|", "").split("|")) == 8 for row in rows)
