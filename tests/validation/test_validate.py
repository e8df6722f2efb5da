"""Validation: sound robots pass every gate, each fault fails its own."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml

from roboyard.assets import assets_root
from roboyard.cli import main
from roboyard.description.model import (
    Box,
    Collision,
    Inertial,
    Joint,
    Limit,
    Link,
    Pose,
    RobotDescription,
    Visual,
)
from roboyard.errors import ConfigError
from roboyard.robots import parse_definition
from roboyard.sensors.occlusion import occluded_fraction
from roboyard.validation import ValidationReport, validate
from roboyard.validation.gates import GATES
from roboyard.validation.page import page_html
from roboyard.validation.report import Gate

DEFINITION = {
    "raw_controller_order": ["trunk", "camera"],
    "default_controllers": {"trunk": "JointController", "camera": "JointController"},
    "default_joint_pos": [0.0, 0.0],
    "articulated_trunk": {"trunk_joint_names": ["shoulder"]},
    "active_camera": {"camera_joint_names": ["elbow"]},
}


def block(name: str, size: float = 0.05, mass: float = 1.0) -> Link:
    moment = mass * 0.01
    return Link(
        name=name,
        inertial=Inertial(
            mass=mass, origin=Pose(position=(0.1, 0, 0)), inertia=(moment, 0, 0, moment, 0, moment)
        ),
        visuals=(Visual(geometry=Box(size=(size, size, size)), origin=Pose(position=(0.1, 0, 0))),),
        collisions=(Collision(geometry=Box(size=(size, size, size)), origin=Pose(position=(0.1, 0, 0))),),
    )


def robot(effort: float = 50.0, size: float = 0.05, upper: float = 1.0) -> RobotDescription:
    limit = Limit(lower=-1.0, upper=upper, effort=effort, velocity=2.0)
    return RobotDescription(
        name="bench",
        links=(
            replace(block("base"), collisions=(), visuals=()),
            block("upper", size),
            block("lower", size),
            block("tip", size),
        ),
        joints=(
            Joint(
                name="stand", type="fixed", parent="base", child="tip", origin=Pose(position=(0.25, 0.3, 1.0))
            ),
            Joint(
                name="shoulder",
                type="revolute",
                parent="base",
                child="upper",
                axis=(0, 1, 0),
                limit=limit,
                origin=Pose(position=(0, 0, 1.0)),
            ),
            Joint(
                name="elbow",
                type="revolute",
                parent="upper",
                child="lower",
                axis=(0, 1, 0),
                limit=limit,
                origin=Pose(position=(0.1, 0.3, 0)),
            ),
        ),
    )


def test_r1_passes_every_gate() -> None:
    report = validate("r1")
    assert [gate.name for gate in report.failed] == []
    assert {gate.name for gate in report.gates} >= {
        "settle",
        "base_drift",
        "response",
        "drive",
        "ik_reach",
        "overshoot",
        "error",
        "tuck",
        "sensors",
        "free_joints",
        "spheres",
    }
    assert {gate.name for gate in report.gates if gate.skipped} == {"complete", "stand", "free_joints"}
    assert report.gate("base_drift").figure < 1e-3
    assert report.gate("ik_reach").figure == 1.0


NOT_OF_THE_ROVER = {
    "complete",
    "overshoot",
    "error",
    "arms_free",
    "ik_reach",
    "tuck",
    "sensors",
    "free_joints",
    "spheres",
}


def test_the_rover_passes_and_skips_gates_that_do_not_apply() -> None:
    report = validate("rover")
    assert report.passed
    assert {gate.name for gate in report.gates if gate.skipped} == NOT_OF_THE_ROVER


def test_a_valid_robot_passes() -> None:
    assert [g.name for g in validate(robot(), definition=DEFINITION).failed] == []


def test_links_that_overlap_fail_and_are_named() -> None:
    report = validate(robot(size=0.16), definition=DEFINITION, gates=["self_collision"])
    gate = report.gate("self_collision")
    assert not gate.passed
    assert gate.findings[0].startswith("lower and tip overlap by")
    assert "disabled_collision_pairs" in gate.advice
    cured = {**DEFINITION, "disabled_collision_pairs": [["tip", "lower"]]}
    assert validate(robot(size=0.16), definition=cured, gates=["self_collision"]).passed
    silent = {**DEFINITION, "disabled_collision_link_names": ["tip"]}
    assert validate(robot(size=0.16), definition=silent, gates=["self_collision"]).passed
    off = {**DEFINITION, "self_collisions": False}
    assert validate(robot(size=0.16), definition=off, gates=["self_collision"]).passed


def test_a_motor_that_is_too_weak_fails_settling_or_drifts() -> None:
    report = validate(robot(effort=1.0), definition=DEFINITION, gates=["settle", "drift", "response"])
    assert not report.passed
    failed = {gate.name for gate in report.failed}
    assert failed & {"settle", "joint_drift", "response", "isolation"}
    assert any("effort" in gate.advice for gate in report.failed)


def test_postures_outside_limits_are_found() -> None:
    report = validate(
        robot(upper=0.2), definition={**DEFINITION, "default_joint_pos": [0.5, 0.0]}, gates=["limits"]
    )
    gate = report.gate("limits")
    assert gate.figure == 1.0
    assert gate.findings == ["default_joint_pos: shoulder = 0.5 is outside -1 to 0.2"]


def test_joints_without_response_are_found() -> None:
    """A joint whose range is a point cannot answer its command."""
    stuck = robot()
    joints = tuple(
        replace(j, limit=Limit(lower=0.0, upper=1e-6, effort=50.0, velocity=2.0)) if j.name == "elbow" else j
        for j in stuck.joints
    )
    gate = validate(replace(stuck, joints=joints), definition=DEFINITION, gates=["response"]).gate("response")
    assert not gate.passed
    assert "camera[0] moves its joints by" in gate.findings[0]


def test_a_camera_inside_the_robot_is_found(data: Path) -> None:
    from roboyard.robots import add_robot
    from roboyard.sim import World

    world = World()
    one = add_robot(world, robot(), definition=DEFINITION)
    middle = one.body.link("upper").pose[0] + [0.1, 0, 0]
    looking = np.array([[0.0, 0, -1], [-1, 0, 0], [0, 1, 0]])
    assert occluded_fraction(one.body, middle + np.array([0, 0, 0.5]), looking) == 0.0
    assert occluded_fraction(one.body, middle - [0.06, 0, 0], looking) > 0.5


def test_unknown_gates_and_wrong_definitions_are_named() -> None:
    with pytest.raises(ConfigError, match="no gate named 'setle'; did you mean 'settle'"):
        validate("rover", gates=["setle"])
    wrong = {**DEFINITION, "articulated_trunk": {"trunk_joint_names": ["shulder"]}}
    with pytest.raises(
        ConfigError, match=r"articulated_trunk\.trunk_joint_names\[0\]: the robot has no moving joint"
    ):
        validate(robot(), definition=parse_definition(wrong))


def test_a_definition_with_wrong_wheels_fails_to_drive() -> None:
    rover = {**yaml.safe_load((assets_root() / "rover" / "rover.yaml").read_text())}
    rover["two_wheel"] = {"wheel_radius": 0.06, "wheel_axle_length": 0.5}
    gate = validate("rover", definition=rover, gates=["drive"]).gate("drive")
    assert not gate.passed
    message = " ".join(gate.findings)
    assert "two_wheel.wheel_radius is 0.06 m; the shapes of left_wheel reach 0.075" in message
    assert "two_wheel.wheel_axle_length is 0.5 m" in message
    assert "wheel_axle_length" in gate.advice


def test_command_line_json_and_page(tmp_path: Path, capsys: pytest.CaptureFixture) -> None:
    html = tmp_path / "rover.html"
    assert main(["validate", "rover", "--json", "--html", str(html)]) == 0
    message = json.loads(capsys.readouterr().out)
    assert message["passed"] is True
    assert {gate["name"] for gate in message["gates"]} >= {"settle", "base_drift", "response"}
    text = html.read_text()
    assert text.count("<svg") >= 3
    assert "The robot comes to rest" in text
    assert "http" not in text


def test_the_command_line_names_failed_gates(tmp_path: Path, capsys: pytest.CaptureFixture) -> None:
    file = tmp_path / "rover.yaml"
    file.write_text((assets_root() / "rover" / "rover.yaml").read_text() + "default_joint_pos: [0, 0]\n")
    assert main(["validate", "rover", "--definition", str(file), "--gate", "settle"]) == 0
    assert "The robot comes to rest" in capsys.readouterr().out
    assert main(["validate", "unknown"]) == 1
    assert "no file or robot named 'unknown'" in capsys.readouterr().err


def test_pages_escape_text_of_files() -> None:
    gate = Gate(
        name="x", title="<script>", figure=2.0, threshold=1.0, unit="m", findings=["<b>"], advice="<i>"
    )
    text = page_html(ValidationReport(robot="<r>", gates=(gate,)))
    assert "<script>" not in text
    assert "<b>&lt;" not in text.replace("<b>2 m", "")
    assert "&lt;r&gt;" in text


def test_a_nan_figure_fails() -> None:
    assert not Gate(name="x", title="x", figure=float("nan"), threshold=1.0, unit="m").passed
    assert set(GATES) == {
        "complete",
        "limits",
        "stand",
        "self_collision",
        "rest_contact",
        "settle",
        "drift",
        "response",
        "tracking",
        "drive",
        "ik_reach",
        "tuck",
        "sensors",
        "free_joints",
        "spheres",
    }


def test_only_the_sensor_gate_builds_visual_shapes(monkeypatch: pytest.MonkeyPatch) -> None:
    from roboyard.validation.test_world import TestWorld

    made: list[tuple[bool, int]] = []
    build = TestWorld.robot

    def recorded(self: TestWorld, **options: object) -> object:
        made.append((bool(options.get("visual")), 0))
        found = build(self, **options)  # type: ignore[arg-type]
        made[-1] = (made[-1][0], int((found.world.model.geom_group == 2).sum()))
        return found

    monkeypatch.setattr(TestWorld, "robot", recorded)
    report = validate(robot(), definition=DEFINITION)
    assert report.joints == 2
    assert made and all((seen > 0) == visual for visual, seen in made)
