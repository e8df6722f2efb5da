"""`roboyard plan ROBOT --to`: a video and a plot, and errors that name the option."""

from __future__ import annotations

from pathlib import Path

import pytest
from PIL import Image

from roboyard import cli


@pytest.mark.slow
def test_a_motion_is_filmed_and_plotted(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    video, plot = tmp_path / "a.gif", tmp_path / "a.png"
    arguments = [
        "plan",
        "r1",
        "--arm",
        "left",
        "--to",
        "0.5,0.3,0.9",
        "--video",
        str(video),
        "--plot",
        str(plot),
    ]
    assert cli.main(arguments) == 0
    assert "way points" in capsys.readouterr().out
    with Image.open(video) as film:
        assert getattr(film, "n_frames", 1) > 8
    with Image.open(plot) as picture:
        assert len(picture.convert("RGB").resize((200, 180)).getcolors(40_000) or []) > 50


@pytest.mark.parametrize(
    ("arguments", "word"),
    [
        ([], "--problems"),
        (["r1"], "--to"),
        (["r1", "--to", "1,2"], "--to 1,2"),
        (["r1", "--to", "1,2,3", "--plot", "a.jpg"], "a.jpg"),
        (["--problems", "a.json"], "--out"),
        (["r1", "--problems", "a.json", "--out", "b"], "a.json"),
        (["no_robot", "--to", "1,2,3"], "no_robot"),
    ],
)
def test_wrong_options_are_named(arguments: list[str], word: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["plan", *arguments]) == 1
    assert word in capsys.readouterr().err
