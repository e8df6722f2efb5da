"""Modules that are imported when one of their names is first used."""

from __future__ import annotations

import gc
import os
import re
import subprocess
import sys
from pathlib import Path
from types import ModuleType
from urllib.parse import unquote

import pytest

from roboyard import _lazy
from roboyard._lazy import Deferred, LazyLogger, deferred, lazy_pattern
from roboyard.untrusted.percent_codes import unquoted


def _printed(code: str, **others: str) -> str:
    return subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, env={**os.environ, **others}
    ).stdout.strip()


def test_a_deferred_module_gives_the_names_of_the_real_one_when_it_is_used() -> None:
    sys.modules.pop("colorsys", None)
    with deferred("colorsys", "sys") as waiting:
        import colorsys

        assert waiting == ["colorsys"]
        assert isinstance(colorsys, Deferred)
    assert "colorsys" not in sys.modules
    assert colorsys.rgb_to_hsv(1.0, 0.0, 0.0) == (0.0, 1.0, 1.0)
    assert type(sys.modules["colorsys"]) is ModuleType


def test_a_module_that_is_used_meanwhile_stays_imported() -> None:
    sys.modules.pop("colorsys", None)
    with deferred("colorsys"):
        import colorsys

        assert colorsys.hsv_to_rgb(0.0, 1.0, 1.0) == (1.0, 0.0, 0.0)
    assert type(sys.modules["colorsys"]) is ModuleType


def test_a_logger_is_the_one_of_its_name(caplog: pytest.LogCaptureFixture) -> None:
    LazyLogger("roboyard.of.this.test").warning("%s happened", "it")
    assert [(r.name, r.getMessage()) for r in caplog.records] == [("roboyard.of.this.test", "it happened")]


def test_programs_start_without_modules_that_they_do_not_use() -> None:
    code = """
import sys
sys.argv = ["roboyard"]
from roboyard.pybullet.running import preload
preload()
unused = "zipfile", "subprocess", "logging", "difflib"
print([name for name in unused if name in sys.modules])
"""
    assert _printed(code) == "[]"


NUMPY_1 = """
import pickle, warnings
from . import fft
from . import random
from . import ma

def __getattr__(name):
    if name == "old":
        warnings.warn("old is old", DeprecationWarning, stacklevel=2)
        return 1
    if name == "bool":
        warnings.warn("will be another", FutureWarning, stacklevel=2)
    raise AttributeError(name)

def __dir__():
    return ["asked", *globals()]

def protocol():
    return pickle.HIGHEST_PROTOCOL
"""
USES = r"""
import sys, warnings
if sys.argv[1:] == ["first"]:
    sys.modules.pop("pickle", None)
    from roboyard._numpy import load_numpy
    load_numpy()
    print([name for name in sys.modules if name.startswith("numpy.")], file=sys.stderr)
import numpy as np
names = dir(np)
with warnings.catch_warnings(record=True) as said:
    warnings.simplefilter("always")
    print(np.old, hasattr(np, "bool"), hasattr(np, "nothing"))
    for _ in range(2):
        print(np.old)
    print([(str(w.message), w.category, w.filename, w.lineno) for w in said])
from numpy import random
import numpy.fft
print({"fft", "random", "ma", "asked"} <= set(names), np.protocol())
print(random is np.random is sys.modules["numpy.random"], type(random), random.VALUE)
print(np.ma.masked, np.ma is sys.modules["numpy.ma"], np.fft is numpy.fft, vars(np)["ma"] is np.ma)
"""


def test_numpy_1_gives_its_packages_on_first_use(tmp_path: Path) -> None:
    package = tmp_path / "numpy"
    for name, text in (
        ("__init__", NUMPY_1),
        ("fft/__init__", ""),
        ("ma/__init__", "from .core import masked"),
        ("ma/core", "masked = '--'"),
        ("random/__init__", "VALUE = 4"),
    ):
        file = package / f"{name}.py"
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text)
    source = str(Path(__file__).parents[1] / "src")
    (tmp_path / "uses.py").write_text(USES)
    paths = {"PYTHONPATH": os.pathsep.join([str(tmp_path), source])}
    run = "import runpy, sys; sys.argv = ['uses.py', *{!r}]; runpy.run_path({!r})"
    plain, first = (
        _printed(run.format(given, str(tmp_path / "uses.py")), **paths) for given in ([], ["first"])
    )
    assert first == plain
    assert "uses.py" in plain


def test_numpy_is_the_same_whether_or_not_its_packages_wait() -> None:
    code = """
import sys, warnings
warnings.simplefilter("ignore")
if {}:
    from roboyard._numpy import load_numpy
    load_numpy()
    assert "numpy.ma.core" not in sys.modules
import numpy, pickle
names = sorted(dir(numpy))
from numpy import *
print(names, [type(getattr(numpy, name)) for name in names], sorted(globals()), ma, fft, random)
print(numpy.random.default_rng(1).normal(), pickle.loads(pickle.dumps(numpy.ma.array([1, 2], mask=[0, 1]))))
"""
    assert _printed(code.format(True)).replace("'load_numpy', ", "") == _printed(code.format(False))


def test_a_lazy_pattern_is_the_compiled_one_once_it_is_used() -> None:
    pattern = lazy_pattern(r"(\w+)-(\d+)", re.IGNORECASE)
    real = re.compile(r"(\w+)-(\d+)", re.IGNORECASE)
    found, expected = pattern.match("joint-12"), real.match("joint-12")
    assert found and expected and found.groups() == expected.groups()
    assert pattern.sub(r"\2", "joint-12, link-3") == "12, 3"
    assert (pattern.pattern, pattern.flags) == (real.pattern, real.flags)
    assert lazy_pattern(rb"[og]\s").findall(b"o a\ng b") == [b"o ", b"g "]
    with pytest.raises(AttributeError):
        pattern.nothing  # type: ignore[attr-defined]  # noqa: B018


def test_pathlib_loads_the_parser_of_addresses_when_it_writes_one() -> None:
    code = (
        "import sys, roboyard; print('urllib.parse' in sys.modules); from pathlib import Path;"
        "print(Path('/a b').as_uri(), 'urllib.parse' in sys.modules); import urllib.parse;"
        "print(urllib.parse.quote('a b'), type(urllib.parse).__name__)"
    )
    code = f"import sys; [sys.modules.pop(name, None) for name in ('pathlib', 'urllib.parse')]; {code}"
    assert _printed(code).split() == ["False", "file:///a%20b", "True", "a%20b", "module"]


@pytest.mark.parametrize("text", ["a b", "a%20b", "%41%zz", "100%", "%e4"])
def test_percent_codes_are_read_as_the_library_reads_them(text: str) -> None:
    assert unquoted(text) == unquote(text)


def test_paths_of_elements_are_found_after_a_start_without_their_module() -> None:
    code = (
        "import sys, roboyard.description; print('xml.etree.ElementPath' in sys.modules);"
        "import xml.etree.ElementTree as ET; tree = ET.fromstring('<a><b><c x=\"1\"/></b></a>');"
        "print(tree.find('b/c').get('x'), len(list(tree.iterfind('.//c'))))"
    )
    assert _printed(code).split() == ["False", "1", "1"]


def test_modules_from_the_stored_file_name_the_bytecode_that_python_would_write() -> None:
    code = (
        "import sys, roboyard, roboyard.paths, roboyard.sim; from importlib.util import cache_from_source;"
        "print(all(m.__spec__.cached == m.__cached__ == cache_from_source(m.__spec__.origin)"
        " for n, m in sys.modules.items() if n.startswith('roboyard')))"
    )
    assert [_printed(code) for _ in range(2)] == ["True", "True"]


def test_frozen_objects_stay_frozen_and_are_counted_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """Python counts them one by one, which takes 20 ms for a million."""
    counts = []

    def count() -> int:
        counts.append(1)
        return 7

    monkeypatch.setattr(_lazy, "_has_frozen", False)
    monkeypatch.setattr(gc, "get_freeze_count", count)
    monkeypatch.setattr(gc, "unfreeze", lambda: pytest.fail("frozen objects are collected again"))
    for _ in range(5):
        with _lazy.paused_collection():
            pass
    assert len(counts) == 1


def test_types_of_numpys_own_results_are_known_when_they_are_asked_for() -> None:
    code = """
import sys, typing
if {}:
    import roboyard
    from roboyard._numpy import load_numpy
    load_numpy()
    assert "numpy._typing" not in sys.modules
import numpy as np
found = np.linalg.eigh(np.eye(2))
linalg = sys.modules[type(found).__module__]
print(found, typing.get_type_hints(linalg.EigResult), linalg.SVDResult._fields)
print("_typing" in dir(np), np._typing.NDArray, linalg.NDArray[float], linalg.NDArray.__origin__)
import numpy.typing
print(np.typing.NDArray[np.float64])
"""
    assert _printed(code.format(True)) == _printed(code.format(False))
