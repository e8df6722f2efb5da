"""Parquet tables and JSON files of a dataset."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from roboyard.errors import ConfigError, MissingExtraError
from roboyard.untrusted.files import check_file
from roboyard.untrusted.json_reading import read_json

try:
    import pyarrow as pa  # pyright: ignore[reportMissingImports]
    import pyarrow.parquet as pq  # pyright: ignore[reportMissingImports]
except ModuleNotFoundError as error:
    raise MissingExtraError("pyarrow", "datasets", "writing datasets") from error

FILE = "chunk-000/file-000"
"""First file of a folder of tables or films."""
LARGEST_INFO = 64 << 20
"""Bytes of a file of `meta/`."""
LARGEST_TABLE = 2 << 30
"""Bytes of a table, as a file and unpacked."""
MOST_VALUES = 200_000_000
"""Values of all columns of a table; a file of some bytes can repeat one as often as it likes."""
INDEX = ("timestamp", "frame_index", "episode_index", "index", "task_index")
"""Columns that count steps, episodes and tasks."""


def column(values: np.ndarray) -> Any:
    """Return (k,) or (k, m) values as a column of a table."""
    if values.ndim == 1:
        return pa.array(values)
    return pa.FixedSizeListArray.from_arrays(pa.array(values.ravel()), values.shape[1])


def task_table(tasks: Mapping[str, int]) -> Any:
    """Return the table of tasks, whose texts pandas reads as its index."""
    table = pa.table({"task_index": pa.array(list(tasks.values()), pa.int64()), "task": list(tasks)})
    described = [
        {"name": name, "field_name": name, "pandas_type": kind, "numpy_type": numpy, "metadata": None}
        for name, kind, numpy in (("task_index", "int64", "int64"), ("task", "unicode", "object"))
    ]
    pandas = {
        "index_columns": ["task"],
        "column_indexes": [],
        "columns": described,
        "pandas_version": "2.2.0",
    }
    return table.replace_schema_metadata({"pandas": json.dumps(pandas)})


def read_table(file: Path, columns: Sequence[str], *, only: bool = False, filters: Any = None) -> Any:
    """Return a table, whose size is known before memory is taken.

    Args:
        file: a Parquet file.
        columns: that it must have.
        only: whether only these are read.
        filters: which rows are read, as in pyarrow.

    Raises:
        ConfigError: it is missing, too large, no Parquet file, or lacks a column.
    """
    try:
        check_file(file, LARGEST_TABLE)
        with pq.ParquetFile(file) as opened:
            _check_size(opened.metadata)
            present = set(opened.schema_arrow.names)
        missing = [name for name in columns if name not in present]
        if missing:
            raise ConfigError(f"{file}: it has no column {missing[0]!r}; write the dataset again")
        return pq.read_table(file, columns=list(columns) if only else None, filters=filters)
    except (OSError, ValueError, NotImplementedError, MemoryError, pa.ArrowException) as error:
        raise ConfigError(f"{file}: no readable table of a dataset: {error}") from None


def _check_size(metadata: Any) -> None:
    """Check the size of a table by its metadata: values and bytes of its columns.

    Raises:
        ValueError: it is too large.
    """
    size = values = 0
    for group in range(metadata.num_row_groups):
        chunks = metadata.row_group(group)
        for k in range(chunks.num_columns):
            chunk = chunks.column(k)
            size += max(chunk.total_uncompressed_size, 0)
            values += max(chunk.num_values, chunks.num_rows)
    if size > LARGEST_TABLE or values > MOST_VALUES:
        raise ValueError(
            f"it has {values} values in {size / 2**20:.0f} MB; at most {MOST_VALUES} values and "
            f"{LARGEST_TABLE >> 20} MB are read"
        )


def write_json(file: Path, content: Any) -> None:
    """Write a file of `meta/`."""
    file.write_text(json.dumps(content, indent=1), encoding="utf-8")


def read_meta(folder: Path, name: str) -> Any:
    """Return a JSON file of a dataset's `meta/`.

    Raises:
        ConfigError: it is missing, or no JSON.
    """
    try:
        return read_json(folder / "meta" / name, LARGEST_INFO)
    except (OSError, ValueError) as error:
        raise ConfigError(f"{folder}: no dataset with a readable meta/{name}: {error}") from None


__all__ = [
    "FILE",
    "INDEX",
    "LARGEST_INFO",
    "column",
    "pa",
    "pq",
    "read_meta",
    "read_table",
    "task_table",
    "write_json",
]
