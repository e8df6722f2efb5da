"""The examples do what they say, are short, and are listed."""

from __future__ import annotations

import importlib
import importlib.util
import json
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from PIL import Image

ROOT = Path(__file__).parents[1]
EXAMPLES = ROOT / "examples"


@pytest.fixture
def example(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> Iterator[ModuleType]:
    monkeypatch.syspath_prepend(str(EXAMPLES))
    yield importlib.import_module(request.param)
    sys.modules.pop(request.param)


def of(name: str) -> pytest.MarkDecorator:
    return pytest.mark.parametrize("example", [name], indirect=True, ids=[name])


@pytest.mark.parametrize("path", sorted(EXAMPLES.glob("*.py")), ids=lambda path: path.stem)
def test_examples_are_short_and_listed(path: Path) -> None:
    text = path.read_text(encoding="utf-8")
    assert text.count("\n") < 80
    assert f"examples/{path.name}" in (ROOT / "docs" / "examples.md").read_text(encoding="utf-8")
    assert path.name in text, "the docstring says how to run it"


@of("pybullet_tutorial")
def test_the_husky_falls_onto_the_terrain(example: ModuleType, tmp_path: Path) -> None:
    heights = example.main(str(tmp_path / "film.gif"), str(tmp_path / "last.png"))
    assert heights[0] == 1.0 and 0.0 < heights[-1] < 0.6
    assert (np.diff(heights[:8]) < 0.0).all()
    with Image.open(tmp_path / "film.gif") as film:
        assert film.n_frames == 30
    assert (tmp_path / "last.png").stat().st_size > 5000


@of("messy_urdf")
def test_the_messy_file_is_repaired(example: ModuleType, tmp_path: Path) -> None:
    counts = example.main(tmp_path)
    assert {"inertia-not-positive", "mass-zero", "limit-reversed", "axis-not-unit"} <= set(counts)
    assert (tmp_path / "crane.png").stat().st_size > 1000
    assert (tmp_path / "crane.urdf").read_text() == example.EXPORT, "the original is not changed"


@of("import_and_drive")
def test_the_imported_rover_drives(
    example: ModuleType, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("ROBOYARD_DATA", str(tmp_path / "data"))
    assert 1.0 < example.main(tmp_path / "film.gif") < 5.0
    with Image.open(tmp_path / "film.gif") as film:
        assert film.n_frames == 75


@of("custom_environment")
def test_the_ball_of_a_task_of_ones_own_goes_over_the_line(example: ModuleType, tmp_path: Path) -> None:
    pytest.importorskip("gymnasium")
    assert example.main(str(tmp_path / "film.gif")) > 0.9
    with Image.open(tmp_path / "film.gif") as film:
        assert film.n_frames > 20


@pytest.mark.slow
@of("pick_and_place")
def test_the_can_is_placed_on_its_spot(example: ModuleType) -> None:
    assert example.main() < 0.01


@of("plan_around_shelf")
def test_the_arm_goes_around_the_board(example: ModuleType, tmp_path: Path) -> None:
    assert example.main(tmp_path / "film.gif", tmp_path / "plot.png") < 0.02
    assert (tmp_path / "plot.png").stat().st_size > 10_000


@pytest.mark.slow
@pytest.mark.skipif(
    not all(map(importlib.util.find_spec, ("ray", "pyarrow", "imageio_ffmpeg"))), reason="needs extras"
)
def test_episodes_written_in_parallel_are_one_dataset(tmp_path: Path) -> None:
    words = [sys.executable, str(EXAMPLES / "dataset.py"), str(tmp_path / "set"), "3"]
    done = subprocess.run(words, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    assert "repeats with an error of 0\n" in done.stdout
    assert json.loads((tmp_path / "set" / "meta" / "info.json").read_text())["total_episodes"] == 3
    assert [path.name for path in tmp_path.iterdir()] == ["set"]


@of("camera_dataset")
def test_boxes_and_poses_of_the_dataset_agree_with_its_pictures(example: ModuleType, tmp_path: Path) -> None:
    assert example.main(tmp_path, count=2) >= 4
    sample = json.loads((tmp_path / "00001.json").read_text())
    with Image.open(tmp_path / "00001_objects.png") as file:
        objects = np.array(file)
    with Image.open(tmp_path / "00001_depth.png") as file:
        depth = np.array(file)
    assert depth.dtype == np.uint16 and depth.shape == objects.shape
    forward = np.subtract(sample["target"], sample["eye"])
    forward /= np.linalg.norm(forward)
    for one in sample["objects"]:
        rows, columns = np.nonzero(objects == one["pixel_value"])
        assert one["box"] == [columns.min(), rows.min(), columns.max(), rows.max()]
        away = 1000 * forward @ np.subtract(one["position"], sample["eye"])
        assert abs(np.median(depth[rows, columns]) - away) < 60, "mm along the axis"


def test_a_program_written_for_pybullet_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    import roboyard.pybullet
    import roboyard.pybullet_data

    monkeypatch.setitem(sys.modules, "pybullet", roboyard.pybullet)
    monkeypatch.setitem(sys.modules, "pybullet_data", roboyard.pybullet_data)
    monkeypatch.syspath_prepend(str(EXAMPLES))
    monkeypatch.delitem(sys.modules, "pybullet_project", raising=False)
    example = importlib.import_module("pybullet_project")
    assert example.main(str(tmp_path / "picture.png")) < 0.012
    assert (tmp_path / "picture.png").stat().st_size > 1000
