"""The tutorial's notebook: the script's cells, with the outputs that they gave."""

from __future__ import annotations

import base64
import importlib.util
import io
import json
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from PIL import Image

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def tool() -> ModuleType:
    spec = importlib.util.spec_from_file_location("make_notebook", ROOT / "tools" / "make_notebook.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def stored() -> dict:
    return json.loads((ROOT / "examples" / "pybullet_tutorial.ipynb").read_text(encoding="utf-8"))


def test_cells_are_those_of_the_script(tool: ModuleType, stored: dict) -> None:
    script = (ROOT / "tools" / "tutorial_cells.py").read_text(encoding="utf-8")
    fresh = tool.notebook(script)
    assert [cell["source"] for cell in stored["cells"]] == [cell["source"] for cell in fresh["cells"]], (
        "run python tools/make_notebook.py"
    )


def test_outputs_are_there_and_pictures_show_something(stored: dict) -> None:
    outputs = [output for cell in stored["cells"] for output in cell.get("outputs", ())]
    printed = "".join("".join(output["text"]) for output in outputs if output["output_type"] == "stream")
    assert "rgba shape=(200, 320, 4), dtype=uint8" in printed
    assert "  8: x=" in printed
    pictures = [output["data"]["image/png"] for output in outputs if "image/png" in output.get("data", {})]
    assert len(pictures) == 3
    for picture in pictures:
        raw = base64.b64decode(picture)
        assert len(raw) < 60_000
        pixels = np.asarray(Image.open(io.BytesIO(raw)).convert("RGB"))
        assert pixels.shape == (200, 320, 3)
        assert pixels.std() > 5


def test_a_cell_keeps_what_it_prints_and_its_last_value(tool: ModuleType) -> None:
    outputs = tool.run("'''Title'''\n\n# %% One\n\na = 2\nprint('hello')\na + 1\n\n# %% Two\n\nb = a\n")
    assert outputs[1][0]["text"] == ["hello\n"]
    assert outputs[1][1]["data"]["text/plain"] == ["3"]
    assert outputs[2] == []
