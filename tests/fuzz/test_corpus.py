"""Files that once broke a reader, and valid ones: each is read, or refused in a line, in little time."""

from __future__ import annotations

import os
import random
import sys
import time
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))
sys.path.insert(0, str(Path(__file__).parents[2] / "tools"))
import readers
from fuzz_readers import changed

CASES = int(os.environ.get("ROBOYARD_FUZZ_CASES", "20"))
"""Changed files for each reader; 10000 looks longer, and tools/fuzz_readers.py in children with limits."""


@pytest.mark.parametrize("name", sorted(file.name for file in readers.CORPUS.iterdir()))
def test_what_once_broke_is_read_or_refused(tmp_path: Path, name: str) -> None:
    begin = time.process_time()
    readers.survives(name.partition(".")[0], (readers.CORPUS / name).read_bytes(), tmp_path)
    assert time.process_time() - begin < 5


@pytest.mark.parametrize("reader", [name for name in readers.READERS if name != "log"])
def test_the_valid_files_are_valid(tmp_path: Path, reader: str) -> None:
    if reader == "usd":
        pytest.importorskip("pxr")
    suffix, read, data = readers.READERS[reader]
    file = tmp_path / f"case{suffix}"
    file.write_bytes(data)
    read(file)


@pytest.mark.parametrize("reader", list(readers.READERS))
def test_changed_files_are_read_or_refused(tmp_path: Path, reader: str) -> None:
    draw = random.Random(f"{reader} 1")
    for _ in range(CASES):
        readers.survives(reader, changed(readers.READERS[reader][2], draw), tmp_path)
