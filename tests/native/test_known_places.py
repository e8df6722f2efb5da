"""Machine code is found without reading its sources, as long as these and its constants are the same."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

PARTS = """
from pair.sizes import FACTOR


def half(x):
    return FACTOR * x
"""
LOOPS = """
import sys
from pathlib import Path

import numpy as np

from pair.parts import half
from roboyard.native import compiled, objects


@compiled("f8[::1]")
def halve(values):
    for k in range(values.shape[0]):
        values[k] = half(values[k])


READ = []
digested = objects.source_of
objects.source_of = lambda function: READ.append(1) or digested(function)
"""
CLOSED = """
from pair.parts import half
from roboyard.native import compiled


@compiled("f8[::1]")
def halve(values):
    for k in range(values.shape[0]):
        values[k] = half(values[k])
"""
RUN_CLOSED = """
import sys

import numpy as np
from roboyard.native import lazy_loop

home = lazy_loop("pair.loops", "halve")
values = np.arange(3.0)
home().halve(values)
home().halve(values)
print(values.tolist(), "pair" in sys.modules, "numba" in sys.modules, home().halve.__name__)
"""
ASK = """
from pair import loops
from roboyard.native import objects

print(objects.is_stored(loops.halve.py_func, loops.halve.signature))
"""
RUN = """
import sys

import numpy as np
from pair import loops

values = np.arange(3.0)
loops.halve(values)
print(values.tolist(), bool(loops.READ), "numba" in sys.modules)
"""


def run(folder: Path, program: str = RUN, **variables: str) -> str:
    (folder / "private").mkdir(mode=0o700, exist_ok=True)
    done = subprocess.run(
        [sys.executable, "-c", program],
        capture_output=True,
        text=True,
        cwd=folder,
        env={
            **os.environ,
            "NUMBA_CACHE_DIR": str(folder / "cache"),
            "XDG_CACHE_HOME": str(folder / "private"),
            "PYTHONDONTWRITEBYTECODE": "1",
            **variables,
        },
        timeout=120,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.strip()


def package(folder: Path, loops: str = LOOPS) -> None:
    (folder / "pair").mkdir()
    for name, text in (("__init__", ""), ("sizes", "FACTOR = 0.5"), ("parts", PARTS), ("loops", loops)):
        (folder / "pair" / f"{name}.py").write_text(text)


def test_places_are_known_until_sources_or_constants_change(tmp_path: Path) -> None:
    package(tmp_path)
    assert run(tmp_path) == "[0.0, 0.5, 1.0] True True"
    assert run(tmp_path) == "[0.0, 0.5, 1.0] False False"
    (tmp_path / "pair" / "parts.py").write_text(PARTS.replace("* x", "* x + 1.0"))
    assert run(tmp_path) == "[1.0, 1.5, 2.0] True True"
    (tmp_path / "pair" / "sizes.py").write_text("FACTOR = 0.25")
    assert run(tmp_path) == "[1.0, 1.25, 1.5] True True"
    (tmp_path / "pair" / "parts.py").write_text(PARTS)
    (tmp_path / "pair" / "sizes.py").write_text("FACTOR = 0.5")
    assert run(tmp_path) == "[0.0, 0.5, 1.0] True False", "the code of before is still stored"
    assert run(tmp_path) == "[0.0, 0.5, 1.0] False False"


def test_damaged_or_missing_machine_code_is_compiled_again(tmp_path: Path) -> None:
    package(tmp_path)
    assert run(tmp_path) == "[0.0, 0.5, 1.0] True True"
    (stored,) = (tmp_path / "cache").glob("*.o")
    whole = stored.read_bytes()
    for damaged in (whole[:-1], whole[:-40] + b"\0" * 40):
        stored.write_bytes(damaged)
        assert run(tmp_path) == "[0.0, 0.5, 1.0] False True"
        assert stored.read_bytes() == whole
    stored.unlink()
    assert run(tmp_path) == "[0.0, 0.5, 1.0] False True"
    assert stored.read_bytes() == whole


def test_places_that_others_may_write_are_not_believed(tmp_path: Path) -> None:
    package(tmp_path)
    run(tmp_path)
    (places,) = (tmp_path / "private" / "roboyard" / "places").iterdir()
    places.chmod(0o666)
    assert run(tmp_path) == "[0.0, 0.5, 1.0] True False"
    places.unlink()
    places.write_bytes(b"junk")
    assert run(tmp_path) == "[0.0, 0.5, 1.0] True False"


def test_loops_are_loaded_where_nothing_can_be_written(tmp_path: Path) -> None:
    package(tmp_path)
    run(tmp_path)
    for file in (tmp_path / "private").rglob("*"):
        if file.is_file():
            file.unlink()
    (tmp_path / "private" / "roboyard" / "places").rmdir()
    (tmp_path / "private" / "roboyard" / "places").write_text("no folder")
    assert run(tmp_path) == "[0.0, 0.5, 1.0] True False"
    assert run(tmp_path) == "[0.0, 0.5, 1.0] True False"


def test_a_loop_is_loaded_without_its_module_until_a_source_of_it_changes(tmp_path: Path) -> None:
    package(tmp_path, CLOSED)
    assert run(tmp_path, RUN_CLOSED) == "[0.0, 0.25, 0.5] True True halve"
    assert run(tmp_path, RUN_CLOSED) == "[0.0, 0.25, 0.5] False False halve"
    assert run(tmp_path, RUN_CLOSED, ROBOYARD_CHECK_LOOPS="1") == "[0.0, 0.25, 0.5] True False halve"
    assert run(tmp_path, RUN_CLOSED, NUMBA_DISABLE_JIT="1") == "[0.0, 0.25, 0.5] True True halve"
    (tmp_path / "pair" / "sizes.py").write_text("FACTOR = 0.25")
    assert run(tmp_path, RUN_CLOSED) == "[0.0, 0.0625, 0.125] True True halve"
    assert run(tmp_path, RUN_CLOSED) == "[0.0, 0.0625, 0.125] False False halve"
    os.utime(tmp_path / "pair" / "sizes.py", (0, 0))
    assert run(tmp_path, RUN_CLOSED) == "[0.0, 0.0625, 0.125] True False halve"
    assert run(tmp_path, RUN_CLOSED) == "[0.0, 0.0625, 0.125] False False halve"


def test_a_loop_that_another_process_only_asked_for_is_loaded_without_its_module(tmp_path: Path) -> None:
    package(tmp_path, CLOSED)
    run(tmp_path, RUN_CLOSED)
    (places,) = (tmp_path / "private" / "roboyard" / "places").iterdir()
    places.unlink()
    assert run(tmp_path, ASK) == "True"
    assert run(tmp_path, RUN_CLOSED) == "[0.0, 0.25, 0.5] True False halve"
    assert run(tmp_path, RUN_CLOSED) == "[0.0, 0.25, 0.5] False False halve"


def test_loops_whose_constants_depend_on_more_than_sources_are_loaded_with_their_modules(
    tmp_path: Path,
) -> None:
    package(tmp_path, CLOSED)
    (tmp_path / "pair" / "sizes.py").write_text("import os\nFACTOR = float(os.environ['SIZE'])")
    for size, wanted in (
        ("0.5", "[0.0, 0.25, 0.5]"),
        ("0.5", "[0.0, 0.25, 0.5]"),
        ("2.0", "[0.0, 4.0, 8.0]"),
    ):
        assert run(tmp_path, RUN_CLOSED, SIZE=size).startswith(f"{wanted} True")


def test_what_is_imported_for_types_or_in_functions_decides_no_constant(tmp_path: Path) -> None:
    package(tmp_path, CLOSED)
    (tmp_path / "pair" / "parts.py").write_text(
        "from typing import TYPE_CHECKING\n"
        "if TYPE_CHECKING:\n    from pair.missing import Shape\n"
        "def shape():\n    import pair.missing\n    import functools\n" + PARTS
    )
    seen = [run(tmp_path, RUN_CLOSED) for _ in range(3)]
    assert seen[-1] == "[0.0, 0.25, 0.5] False False halve", seen


def test_the_loop_of_a_step_is_loaded_without_its_modules() -> None:
    """Its sources import no other package, and nothing of this one that depends on the machine."""
    program = (
        "import roboyard.sim.stepping.impulses.order as order\n"
        "from roboyard.native.known_places import _closed_sources\n"
        "print(order.__file__ in _closed_sources(order.__name__))"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "True"


def test_sources_that_do_not_decide_all_constants_are_parsed_once(tmp_path: Path) -> None:
    package(tmp_path, CLOSED)
    (tmp_path / "pair" / "sizes.py").write_text("import os\nFACTOR = 0.5")
    program = RUN_CLOSED + "print('roboyard.native.known_places' in sys.modules, PARSED)"
    program = program.replace(
        "home = ",
        "from roboyard.native import known_places\nPARSED = []\nparse = known_places._closed_sources\n"
        "known_places._closed_sources = lambda module: PARSED.append(module) or parse(module)\nhome = ",
    )
    found = [run(tmp_path, program).split("\n")[-1] for _ in range(3)]
    assert found == ["True ['pair.loops']", "True []", "True []"]
