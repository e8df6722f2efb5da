"""Planner files of the bundled R1 in all layouts give the same robot."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path

import pytest

from roboyard.assets import assets_root
from roboyard.description import load_description
from roboyard.errors import ConfigError
from roboyard.planning import load_planner_file, robot_planner

R1 = assets_root() / "r1"
FILES = (
    "r1_description_curobo_default.yaml",
    "nested/r1_description_curobo_default.yaml",
    "r1.yml",
    "r1.xrdf",
)


def test_all_layouts_give_the_same_spheres_and_pairs() -> None:
    description = load_description(R1 / "urdf" / "r1.urdf")
    models = [load_planner_file(R1 / "curobo" / name, description) for name in FILES]
    first = models[0]
    assert first.buffer == 0.002
    assert (first.acceleration, first.jerk) == (15.0, 500.0)
    assert len(first.spheres) > 15
    for other in models[1:]:
        assert other.spheres == first.spheres
        assert other.ignore == first.ignore
        assert other.buffer == first.buffer
        assert set(other.tools) == {"left_eef_link", "right_eef_link"}


def test_a_file_is_read_again_only_if_it_or_the_description_changes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(robot_planner, "covering_model", lambda model: model)
    model_of = robot_planner._model_of_file
    description = load_description(R1 / "urdf" / "r1.urdf")
    file = tmp_path / "r1.yml"
    file.write_bytes((R1 / "curobo" / "r1.yml").read_bytes())
    first = model_of(file, description)
    assert first == load_planner_file(file, description)
    assert model_of(file, replace(description)) is not first
    assert model_of(file, description) is first
    text = file.read_text()
    assert "collision_sphere_buffer: 0.002" in text
    file.write_text(text.replace("collision_sphere_buffer: 0.002", "collision_sphere_buffer: 0.003"))
    os.utime(file, ns=(0, 0))
    assert model_of(file, description).buffer == 0.003


def test_a_file_of_another_robot_is_refused(tmp_path: Path) -> None:
    description = load_description(assets_root() / "arm7" / "arm7.urdf")
    with pytest.raises(ConfigError, match="base_link"):
        load_planner_file(R1 / "curobo" / "r1.yml", description)
    path = tmp_path / "empty.yml"
    path.write_text("robot_cfg: {kinematics: {}}")
    with pytest.raises(ConfigError, match=r"empty\.yml"):
        load_planner_file(path, description)
    with pytest.raises(ConfigError, match="check the path"):
        load_planner_file(tmp_path / "missing.yml", description)
