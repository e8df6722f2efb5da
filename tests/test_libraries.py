"""Libraries under `roboyard run`: their bytecode comes from files in the user's cache."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import roboyard

SOURCE = str(Path(roboyard.__file__).parents[1])
COUNT = """
import sys
opened = []

def note(name, given):
    if name in ("open", "compile"):
        opened.append(str(given[name == "compile"]))

sys.addaudithook(note)
import library.sub.part_3, own, email.mime.text
found = [file for file in opened if file.endswith((".py", ".pyc"))]
print(sum("library" in file for file in found), sum("own" in file for file in found))
print(library.sub.part_3.VALUE, own.VALUE, email.mime.text.MIMEText("a").as_string()[:12])
"""
SAME = """
import importlib, inspect, library.sub.part_3, library.sub, library, email.message
from importlib.machinery import PathFinder
for module in (library, library.sub, library.sub.part_3, email.message):
    spec = module.__spec__
    path = importlib.import_module(spec.name.rpartition(".")[0]).__path__ if "." in spec.name else None
    found = PathFinder.find_spec(spec.name, path)
    names = "name", "origin", "cached", "has_location", "parent", "submodule_search_locations"
    assert [getattr(spec, name) for name in names] == [getattr(found, name) for name in names], spec
    assert (module.__file__, module.__package__, module.__cached__) == (spec.origin, spec.parent, spec.cached)
    assert inspect.getsource(module) == spec.loader.get_source(spec.name)
    print(type(spec.loader).__name__)
"""


def library(folder: Path) -> Path:
    """Return an installed package of many modules."""
    package = folder / "site-packages" / "library"
    (package / "sub").mkdir(parents=True)
    (package / "__init__.py").write_text("NAME = 'library'\n")
    parts = range(20)
    (package / "sub" / "__init__.py").write_text("".join(f"from . import part_{k}\n" for k in parts))
    for k in parts:
        (package / "sub" / f"part_{k}.py").write_text(f"VALUE = {k}\n")
    (folder / "own.py").write_text("VALUE = 'own'\n")
    return package


def run(folder: Path, text: str) -> list[str]:
    script = folder / "script.py"
    script.write_text(text)
    done = subprocess.run(
        [sys.executable, "-m", "roboyard", "run", str(script)],
        capture_output=True,
        text=True,
        timeout=120,
        env={
            **os.environ,
            "PYTHONPATH": os.pathsep.join([str(folder / "site-packages"), SOURCE]),
            "XDG_CACHE_HOME": str(folder / "cache"),
            "PYTHONDONTWRITEBYTECODE": "1",
        },
    )
    assert (done.returncode, done.stderr) == (0, "")
    return done.stdout.splitlines()


def test_libraries_come_from_one_file_each_until_their_sources_change(tmp_path: Path) -> None:
    package = library(tmp_path)
    first, *values = run(tmp_path, COUNT)
    assert values == ["3 own Content-Type"]
    counted, own = map(int, first.split())
    assert counted >= 22
    assert own >= 1
    again, *values = run(tmp_path, COUNT)
    assert (again.split(), values) == (["0", str(own)], ["3 own Content-Type"])
    part = package / "sub" / "part_3.py"
    part.write_text("VALUE = 'edited'\n")
    (tmp_path / "own.py").write_text("VALUE = 'edited, too'\n")
    assert run(tmp_path, COUNT)[1:] == ["edited edited, too Content-Type"]
    assert run(tmp_path, COUNT)[0].split()[0] == "0"
    part.unlink()
    (package / "sub" / "part_3").mkdir()
    (package / "sub" / "part_3" / "__init__.py").write_text("VALUE = 'a package'\n")
    assert run(tmp_path, COUNT)[1].startswith("a package")
    stored = [file for file in (tmp_path / "cache" / "roboyard" / "bytecode").rglob("*") if file.is_file()]
    assert all(file.stat().st_mode & 0o77 == 0 for file in stored)


def test_a_module_of_the_script_hides_a_library(tmp_path: Path) -> None:
    library(tmp_path)
    run(tmp_path, COUNT)
    (tmp_path / "library.py").write_text("VALUE = 'hidden'\n")
    assert run(tmp_path, "import library\nprint(library.VALUE)\n") == ["hidden"]


def test_modules_of_libraries_are_like_those_that_python_finds(tmp_path: Path) -> None:
    library(tmp_path)
    assert [run(tmp_path, SAME) for _ in range(2)] == [4 * ["StoredLoader"]] * 2


def test_scripts_load_the_parts_of_mujoco_alone(tmp_path: Path) -> None:
    library(tmp_path)
    text = (
        "import sys, pybullet as p\np.connect(p.DIRECT)\np.stepSimulation()\n"
        "print('mujoco._structs' in sys.modules, 'mujoco' in sys.modules, 'mujoco._enums' in sys.modules)\n"
    )
    run(tmp_path, text)
    assert run(tmp_path, text) == ["True False False"]


def test_a_program_that_imports_the_module_has_no_finder_of_libraries(
    tmp_path: Path,
) -> None:
    plain = (
        "import numpy as n, numpy.typing as t\nprint(t.NDArray[float], n.random.default_rng(1).integers(9))\n"
    )
    text = (
        "import sys, roboyard.pybullet as p\np.connect(p.DIRECT)\n"
        "print(any(type(one).__name__ == 'Libraries' for one in sys.meta_path))\n"
        "print('numpy._typing' in sys.modules)\n"
        "print(type(sys.modules['numpy.linalg'].__spec__.loader).__name__)\n"
    )
    program = tmp_path / "program.py"

    def printed(code: str) -> list[str]:
        program.write_text(code)
        done = subprocess.run(
            [sys.executable, str(program)],
            capture_output=True,
            text=True,
            env={**os.environ, "PYTHONPATH": SOURCE, "XDG_CACHE_HOME": str(tmp_path / "cache")},
            timeout=120,
            check=True,
        )
        return done.stdout.splitlines()

    for _ in range(2):
        assert printed(text + plain) == ["False", "False", "StoredLoader", *printed(plain)]
