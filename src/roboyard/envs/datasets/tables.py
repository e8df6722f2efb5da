"""Parquet tables and JSON files of a dataset."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from roboyard.errors import ConfigError, MissingExtraError
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


__all__ = ["FILE", "INDEX", "LARGEST_INFO", "column", "pa", "pq", "read_meta", "task_table", "write_json"]
