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


STORED = "modules", "finder"
"""Files of bytecode: of most modules, and of the one that finds them."""


def copied_package(folder: Path) -> Path:
    package = folder / "roboyard"
    shutil.copytree(Path(SOURCE) / "roboyard", package, ignore=shutil.ignore_patterns("__pycache__", "*.o"))
    return package


def test_bytecode_is_stored_for_later_processes_where_python_stores_none(tmp_path: Path) -> None:
    package = copied_package(tmp_path / "source")
    cache = tmp_path / "cache"
    others = {
        "PYTHONPATH": str(package.parent),
        "PYTHONDONTWRITEBYTECODE": "1",
        "XDG_CACHE_HOME": str(cache),
    }

    def compiled(*words: str) -> int:
        """Return how many modules a process compiles."""
        done = python(*words, "-c", COMPILED, **others)
        assert done.returncode == 0, done.stderr
        return int(done.stdout)

    first = compiled()
    again = compiled()
    assert first > 50
    assert again <= 2, "the package, and what it needs to find the others"
    assert not list(package.rglob("*.pyc"))
    stored, finder = (next((cache / "roboyard" / "bytecode").rglob(f"{name}-0")) for name in STORED)
    assert all(file.stat().st_mode & 0o77 == 0 for file in (stored, finder))
    with (package / "errors.py").open("a") as file:
        file.write("\n")
    assert [compiled(), compiled()] == [again + 1, again], "an edited module"
    assert [compiled("-O"), compiled("-O"), compiled()] == [first, again, again], "optimized bytecode"
    whole = stored.read_bytes()
    for damaged in (whole[:-9], b"junk", b"", whole[:200]):
        stored.write_bytes(damaged)
        assert [compiled(), compiled()] == [first - 1, again], "a damaged file"
    whole = finder.read_bytes()
    for damaged in (whole[:-9], b"junk", b""):
        finder.write_bytes(damaged)
        assert [compiled(), compiled()] == [again + 1, again], "a damaged file of the finder"
    with (package / "_bytecode.py").open("a") as file:
        file.write("\n")
    assert [compiled(), compiled()] == [again + 1, again], "an edited finder"
    stored.chmod(0o620)
    finder.chmod(0o620)
    assert compiled() == first, "files that others may write to"
    stored.parent.chmod(0o777)
    assert [compiled(), compiled()] == [first, first], "a folder that others may write to"


def test_the_package_is_imported_from_an_archive(tmp_path: Path) -> None:
    package = copied_package(tmp_path / "source")
    archive = shutil.make_archive(str(tmp_path / "packed"), "zip", package.parent)
    done = python("-c", "import roboyard.errors; print(roboyard.__file__)", PYTHONPATH=archive)
    assert done.stdout.decode().strip() == str(Path(archive) / "roboyard" / "__init__.py"), done.stderr


def test_modules_come_from_one_file_where_python_stores_bytecode_beside_them(tmp_path: Path) -> None:
    package = copied_package(tmp_path)
    environment = {key: value for key, value in os.environ.items() if key != "PYTHONDONTWRITEBYTECODE"}
    environment |= {"PYTHONPATH": str(tmp_path), "XDG_CACHE_HOME": str(tmp_path / "cache")}

    def opened(modules: str) -> int:
        """Return how many bytecode files of the package a process opens that imports these modules."""
        code = COMPILED.replace("'compile'", "'open'").replace("given[1]", "given[0]")
        code = code.replace("roboyard.errors, roboyard.sim", modules).replace(
            "in file", "in file and '.pyc' in file"
        )
        done = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, timeout=60)
        assert done.returncode == 0, done.stderr
        return int(done.stdout)

    for _ in range(2):
        opened("roboyard.errors")
    assert not (tmp_path / "cache").exists(), "too little for a file"
    assert list(package.rglob("errors.*.pyc"))
    counts = [opened("roboyard.sim") for _ in range(3)]
    assert counts[0] > 50 > 5 > counts[1] == counts[2], counts
    (package / "errors.py").write_text((package / "errors.py").read_text() + "\n")
    again = [opened("roboyard.sim") for _ in range(2)]
    assert again[0] >= again[1] == counts[2] + 1, "the edited module's own file"


def test_modules_of_the_one_file_are_like_those_that_python_finds(tmp_path: Path) -> None:
    package = copied_package(tmp_path)
    others = {
        "PYTHONPATH": str(tmp_path),
        "PYTHONDONTWRITEBYTECODE": "1",
        "XDG_CACHE_HOME": str(tmp_path / "c"),
    }
    code = r"""
import importlib, importlib.resources, importlib.util, inspect, linecache, pkgutil, sys, traceback
import roboyard, roboyard.errors, roboyard.description, roboyard.assets
for module in (roboyard.errors, roboyard.description):
    spec = module.__spec__
    found = importlib.machinery.PathFinder.find_spec(module.__name__, roboyard.__path__)
    names = "name", "origin", "cached", "has_location", "parent", "submodule_search_locations"
    assert all(getattr(spec, name) == getattr(found, name) for name in names), spec
    assert (module.__file__, module.__package__) == (spec.origin, spec.parent)
    assert inspect.getsource(module) == spec.loader.get_source(module.__name__) == open(spec.origin).read()
    assert spec.loader.get_code(module.__name__).co_filename == spec.origin
    linecache.clearcache()
    assert linecache.getline(module.__file__, 1)
assert roboyard.description.__path__ == [roboyard.description.__file__.rpartition("/")[0]]
assert inspect.getsource(roboyard.errors.RoboyardError).startswith("class RoboyardError")
assert {"errors", "sim"} <= {info.name for info in pkgutil.iter_modules(roboyard.__path__)}
assert any(file.name == "cube.urdf" for file in importlib.resources.files("roboyard.assets").rglob("*"))
assert importlib.util.find_spec("roboyard.no_such_module") is None
with open(roboyard.errors.__file__, "a") as file:
    file.write("ADDED = 1\n")
assert importlib.reload(roboyard.errors).ADDED == 1
known = sys.modules["roboyard._bytecode"]._modules.modules
print(type(roboyard.description.__spec__.loader).__name__, len(known) > 9)
"""
    original = (package / "errors.py").read_text()
    for known in (b"False", b"True"):
        done = python("-c", code, **others)
        assert done.stdout.split() == [b"StoredLoader", known], done.stderr
        (package / "errors.py").write_text(original)
