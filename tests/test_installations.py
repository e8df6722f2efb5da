"""Roboyard where it is installed: read-only, without a home, in other locales, with streams closed."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path
from types import CodeType

import pytest

import roboyard
from roboyard import _numba
from roboyard.assets import asset_path
from roboyard.native import objects
from roboyard.paths import DATA_VARIABLE, writable_data_folder

SOURCE = str(Path(roboyard.__file__).parents[1])
LOOP = (
    "from roboyard._numba import njit\n@njit(cache=True)\ndef twice(x):\n    return 2 * x\nprint(twice(21))\n"
)
STEPS = (
    "from roboyard import World\nfrom roboyard.assets import asset_path\n"
    "w = World(); w.add_plane(); w.add_urdf(asset_path('cube.urdf')); w.step(3); print('fine')\n"
)


def python(*words: str, **others: str) -> subprocess.CompletedProcess[bytes]:
    environment = {**os.environ, "PYTHONPATH": SOURCE, **others}
    return subprocess.run([sys.executable, *words], env=environment, capture_output=True, timeout=120)


def test_loops_compile_where_no_folder_can_be_written(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(_numba, "_is_noted", False)
    places: dict[str, object] = {"njit": _numba.njit, "__name__": "nowhere"}
    code: CodeType = compile(LOOP.partition("\n")[2], "/proc/nowhere/loops.py", "exec")
    monkeypatch.setenv("HOME", "/proc")
    monkeypatch.setenv("XDG_CACHE_HOME", "/proc/nowhere")
    exec(code, places)
    said = capsys.readouterr()
    assert said.out == "42\n"
    assert "NUMBA_CACHE_DIR" in said.err
    assert len(said.err.splitlines()) == 1


def test_a_cache_that_a_crash_cut_counts_as_absent(tmp_path: Path) -> None:
    (tmp_path / "loops.py").write_text(LOOP)
    cache = tmp_path / "cache"
    cache.mkdir()
    for damage in ("none", "empty", "half", "junk"):
        for file in cache.rglob("*.nb?"):
            content = file.read_bytes()
            cut = {"none": content, "empty": b"", "half": content[: len(content) // 2], "junk": b"\x80junk"}
            file.write_bytes(cut[damage])
        done = python(str(tmp_path / "loops.py"), NUMBA_CACHE_DIR=str(cache))
        assert done.stdout == b"42\n", (damage, done.stderr)
    assert list(cache.rglob("*.nbi"))


def test_damaged_machine_code_counts_as_absent(tmp_path: Path) -> None:
    file = tmp_path / "loop.o"
    objects._store(file, b"machine code")
    assert objects._stored(file) == b"machine code"
    whole = file.read_bytes()
    for damaged in (b"", whole[:-1], whole + b"x", b"x" + whole[1:]):
        file.write_bytes(damaged)
        assert objects._stored(file) is None
    assert objects._stored(tmp_path / "none.o") is None


@pytest.mark.parametrize(
    "others",
    [
        {"NUMBA_DISABLE_JIT": "1"},
        {"HOME": "/proc", "XDG_CACHE_HOME": "/proc/x", "ROBOYARD_CACHE": "/proc/x"},
        {"LANG": "C", "LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"},
        {"PYTHONOPTIMIZE": "2"},
    ],
)
def test_a_world_steps(others: dict[str, str]) -> None:
    done = python("-c", STEPS, **others)
    assert done.stdout == b"fine\n", done.stderr


def test_a_world_steps_without_a_home() -> None:
    environment = {"PATH": os.environ["PATH"], "PYTHONPATH": SOURCE}
    done = subprocess.run([sys.executable, "-c", STEPS], env=environment, capture_output=True, timeout=120)
    assert done.stdout == b"fine\n", done.stderr


@pytest.mark.parametrize("method", ["spawn", "fork", "forkserver"])
def test_processes_have_worlds_of_their_own(tmp_path: Path, method: str) -> None:
    program = (
        "import multiprocessing as m\ndef work(x):\n"
        + "".join(f"    {line}\n" for line in STEPS.replace("print('fine')", "return x").splitlines())
        + f"if __name__ == '__main__':\n    work(0)\n"
        f"    with m.get_context({method!r}).Pool(2) as pool:\n        print(pool.map(work, [1, 2]))\n"
    )
    (tmp_path / "program.py").write_text(program)
    done = python(str(tmp_path / "program.py"))
    assert done.stdout == b"[1, 2]\n", done.stderr


@pytest.mark.parametrize("closed", ["1", "2", "12"])
def test_commands_work_with_streams_closed(closed: str) -> None:
    redirect = "".join(f" {number}>&-" for number in closed)
    words = f"exec {sys.executable} -m roboyard audit {asset_path('cube.urdf')}{redirect}"
    done = subprocess.run(
        ["sh", "-c", words], env={**os.environ, "PYTHONPATH": SOURCE}, capture_output=True, timeout=120
    )
    assert done.returncode == 0, done.stderr
    assert b"Traceback" not in done.stderr


@pytest.mark.skipif(sys.platform != "linux", reason="file names are bytes on Linux alone")
def test_file_names_that_are_not_utf8(tmp_path: Path) -> None:
    folder = os.fsdecode(os.fsencode(tmp_path) + b"/b\xff\xfed")
    os.mkdir(folder)  # noqa: PTH102
    file = Path(folder) / os.fsdecode(b"r\xe4.urdf")
    shutil.copy(asset_path("cube.urdf"), file)
    for words in (
        ["audit", str(file)],
        ["import", str(file), "--name", "r", "--data", str(tmp_path / "data"), "--no-validate"],
        ["repair", str(file), "--out", str(tmp_path / "repaired")],
        ["infer", str(file), "--json"],
    ):
        done = python("-m", "roboyard", *words)
        assert done.returncode == 0, (words, done.stderr)


def test_an_import_without_a_data_folder_has_the_working_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.delenv(DATA_VARIABLE, raising=False)
    monkeypatch.setenv("XDG_DATA_HOME", "/proc/nowhere")
    monkeypatch.chdir(tmp_path)
    assert writable_data_folder() == tmp_path / "roboyard-data"
    assert DATA_VARIABLE in capsys.readouterr().err
    assert writable_data_folder("given") == Path("given")
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path / "home"))
    assert writable_data_folder() == tmp_path / "home" / "roboyard"
    assert capsys.readouterr().err == ""


COMPILED = (
    "import sys\n"
    "found = []\n"
    "sys.addaudithook(lambda name, given: name == 'compile' and found.append(str(given[1])))\n"
    "import roboyard.errors, roboyard.sim\n"
    "print(sum('/roboyard/' in file for file in found))\n"
)


def test_bytecode_is_stored_for_later_processes_where_python_stores_none(tmp_path: Path) -> None:
    package = tmp_path / "source" / "roboyard"
    shutil.copytree(Path(SOURCE) / "roboyard", package, ignore=shutil.ignore_patterns("__pycache__", "*.o"))
    cache = tmp_path / "cache"
    others = {
        "PYTHONPATH": str(package.parent),
        "PYTHONDONTWRITEBYTECODE": "1",
        "XDG_CACHE_HOME": str(cache),
    }

    def compiled() -> int:
        """Return how many modules a process compiles."""
        done = python("-c", COMPILED, **others)
        assert done.returncode == 0, done.stderr
        return int(done.stdout)

    first = compiled()
    again = compiled()
    assert first > 50
    assert again <= 3, "the package, and what it needs to find the others"
    assert not list(package.rglob("*.pyc"))
    stored = sorted((cache / "roboyard" / "bytecode").rglob("*.pyc"))
    assert len(stored) == first - again
    with (package / "errors.py").open("a") as file:
        file.write("\n")
    assert compiled() == again + 1, "an edited module"
    stored[0].write_bytes(stored[0].read_bytes()[:-9])
    stored[1].write_bytes(b"junk")
    assert compiled() == again + 2, "damaged files"
    for folder in stored[0].parent.iterdir():
        assert folder.stat().st_mode & 0o22 == 0
    stored[0].parent.chmod(0o777)
    assert compiled() == first, "a folder that others may write to"


def test_bytecode_beside_the_sources_is_used_where_python_stores_it(tmp_path: Path) -> None:
    package = tmp_path / "roboyard"
    shutil.copytree(Path(SOURCE) / "roboyard", package, ignore=shutil.ignore_patterns("__pycache__", "*.o"))
    others = {"PYTHONPATH": str(tmp_path), "XDG_CACHE_HOME": str(tmp_path / "cache")}
    environment = {key: value for key, value in os.environ.items() if key != "PYTHONDONTWRITEBYTECODE"}
    for _ in range(2):
        done = subprocess.run(
            [sys.executable, "-c", "import roboyard.errors"],
            env={**environment, **others},
            capture_output=True,
            timeout=60,
        )
        assert done.returncode == 0, done.stderr
    assert not (tmp_path / "cache").exists()
    assert list(package.rglob("errors.*.pyc"))
    (package / "paths.py").touch()
    (package / "errors.py").write_text((package / "errors.py").read_text() + "\n")
    code = COMPILED.replace("roboyard.sim", "roboyard.paths")
    counts = [int(python("-c", code, **others, PYTHONDONTWRITEBYTECODE="1").stdout) for _ in range(3)]
    assert counts[0] > counts[1] == counts[2], "edited where Python stores bytecode no more"
    names = {file.name for file in (tmp_path / "cache").rglob("*.pyc")}
    assert "roboyard.errors.pyc" in names
    assert "roboyard.untrusted.pyc" not in names
