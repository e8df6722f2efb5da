"""Compiled loops: the machine code does what the Python source does, with stored code and without numba."""

from __future__ import annotations

import os
import subprocess
import sys
import threading
import time
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest

from roboyard.native import Bundle, Kernel, compiled, objects, record
from roboyard.native.building import jit, machine_code
from roboyard.native.builtin import source_function
from roboyard.native.called import source_of
from roboyard.native.memory import images_can_be_loaded
from roboyard.native.signatures import parse_signature

SOURCE = """
import sys

import numpy as np

from roboyard.native import compiled


def half(x):
    return 0.5 * x


@compiled("f8[:,:] i4[:] f8[:,:,:] i8 f8 -> f8")
def mixed(a, rows, out, first, factor):
    total = 0.0
    for n in range(first, len(rows)):
        for k in range(a.shape[1]):
            out[0, n, k] = factor * np.arctan2(half(a[rows[n], k]), 1.0)
            total += out[0, n, k] / a[0, 0]
    return total


def arguments():
    a = np.arange(1.0, 49.0).reshape(6, 8)[:, ::2]
    return a, np.array([5, 0, 3], dtype=np.int32), np.zeros((2, 3, 8))[:, :, ::-2], 1, 2.5


if __name__ == "__main__":
    given, plain = arguments(), arguments()
    expected = mixed.py_func(*plain)
    assert np.isclose(mixed(*given), expected)
    assert np.allclose(given[2], plain[2], rtol=1e-14) and given[2].any()
    mixed(*given)
    print("numba" in sys.modules)
"""


def run(folder: Path, *program: str) -> str:
    done = subprocess.run(
        [sys.executable, *(program or ("loops.py",))],
        capture_output=True,
        text=True,
        cwd=folder,
        env={**os.environ, "NUMBA_CACHE_DIR": str(folder / "cache")},
        timeout=120,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.strip()


def test_stored_code_is_loaded_without_numba_and_agrees_with_the_source(tmp_path: Path) -> None:
    (tmp_path / "loops.py").write_text(SOURCE)
    assert run(tmp_path) == "True"  # compiled now
    assert run(tmp_path) == "False"
    (stored,) = (tmp_path / "cache").iterdir()
    code = (tmp_path / "loops.py").read_text().replace("0.5 * x", "0.25 * x")
    (tmp_path / "loops.py").write_text(code)
    assert run(tmp_path) == "True", "the machine code of the other source was used"
    assert {stored} < set((tmp_path / "cache").iterdir())


PARTS = """
from pair.sizes import FACTOR


def half(x):
    return FACTOR * x


def quarter(x):
    return half(half(x))
"""
LOOPS = """
import sys

import numpy as np

from pair.parts import quarter
from roboyard.native import compiled


@compiled("f8[::1] f8[:,::1]", fast_math=True, releases_gil=True)
def quarters(values, out):
    for k in range(values.shape[0]):
        out[0, k] = quarter(values[k])


@compiled("f8[::1] f8[:,::1] -> f8")
def total(values, out):
    quarters(values, out)
    return out[0].sum()


if __name__ == "__main__":
    from pair import loops

    values, out = np.arange(4.0), np.zeros((1, 4))
    loops.quarters(values, out)  # loaded before it is a part of the other
    print(out[0].tolist(), loops.total(values, out), "numba" in sys.modules)
"""


def test_machine_code_is_stored_once_for_all_versions_of_python(monkeypatch: pytest.MonkeyPatch) -> None:
    loop = Kernel(_doubled, parse_signature("f8[::1]"), "f8[::1]")
    here = objects._stored_at(loop.py_func, loop.signature)
    monkeypatch.setattr(sys, "version_info", (3, 99, 0, "final", 0))
    assert objects._stored_at(loop.py_func, loop.signature) == here


def _doubled(values: Any) -> None:
    for k in range(len(values)):
        values[k] *= 2.0


def test_functions_of_other_files_are_parts_of_a_loop_and_of_its_key(tmp_path: Path) -> None:
    (tmp_path / "pair").mkdir()
    for name, text in (
        ("__init__", ""),
        ("sizes", "FACTOR = 0.5"),
        ("parts", PARTS),
        ("loops", LOOPS),
    ):
        (tmp_path / "pair" / f"{name}.py").write_text(text)
    assert run(tmp_path, "-m", "pair.loops") == "[0.0, 0.25, 0.5, 0.75] 1.5 True"
    assert run(tmp_path, "-m", "pair.loops") == "[0.0, 0.25, 0.5, 0.75] 1.5 False"
    (tmp_path / "pair" / "parts.py").write_text(PARTS.replace("FACTOR * x", "4.0 * FACTOR * x"))
    assert run(tmp_path, "-m", "pair.loops") == "[0.0, 4.0, 8.0, 12.0] 24.0 True", "stale machine code"
    (tmp_path / "pair" / "sizes.py").write_text("FACTOR = 0.25")
    assert run(tmp_path, "-m", "pair.loops") == "[0.0, 1.0, 2.0, 3.0] 6.0 True", "a constant's old value"


@compiled("f8[:,::1] i8", releases_gil=True)
def count_up(values, rounds):
    for _ in range(rounds):
        for k in range(values.shape[1]):
            values[0, k] = np.sqrt(values[0, k] + 1.0)


def test_other_threads_run_during_a_call() -> None:
    values = np.zeros((1, 1000))
    count_up(values, 1)  # loads it
    worker = threading.Thread(target=count_up, args=(values, 100_000))
    began = time.monotonic()
    worker.start()
    turns = 0
    while worker.is_alive():
        turns += 1
        time.sleep(0.001)
    assert time.monotonic() - began > 0.02, "the loop was too short"
    assert turns > 5


def test_arrays_out_of_order_are_rejected() -> None:
    loop = compiled("f8[:,::1] i8")(source_function(count_up))
    with pytest.raises(TypeError, match="argument 0 is not in C order"):
        loop(np.zeros((4, 2)).T, 1)


def test_machine_code_of_files_without_source_depends_on_their_code() -> None:
    def keyed(text: str) -> bytes:
        names: dict[str, Any] = {"__name__": "nowhere"}
        exec(compile(text, "/nowhere/loops.py", "exec"), names)
        return b"".join(source_of(names["loop"]))

    plain = "def loop(x):\n    return x * 2.0\n"
    assert keyed(plain) == keyed(plain)
    assert keyed(plain) != keyed(plain.replace("2.0", "3.0"))
    assert keyed(plain) != keyed(plain.replace("*", "+"))


@compiled("f8[:,::1] -> f8")
def corner(values):
    return values[-1, -1]


def test_every_call_is_checked_on_request(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ROBOYARD_CHECK_LOOPS", "1")
    assert corner(np.ones((2, 2))) == 1.0
    with pytest.raises(TypeError, match="float32 instead of float64"):
        corner(np.ones((2, 2), dtype=np.float32))
    with pytest.raises(TypeError, match="not in C order"):
        corner(np.ones((2, 3)).T)


@compiled("f8[:] i8 f8")
def fill(values, count, number):
    for k in range(count):
        values[k] = 1.0 / number


@compiled("f8[:] i8 f8")
def spread(values, count, number):
    for k in range(count):
        values[k] = 1.0 / number


def test_loaded_loops_reject_what_is_no_number_and_another_count_of_arguments() -> None:
    values = np.zeros(3)
    spread(values, 2, 4)
    assert values.tolist() == [0.25, 0.25, 0.0]
    for wrong in ((values, 2), (values, 2, "4"), (values, 2.5, 4.0), (values, 2, 4.0, 1)):
        with pytest.raises(TypeError):
            spread(*wrong)
    spread(values, np.int64(3), np.float32(8.0))
    assert values.tolist() == [0.125] * 3


def test_wrong_arguments_are_rejected_with_their_place() -> None:
    loop = Kernel(source_function(fill), fill.signature, fill.text)
    with pytest.raises(TypeError, match="argument 0 is float32 instead of float64"):
        loop(np.zeros(3, dtype=np.float32), 3, 1.0)
    with pytest.raises(TypeError, match="argument 0 has 2 dimensions instead of 1"):
        loop(np.zeros((3, 3)), 3, 1.0)
    with pytest.raises(TypeError, match="2 arguments instead of 3"):
        loop(np.zeros(3), 3)
    with pytest.raises(TypeError, match="signature"):
        compiled("f8[:] i8")(source_function(fill))


def test_numbas_own_function_takes_over_where_stored_code_cannot_be_used() -> None:
    values = np.zeros(3)
    jit(source_function(fill))(values, 2, 0.0)
    assert values.tolist() == [np.inf, np.inf, 0.0]


class Pieces(NamedTuple):
    """A record of arrays and a number."""

    weights: np.ndarray
    rows: np.ndarray
    scale: float


PIECES = record(Pieces, "f8[::1] i8[:,::1] f8")


def share_of(pieces, row):
    return pieces.scale * pieces.weights[pieces.rows[row, 0]]


@compiled("i8", PIECES, "f8[::1] -> i8", fast_math=True, no_nan=True, releases_gil=True)
def sum_up(first, pieces, out):
    count = 0
    for k in range(first, pieces.rows.shape[0]):
        out[k] = max(share_of(pieces, k), 0.0)
        count += 1 if out[k] > 0.0 else 0
    return count


def test_records_are_passed_field_by_field_and_whole_numbers_come_back() -> None:
    pieces = Pieces(np.array([1.0, -2.0, 3.0]), np.array([[2], [1], [0], [2]]), 0.5)
    for _ in range(2):  # the first call checks, the second is the machine code itself
        out = np.full(4, -1.0)
        count = sum_up(1, pieces, out)
        assert type(count) is int and count == 2
        assert out.tolist() == [-1.0, 0.0, 0.5, 1.5]
    assert not isinstance(sum_up, Kernel), "it was not loaded"


@compiled("i8[::1] f8[::1] f8[::1]", from_start=True)
def gather(places, values, out):
    for k in range(places.shape[0]):
        out[k] = values[places[k]]


def test_indices_that_count_from_the_start_are_taken_as_they_are() -> None:
    """Loops of others, compiled before and after, go on counting negative indices from the end."""
    values, out = np.arange(5.0), np.zeros(3)
    kernel = Kernel(source_function(gather), gather.signature, gather.text)
    assert kernel.signature.from_start
    kernel.load()(np.array([4, 0, 2]), values, out)
    assert out.tolist() == [4.0, 0.0, 2.0]
    inner = values[2:]
    machine_code(kernel.py_func, kernel.signature, "made", is_small=False)  # compiles, stored or not
    kernel.load()(np.array([-1, 0, -2]), inner, out)
    assert out.tolist() == [1.0, 2.0, 0.0]
    jit(kernel.py_func)(np.array([-1, 0, -2]), values, out)
    assert out.tolist() == [4.0, 0.0, 3.0]


class Parts(NamedTuple):
    """A record of arrays and an integer."""

    parts: np.ndarray
    places: np.ndarray
    factor: int


ITEM = record(Parts, "f8[::1] i8[:,:] i8")
BOTH = Bundle((ITEM, ITEM))


@compiled(BOTH, "i8 f8[::1] -> i8")
def sum_up_both(first, second, times, out):
    out[0] = second.factor * first.parts.sum()
    second.places[0, 0] += times
    return first.places[0, 0]


def test_bundles_of_records_are_passed_as_one_argument() -> None:
    one = Parts(np.array([1.0, -2.0, 3.5]), np.array([[2, 3], [1, 4]]).T, 3)
    two = one._replace(places=np.array([[4], [5]]), factor=-2)
    both, out = BOTH.of(one, two), np.zeros(1)
    kernel = compiled(BOTH, "i8 f8[::1] -> i8")(source_function(sum_up_both))
    for loop in (kernel.load(), objects.jitted(kernel.py_func, kernel.signature)):
        two.places[0, 0] = 4
        assert loop(both, 7, out) == 2
        assert out[0] == -5.0 and two.places[0, 0] == 11
    one.parts[0] = 2.0  # the same arrays
    sum_up_both(both, 0, out)
    assert out[0] == -7.0


ONE = Bundle((ITEM,))


def test_a_bundle_of_one_record_is_passed_where_no_code_is_stored() -> None:
    def sum_up_one(item, times):
        item.places[0, 0] += times
        return item.factor

    item = Parts(np.array([1.0]), np.array([[4], [5]]), 3)
    kernel = compiled(ONE, "i8 -> i8")(source_function(sum_up_one))
    for loop in (kernel.load(), objects.jitted(kernel.py_func, kernel.signature)):
        item.places[0, 0] = 4
        assert loop(ONE.of(item), 7) == 3
        assert item.places[0, 0] == 11


def test_records_of_an_earlier_bundle_are_not_checked_again() -> None:
    one = Parts(np.array([1.0, -2.0, 3.5]), np.array([[2, 3], [1, 4]]).T, 3)
    two, other = one._replace(factor=-2), one._replace(parts=np.zeros(1), factor=7)
    before = BOTH.of(one, two)
    assert BOTH.of(one, other, before=before).tolist() == BOTH.of(one, other).tolist()
    assert BOTH.of(other, one, before=before).tolist() == BOTH.of(other, one).tolist()
    with pytest.raises(TypeError, match="parts is float32 instead of float64"):
        BOTH.of(one, two._replace(parts=np.zeros(3, np.float32)), before=before)
    made = BOTH.of(one, two, before=Bundle((ITEM, ITEM, ITEM)).of(two, one, one))
    assert made.tolist() == before.tolist()


def test_wrong_bundles_are_rejected() -> None:
    pieces = Parts(np.array([1.0, -2.0, 3.0]), np.array([[2], [1]]), 3)
    with pytest.raises(TypeError, match="a Pieces has a number"):
        Bundle((PIECES,))
    with pytest.raises(TypeError, match="1 records instead of 2"):
        BOTH.of(pieces)
    with pytest.raises(TypeError, match="parts is float32 instead of float64"):
        BOTH.of(pieces, pieces._replace(parts=np.zeros(3, np.float32)))
    loop = compiled(BOTH, "i8 f8[::1] -> i8")(source_function(sum_up_both))
    with pytest.raises(TypeError, match="argument 0 is not of this bundle"):
        loop(Bundle((ITEM,)).of(pieces), 1, np.zeros(1))


def test_wrong_records_are_rejected_by_field() -> None:
    pieces = Pieces(np.array([1.0, -2.0, 3.0]), np.array([[2], [1]]), 0.5)
    loop = compiled("i8", PIECES, "f8[::1] -> i8")(source_function(sum_up))
    with pytest.raises(TypeError, match="argument 1 rows is int32 instead of int64"):
        loop(0, pieces._replace(rows=pieces.rows.astype(np.int32)), np.zeros(2))
    with pytest.raises(TypeError, match="argument 1 is a tuple instead of a Pieces"):
        loop(0, tuple(pieces), np.zeros(2))
    with pytest.raises(TypeError, match="3 fields"):
        record(Pieces, "f8[::1]")


@pytest.mark.skipif(not images_can_be_loaded(), reason="object files are not looked into here")
def test_a_loop_that_needs_numba_when_it_runs_is_refused(tmp_path: Path) -> None:
    (tmp_path / "flat.py").write_text(
        "import numpy as np\n"
        "from roboyard.native import compiled\n\n"
        '@compiled("f8[:,::1] -> f8")\n'
        "def total(a):\n"
        "    return a.reshape(a.shape[0] * a.shape[1])[0]\n\n"
        "try:\n"
        "    total(np.ones((2, 3)))\n"
        "except TypeError as error:\n"
        "    print(error)\n"
    )
    for _ in range(2):  # nothing is stored that a later process would load
        assert "total calls numba_attempt_nocopy_reshape of numba" in run(tmp_path, "flat.py")
