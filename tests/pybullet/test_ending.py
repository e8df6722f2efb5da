"""The end of a script that uses Roboyard: what it created ends as when Python runs it."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

import roboyard

SOURCE = str(Path(roboyard.__file__).parents[1])
ENDS = """
import atexit, threading, time, sys, weakref
import pybullet as p
import neighbour

class Watched:
    def __init__(self, name):
        self.name = name
    def __del__(self):
        print("deleted", self.name)

def steps():
    try:
        yield 1
    finally:
        print("generator closed")

p.connect(p.DIRECT)
alone, ring, bound = Watched("alone"), Watched("ring"), Watched("bound")
ring.itself, bound.itself = ring, bound
stepping = steps()
next(stepping)
atexit.register(lambda: print("atexit"))
atexit.register(bound.__repr__)
weakref.finalize(ring, print, "finalized")
threading.Thread(target=lambda: (time.sleep(0.2), print("thread"))).start()
sys.exit(3)
"""
NEIGHBOUR = """
class Kept:
    def __del__(self):
        print("deleted kept")

kept, ring = Kept(), Kept()
ring.itself = ring
"""
FILES = """
import neighbour

class Log:
    def __init__(self, name):
        self.file = open(name, "w")
        self.file.write(name)
        self.itself = self

log = Log("ring")
plain = open("plain", "w")
plain.write("plain")

def function():
    pass
"""


def run(folder: Path, text: str, *, module: tuple[str, ...]) -> subprocess.CompletedProcess[str]:
    (folder / "script.py").write_text(text)
    return subprocess.run(
        [sys.executable, *module, "script.py"],
        capture_output=True,
        text=True,
        timeout=120,
        env={**os.environ, "PYTHONPATH": SOURCE},
        cwd=folder,
    )


@pytest.mark.parametrize("before", ["", "import logging\n"])
@pytest.mark.parametrize("module", [(), ("-m", "roboyard", "run")])
def test_what_a_script_created_ends_before_the_process(
    tmp_path: Path, module: tuple[str, ...], before: str
) -> None:
    """`logging` registers a function for the end."""
    (tmp_path / "neighbour.py").write_text(NEIGHBOUR)
    text = ENDS if module else ENDS.replace("import pybullet", "import roboyard.pybullet")
    done = run(tmp_path, before + text, module=module)
    assert (done.returncode, done.stderr) == (3, "")
    lines = done.stdout.splitlines()
    assert lines[0] == "thread"
    assert lines.index("atexit") < lines.index("deleted alone")
    expected = ["atexit", "finalized", "generator closed", "thread"]
    expected += [f"deleted {name}" for name in ("alone", "bound", "kept", "kept", "ring")]
    assert sorted(lines) == sorted(expected)


def test_files_left_open_are_written_as_by_python(tmp_path: Path) -> None:
    for name, first, module in (
        ("python", "", ()),
        ("imported", "import roboyard.pybullet\n", ()),
        ("roboyard", "", ("-m", "roboyard", "run")),
    ):
        folder = tmp_path / name
        folder.mkdir()
        (folder / "neighbour.py").write_text('log = open("neighbour", "w")\nlog.write("neighbour")\n')
        done = run(folder, first + FILES, module=module)
        assert (done.returncode, done.stderr) == (0, "")
        for written in ("ring", "plain", "neighbour"):
            assert (folder / written).read_text() == written, (name, written)


def test_a_program_of_the_command_line_ends_as_a_script(tmp_path: Path) -> None:
    text = f"{NEIGHBOUR}\nimport roboyard.pybullet"
    done = run(tmp_path, "", module=("-c", text))
    assert (done.returncode, done.stdout, done.stderr) == (0, 2 * "deleted kept\n", "")


def test_the_script_is_main_until_the_end(tmp_path: Path) -> None:
    text = "import atexit, sys\nVALUE = 5\natexit.register(lambda: print(sys.modules['__main__'].VALUE))\n"
    done = run(tmp_path, text, module=("-m", "roboyard", "run"))
    assert (done.returncode, done.stdout, done.stderr) == (0, "5\n", "")


def test_functions_registered_before_keep_their_modules(tmp_path: Path) -> None:
    """Tools that watch a process register functions while Python starts, which then run last."""
    (tmp_path / "sitecustomize.py").write_text(
        "import atexit\n@atexit.register\ndef last():\n"
        "    import numpy.linalg\n    print('last', numpy.linalg.norm([3, 4]))\n"
    )
    (tmp_path / "script.py").write_text("import numpy\n")
    done = subprocess.run(
        [sys.executable, "-m", "roboyard", "run", "script.py"],
        capture_output=True,
        text=True,
        timeout=120,
        env={**os.environ, "PYTHONPATH": f"{tmp_path}{os.pathsep}{SOURCE}"},
        cwd=tmp_path,
    )
    assert (done.returncode, done.stdout, done.stderr) == (0, "last 5.0\n", "")


LIBRARY = """
class Kept:
    def __del__(self):
        print("deleted kept")

kept = Kept()
"""


@pytest.mark.parametrize(
    ("text", "module", "ends"),
    [
        ("import roboyard.pybullet, library", (), ""),
        ("import logging, library, roboyard.pybullet", (), ""),
        ("import library", ("-m", "roboyard", "run"), ""),
        ("import library", (), "deleted kept\n"),
    ],
)
def test_installed_packages_are_left_as_they_are(
    tmp_path: Path, text: str, module: tuple[str, ...], ends: str
) -> None:
    installed = tmp_path / "site-packages"
    installed.mkdir()
    (installed / "library.py").write_text(LIBRARY)
    done = run(tmp_path, f"import sys\nsys.path.append({str(installed)!r})\n{text}\n", module=module)
    assert (done.returncode, done.stdout, done.stderr) == (0, ends, "")
