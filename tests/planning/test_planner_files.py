"""Planner files of the bundled R1 in all layouts give the same robot."""

from __future__ import annotations

from pathlib import Path

import pytest

from roboyard.assets import assets_root
from roboyard.description import load_description
from roboyard.errors import ConfigError
from roboyard.planning import load_planner_file

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
