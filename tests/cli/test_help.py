"""What the command line says about itself: every line whole, examples that exist, names for the tab key."""

from __future__ import annotations

import shlex
from pathlib import Path

import pytest

from roboyard import cli
from roboyard.cli.completion import robot_names, scene_names, viewed_names
from roboyard.scenes import SCENES


def shown(capsys: pytest.CaptureFixture[str], *words: str) -> str:
    assert cli.main([*words, "--help"]) == 0
    return capsys.readouterr().out


def test_the_list_of_commands_is_grouped_and_never_cut(capsys: pytest.CaptureFixture[str]) -> None:
    text = shown(capsys)
    assert "..." not in text.replace("[ARGS]...", "")
    assert text.index("See it:") < text.index("Drive it:") < text.index("About:")
    rows = [line for line in text.splitlines() if line.strip().split(" ")[0] in cli.COMMANDS]
    assert len(rows) == len(cli.COMMANDS)
    assert max(map(len, text.splitlines())) < 80


@pytest.mark.parametrize("command", ["", *(name for name in cli.COMMANDS if name != "version")])
def test_examples_use_options_that_there_are(command: str, capsys: pytest.CaptureFixture[str]) -> None:
    text = shown(capsys, *([command] if command else []))
    examples = [line.strip().split("   ")[0] for line in text.partition("Examples:")[2].splitlines()]
    examples = [words for line in examples if (words := shlex.split(line))[:1] == ["roboyard"]]
    assert examples
    for words in examples:
        known = shown(capsys, words[1])
        for word in words[2:]:
            if word.startswith("--") and word != "--its-own":
                assert f"{word} " in known, words


def test_tab_offers_robots_scenes_and_files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    mine = tmp_path / "set" / "models" / "mine" / "mine.yaml"
    mine.parent.mkdir(parents=True)
    mine.write_text("")
    monkeypatch.setenv("ROBOYARD_DATA", str(tmp_path))
    assert robot_names("") == ["mine", "r1", "rover"]
    assert robot_names("r") == ["r1", "rover"]
    assert "arm7" in viewed_names("a")
    assert scene_names("") == list(SCENES)


def test_bash_completes_commands_and_names(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def offered(line: str) -> list[str]:
        monkeypatch.setenv("_ROBOYARD_COMPLETE", "complete_bash")
        monkeypatch.setenv("COMP_WORDS", line)
        monkeypatch.setenv("COMP_CWORD", str(len(line.split(" ")) - 1))
        cli.main([])
        return capsys.readouterr().out.split()

    assert offered("roboyard re") == ["repair", "replay"]
    assert "--scene" in offered("roboyard drive --s")
    assert offered("roboyard drive r1 --scene ho") == ["home"]
    assert "rover" in offered("roboyard validate ro")
