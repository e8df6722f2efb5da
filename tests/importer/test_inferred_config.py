"""Settings inferred from the bundled R1 without its configuration, compared with that configuration."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
import yaml

from roboyard.assets import asset_path
from roboyard.description import load_description
from roboyard.description.semantic import SemanticDescription
from roboyard.importer.build import build_package
from roboyard.importer.config.schema import BaseMotion
from roboyard.importer.inferred_config import inferred_base_motion
from roboyard.morphology.analyze import infer_semantics

CONFIG = asset_path("r1").parent / "r1_source_config.yaml"


@pytest.fixture(scope="module")
def r1() -> SemanticDescription:
    return infer_semantics(load_description(asset_path("r1")))


def test_the_base_of_r1_moves_as_its_configuration_says(r1: SemanticDescription) -> None:
    stated = yaml.safe_load(CONFIG.read_text())["base_motion"]
    assert inferred_base_motion(r1) == BaseMotion.model_validate(stated)
    assert (r1.base, r1.drive) == ("holonomic", "swerve")


def test_the_arms_and_grippers_of_r1_are_those_of_its_configuration(r1: SemanticDescription) -> None:
    stated = yaml.safe_load(CONFIG.read_text())["curobo"]["eef_to_gripper_info"]
    assert [arm.name for arm in r1.arms] == ["left", "right"]
    assert r1.trunk_joints == tuple(f"torso_joint{k}" for k in range(1, 5))
    for arm in r1.arms:
        assert arm.joints == tuple(f"{arm.name}_arm_joint{k}" for k in range(1, 7))
        gripper = arm.end_effector.gripper
        assert gripper is not None
        given = stated[f"{arm.name}_eef_link"]
        assert set(gripper.links) == set(given["links"])
        assert {*gripper.joints, *gripper.mimic_joints} == set(given["joints"])
        assert arm.end_effector.link == f"{arm.name}_arm_link6"


def test_a_base_that_wheels_or_virtual_joints_move_keeps_its_wheels(r1: SemanticDescription) -> None:
    driven = replace(r1, base="differential")
    assert inferred_base_motion(driven) == BaseMotion(wheel_links=list(r1.wheel_links))
    moved = inferred_base_motion(replace(r1, virtual_joints=("x", "y")))
    drawn = inferred_base_motion(replace(r1, wheels=()))
    assert drawn.use_holonomic_joints and not drawn.use_sphere_wheels
    assert not inferred_base_motion(replace(r1, wheels=()), is_moved=True).use_holonomic_joints
    assert not moved.use_holonomic_joints and moved.wheel_joints == []


def test_the_pairs_that_r1_ignores_include_those_of_its_configuration(tmp_path: Path) -> None:
    """The document's list was made for the same robot; ours has pairs that never collide besides."""
    stated = yaml.safe_load(CONFIG.read_text())["curobo"]["self_collision_ignore"]
    planning = build_package(asset_path("r1"), name="r1", out=tmp_path).robot.planning
    assert planning is not None
    ours = {frozenset((a, b)) for a, others in planning.ignore.items() for b in others}
    theirs = {frozenset((a, b)) for a, others in stated.items() for b in others}
    assert theirs <= ours, f"missing: {sorted(sorted(pair) for pair in theirs - ours)}"
