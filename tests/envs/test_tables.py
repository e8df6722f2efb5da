"""Tables of strangers' datasets: refused in a line that names the file, before memory is taken."""

from __future__ import annotations

import resource
from pathlib import Path

import numpy as np
import pytest

pa = pytest.importorskip("pyarrow")
pq = pytest.importorskip("pyarrow.parquet")

from roboyard.envs.datasets.tables import MOST_VALUES, read_table  # noqa: E402
from roboyard.errors import ConfigError  # noqa: E402


def _write(file: Path, rows: int = 50) -> Path:
    values = np.arange(rows, dtype=np.float32)
    pq.write_table(pa.table({"action": pa.array(values), "episode_index": pa.array([0] * rows)}), file)
    return file


def test_a_table_is_read_as_it_was_written(tmp_path: Path) -> None:
    table = read_table(_write(tmp_path / "a.parquet"), ["action"], only=True)
    assert table.column_names == ["action"]
    np.testing.assert_array_equal(table["action"].to_numpy(), np.arange(50))


def test_a_missing_column_and_file_are_named(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"a\.parquet: it has no column 'reward'"):
        read_table(_write(tmp_path / "a.parquet"), ["action", "reward"])
    with pytest.raises(ConfigError, match=r"b\.parquet"):
        read_table(tmp_path / "b.parquet", [])


def test_a_small_file_of_enormous_columns_takes_no_memory(tmp_path: Path) -> None:
    """300 million zeros take a megabyte in a file, written in parts."""
    part = pa.table({"action": pa.array(np.zeros(5_000_000, dtype=np.int8))})
    file = tmp_path / "a.parquet"
    with pq.ParquetWriter(file, part.schema, compression="zstd") as writer:
        for _ in range(60):
            writer.write_table(part)
    assert file.stat().st_size < 2**21
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    with pytest.raises(ConfigError, match=f"at most {MOST_VALUES} values"):
        read_table(file, ["action"])
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 50_000  # kB


@pytest.mark.parametrize("seed", range(4))
def test_cut_and_changed_tables_are_read_or_refused(tmp_path: Path, seed: int) -> None:
    rng = np.random.default_rng(seed)
    whole = _write(tmp_path / "whole.parquet").read_bytes()
    file = tmp_path / "changed.parquet"
    refused = 0
    for _ in range(60):
        data = bytearray(whole)
        for place in rng.integers(0, len(data), 4):
            data[place] = rng.integers(0, 256)
        if rng.random() < 0.3:
            data = data[: rng.integers(0, len(data))]
        file.write_bytes(bytes(data))
        try:
            read_table(file, ["action"])
        except ConfigError as error:
            refused += 1
            assert "changed.parquet" in str(error)
    assert refused > 10
