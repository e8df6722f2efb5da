"""A data folder for the whole session (the bundled R1 is imported into it once) and small helpers."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
import yaml

from roboyard.assets import assets_root

sys.path.insert(0, str(Path(__file__).parent))

R1_FILE = assets_root() / "r1" / "r1.yaml"


@pytest.fixture(scope="session")
def data_root(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("data")


@pytest.fixture(autouse=True)
def data(data_root: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    monkeypatch.setenv("ROBOYARD_DATA", str(data_root))
    yield data_root


@pytest.fixture
def r1_data() -> dict:
    """R1's definition as plain data, to be spoiled."""
    return yaml.safe_load(R1_FILE.read_text())
