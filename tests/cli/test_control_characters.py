"""Names from files reach the terminal with their control characters escaped."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from roboyard.cli import main
from roboyard.untrusted.text import one_line

NASTY = "a&#10;b\x9b31m[red]\u202ec\x85"
"""A line break, a terminal's control sequence, rich's markup and a change of direction."""
INERTIAL = (
    '<inertial><mass value="1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>'
    '<collision><geometry><box size="1 1 1"/></geometry></collision>'
)


def robot() -> str:
    links = "".join(f'<link name="{name}">{INERTIAL}</link>' for name in (NASTY, NASTY + "2"))
    joint = f'<joint name="{NASTY}" type="fixed"><parent link="{NASTY}"/><child link="{NASTY}2"/></joint>'
    return f'<robot name="{NASTY}">{links}{joint}<transmission name="{NASTY}"/></robot>'


@pytest.mark.parametrize(
    "words",
    [
        ["audit", "{d}/r.urdf"],
        ["audit", "{d}/r.urdf", "--json"],
        ["audit", "{d}/r.urdf", "--all"],
        ["repair", "{d}/r.urdf", "--out", "{d}/out"],
        ["repair", "{d}/r.urdf", "--out", "{d}/out", "--json"],
        ["import", "{d}/r.urdf", "--name", "r", "--data", "{d}/data", "--no-validate"],
        ["import", "{d}/r.urdf", "--name", "r", "--data", "{d}/data", "--no-validate", "--json"],
        ["infer", "{d}/r.urdf", "--json"],
        ["audit", "{d}/c.yaml"],
        ["demo", "{d}/r.urdf", "--short", "--out", "{d}/demo"],
    ],
)
def test_control_characters_are_escaped(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], words: list[str]
) -> None:
    (tmp_path / "r.urdf").write_text(robot())
    (tmp_path / "c.yaml").write_text('"a\\e[31m": 1\nurdf_path: "\\e]0;x\\a"\nname: "\\u202e"\n')
    main([word.replace("{d}", str(tmp_path)) for word in words])
    said = capsys.readouterr()
    for text in (said.out, said.err):
        for line in text.splitlines(keepends=True):
            assert one_line(line.rstrip("\n")) == line.rstrip("\n")
        assert "\nb" not in text
    if "--json" in words and said.out:
        json.loads(said.out)
