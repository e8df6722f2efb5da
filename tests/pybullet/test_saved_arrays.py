"""Archives of arrays that saveBullet writes, read by NumPy and by Python's zipfile."""

from __future__ import annotations

import zipfile
from pathlib import Path

import numpy as np
import pytest

from roboyard.pybullet.readers import saved_arrays

ARRAYS = {
    "numbers": np.random.default_rng(0).normal(size=(7, 3)),
    "turned": np.arange(12, dtype=np.int64).reshape(3, 4).T,
    "every second": np.arange(9, dtype=np.int32)[::2],
    "one": np.array(5),
    "none": np.zeros((0, 4, 17)),
    "flags": np.array([True, False]),
}


@pytest.mark.parametrize("largest", [2**31, 100])
def test_numpy_reads_what_is_written(tmp_path: Path, largest: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(saved_arrays, "_LARGEST", largest)
    file = tmp_path / "state.bullet"
    with file.open("wb") as opened:
        saved_arrays.write_arrays(opened, ARRAYS)
    with zipfile.ZipFile(file) as archive:
        assert archive.testzip() is None
        assert archive.namelist() == [f"{name}.npy" for name in ARRAYS]
    with np.load(file, allow_pickle=False) as found:
        for name, array in ARRAYS.items():
            assert found[name].dtype == array.dtype
            np.testing.assert_array_equal(found[name], array)


def test_headers_are_those_of_numpy(tmp_path: Path) -> None:
    for array in ARRAYS.values():
        plain = np.ascontiguousarray(array).reshape(array.shape)
        np.save(tmp_path / "one.npy", plain)
        theirs = (tmp_path / "one.npy").read_bytes()
        ours = saved_arrays._header(plain.dtype.str, plain.shape)
        assert ours == theirs[: len(theirs) - plain.nbytes]
