"""Help of the command line: no truncated lines, examples with existing options, completions."""

from __future__ import annotations

import shlex
from pathlib import Path

import pytest

from roboyard import cli
from roboyard.cli.completion import robot_names, scene_names, viewed_names
from roboyard.scenes import SCENES


def help_of(capsys: pytest.CaptureFixture[str], *arguments: str) -> str:
    assert cli.main([*arguments, "--help"]) == 0
    return capsys.readouterr().out


def test_the_list_of_commands_is_grouped_and_not_truncated(capsys: pytest.CaptureFixture[str]) -> None:
    text = help_of(capsys)
    assert "..." not in text.replace("[ARGS]...", "")
    assert text.index("View:") < text.index("Control:") < text.index("About:")
    rows = [line for line in text.splitlines() if line.strip().split(" ")[0] in cli.COMMANDS]
    assert len(rows) == len(cli.COMMANDS)
    assert max(map(len, text.splitlines())) < 80


@pytest.mark.parametrize("command", ["", *(name for name in cli.COMMANDS if name != "version")])
def test_examples_use_existing_options(command: str, capsys: pytest.CaptureFixture[str]) -> None:
    text = help_of(capsys, *([command] if command else []))
    examples = [line.strip().split("   ")[0] for line in text.partition("Examples:")[2].splitlines()]
    examples = [arguments for line in examples if (arguments := shlex.split(line))[:1] == ["roboyard"]]
    assert examples
    for arguments in examples:
        known = help_of(capsys, arguments[1])
        for word in arguments[2:]:
            if word.startswith("--") and word != "--its-own":
                assert f"{word} " in known, arguments


def test_completion_offers_robots_and_scenes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    mine = tmp_path / "set" / "models" / "mine" / "mine.yaml"
    mine.parent.mkdir(parents=True)
    mine.write_text("")
    monkeypatch.setenv("ROBOYARD_DATA", str(tmp_path))
    assert robot_names("") == ["mine", "r1", "rover", "walker"]
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
