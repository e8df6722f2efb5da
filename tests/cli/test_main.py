"""The command line: exit codes, one line for each error, and a fast start."""

from __future__ import annotations

import errno
import os
import shutil
import subprocess
import sys
import textwrap
from pathlib import Path

import pytest

import roboyard
from roboyard import cli
from roboyard.errors import DescriptionError, RoboyardError


def test_help_names_every_command(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["--help"]) == 0
    out = capsys.readouterr().out
    for name in cli.COMMANDS:
        assert f" {name} " in out


@pytest.mark.parametrize("words", [["--version"], ["version"]])
def test_version(words: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(words) == 0
    first = capsys.readouterr().out.splitlines()[0].split()
    assert first == ["roboyard", roboyard.__version__]


@pytest.mark.parametrize("words", [["no-such-command"], ["version", "--no-such-option"]])
def test_wrong_usage_exits_with_2(words: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(words) == 2
    captured = capsys.readouterr()
    assert words[-1] in captured.err
    assert captured.out == ""


def test_many_errors_are_truncated(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    problems = [DescriptionError(f"no such file: {k}.stl", file="arm.urdf", line=k) for k in range(70)]
    _fail_with(monkeypatch, DescriptionError.collect(problems))
    assert cli.main(["demo"]) == 1
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == cli.MOST_LINES + 1
    assert lines[-1] == f"roboyard: error: ... and {70 - cli.MOST_LINES} more"


def test_each_error_is_one_line_without_traceback(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    first = DescriptionError("axis is zero", file="arm.urdf", line=3, element='joint "a"')
    second = DescriptionError("no mass", file="arm.urdf", line=9, element='link "b"')
    _fail_with(monkeypatch, DescriptionError.collect([first, second]))
    assert cli.main(["demo"]) == 1
    assert capsys.readouterr().err.splitlines() == [
        'roboyard: error: arm.urdf:3: joint "a": axis is zero',
        'roboyard: error: arm.urdf:9: link "b": no mass',
    ]


def test_a_file_error_names_the_file(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    _fail_with(monkeypatch, PermissionError(13, "Permission denied", "place"))
    assert cli.main(["demo"]) == 1
    assert capsys.readouterr().err == "roboyard: error: place: Permission denied\n"


def test_an_unexpected_error_is_one_line_and_debug_raises_it(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    _fail_with(monkeypatch, KeyError("x"))
    assert cli.main(["demo"]) == 1
    (line,) = capsys.readouterr().err.splitlines()
    assert "unexpected KeyError" in line
    assert "ROBOYARD_DEBUG=1" in line
    monkeypatch.setenv("ROBOYARD_DEBUG", "1")
    with pytest.raises(KeyError):
        cli.main(["demo"])


def test_debug_raises_errors(monkeypatch: pytest.MonkeyPatch) -> None:
    _fail_with(monkeypatch, RoboyardError("wrong"))
    monkeypatch.setenv("ROBOYARD_DEBUG", "1")
    with pytest.raises(RoboyardError, match="wrong"):
        cli.main(["demo"])


def test_interrupt_exits_130(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    _fail_with(monkeypatch, KeyboardInterrupt())
    assert cli.main(["demo"]) == 130
    assert capsys.readouterr().err == "roboyard: error: interrupted\n"


def test_help_imports_nothing_heavy() -> None:
    code = """
        import sys
        from roboyard.cli import main
        assert main(["--help"]) == 0
        heavy = {"mujoco", "numba", "trimesh", "scipy", "matplotlib", "PIL", "pxr", "collada"}
        found = heavy & {name.partition(".")[0] for name in sys.modules}
        sys.exit(f"loaded: {sorted(found)}" if found else 0)
    """
    result = subprocess.run(
        [sys.executable, "-c", textwrap.dedent(code)], capture_output=True, text=True, check=False
    )
    assert result.returncode == 0, result.stderr


def test_python_dash_m_is_the_command() -> None:
    result = subprocess.run(
        [sys.executable, "-m", "roboyard", "version"], capture_output=True, text=True, check=False
    )
    assert result.returncode == 0
    assert result.stdout.split()[:2] == ["roboyard", roboyard.__version__]


def _fail_with(monkeypatch: pytest.MonkeyPatch, error: BaseException) -> None:
    def fail(words: list[str]) -> int:
        raise error

    monkeypatch.setattr(cli, "_run", fail)


def test_a_closed_pipe_is_not_an_error() -> None:
    """As in `roboyard audit | head -1`."""
    code = "import sys; from roboyard.cli import main; sys.exit(main(sys.argv[1:]))"
    robot = roboyard.__file__.replace("__init__.py", "assets/r1/r1_description/urdf/r1_pro_source.urdf")
    process = subprocess.Popen(
        [sys.executable, "-c", code, "audit", robot, "--json"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    assert process.stdout is not None and process.stderr is not None
    process.stdout.close()
    assert process.stderr.read() == ""
    assert process.wait(timeout=60) == 1


def test_an_invalid_port_is_an_error(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["serve", "--port", "70000"]) == 1
    assert capsys.readouterr().err == "roboyard: error: port must be 0 to 65535, got 70000\n"


def test_an_interruption_during_imports_is_quiet(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    from roboyard.__main__ import main

    def interrupted() -> int:
        raise KeyboardInterrupt

    monkeypatch.setattr(cli, "main", interrupted)
    assert main() == 130
    assert capsys.readouterr().err == ""


def test_an_interruption_within_exec_exits_130(tmp_path: Path) -> None:
    """`python -m` would end by the signal, since an interruption passed through exec."""
    (tmp_path / "interrupted.py").write_text(
        "import sys; from roboyard import __main__, cli\n"
        "def run(): exec('raise KeyboardInterrupt')\n"
        "cli.main = run; sys.exit(__main__.main())"
    )
    ended = subprocess.run([sys.executable, "-m", "interrupted"], cwd=tmp_path, check=False)
    assert ended.returncode == 130


@pytest.mark.parametrize(
    ("problem", "line"),
    [
        (
            OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), "r.yml"),
            "r.yml: No space left on device; make room",
        ),
        (OSError(errno.EFBIG, os.strerror(errno.EFBIG)), "File too large; make room"),
        (shutil.Error([("a.yml", "b.yml", "[Errno 28] No space left on device")]), "b.yml: No space left on"),
        (OSError(errno.EROFS, os.strerror(errno.EROFS), "out"), "out: Read-only file system\n"),
    ],
)
def test_files_that_cannot_be_written_are_named(
    problem: OSError, line: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def fail(arguments: list[str]) -> int:
        raise problem

    monkeypatch.setattr(cli, "_run", fail)
    assert cli.main([]) == 1
    assert capsys.readouterr().err.startswith(f"roboyard: error: {line}")
