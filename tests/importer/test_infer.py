"""`roboyard infer`: a configuration with reasons that gives the package of the description alone."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
import yaml

from roboyard.cli import main
from roboyard.errors import ConfigError
from roboyard.importer.build import build_package
from roboyard.importer.config.load import load_config
from roboyard.importer.infer import infer_config
from roboyard.importer.report.conclusions import conclusion_table

INERTIA = '<inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/>'


def _link(name: str, shape: str = "", mass: float = 0.5, xyz: str = "0 0 0") -> str:
    geometry = f'<origin xyz="{xyz}"/><geometry>{shape}</geometry>'
    shapes = f"<visual>{geometry}</visual><collision>{geometry}</collision>" if shape else ""
    inertial = f'<inertial><mass value="{mass}"/>{INERTIA}</inertial>' if shape else ""
    return f'<link name="{name}">{inertial}{shapes}</link>'


def _joint(
    name: str, parent: str, child: str, kind: str, xyz: str, axis: str = "0 0 1", rpy: str = "0 0 0"
) -> str:
    limits = {"revolute": "-2 2", "prismatic": "0 0.03"}.get(kind, "")
    lower, upper = limits.split() or ("", "")
    limit = f'<limit lower="{lower}" upper="{upper}" effort="20" velocity="2"/>' if limits else ""
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="{xyz}" rpy="{rpy}"/><axis xyz="{axis}"/>{limit}</joint>'
    )


def _box(x: float, y: float, z: float) -> str:
    return f'<box size="{x} {y} {z}"/>'


def _mobile_manipulator() -> str:
    """Two wheels and a caster ball, an arm of five joints, two jaws, a camera, a lidar and an IMU."""
    wheel = '<cylinder radius="0.1" length="0.04"/>'
    parts = [_link("base", _box(0.5, 0.4, 0.1), 10)]
    for side, y in (("left", 0.25), ("right", -0.25)):
        parts.append(_link(f"{side}_wheel", wheel))
        parts.append(
            _joint(
                f"{side}_wheel_joint", "base", f"{side}_wheel", "continuous", f"0 {y} 0", rpy="-1.5708 0 0"
            )
        )
    above = "base"
    axes = ("0 0 1", "0 1 0", "0 1 0", "0 0 1", "0 1 0")
    for index, axis in enumerate(axes):
        parts.append(_link(f"arm_{index}", _box(0.05, 0.05, 0.16), xyz="0 0 0.1"))
        xyz = "0.1 0 0.06" if index == 0 else "0 0 0.2"
        parts.append(_joint(f"arm_joint_{index}", above, f"arm_{index}", "revolute", xyz, axis))
        above = f"arm_{index}"
    parts += [_link("palm", _box(0.05, 0.1, 0.04)), _joint("palm_mount", above, "palm", "fixed", "0 0 0.2")]
    for side, y, axis in (("left", 0.006, "0 1 0"), ("right", -0.006, "0 -1 0")):
        parts.append(_link(f"{side}_finger", _box(0.02, 0.01, 0.08), 0.05, "0 0 0.06"))
        parts.append(_joint(f"{side}_slide", "palm", f"{side}_finger", "prismatic", f"0 {y} 0.02", axis))
    optical = "-1.5708 0 -1.5708"
    parts += [
        _link("camera_link", _box(0.02, 0.08, 0.02), 0.1),
        _joint("camera_mount", "base", "camera_link", "fixed", "0.26 0 0.1"),
        _link("camera_optical_frame"),
        _joint("camera_optical", "camera_link", "camera_optical_frame", "fixed", "0 0 0", rpy=optical),
        _link("laser", '<cylinder radius="0.03" length="0.04"/>', 0.1),
        _joint("laser_mount", "base", "laser", "fixed", "0.2 0 0.08"),
        _link("imu_link"),
        _joint("imu_mount", "base", "imu_link", "fixed", "0 0 0.05"),
    ]
    return f'<robot name="helper">{"".join(parts)}</robot>'


@pytest.fixture
def urdf(tmp_path: Path) -> Path:
    """Return the file of a mobile manipulator."""
    file = tmp_path / "helper.urdf"
    file.write_text(_mobile_manipulator(), encoding="utf-8")
    return file


def test_the_configuration_states_what_was_understood(urdf: Path):
    data = yaml.safe_load(infer_config(urdf).text)
    stated = data["understanding"]
    assert (data["name"], data["urdf_path"]) == ("helper", str(urdf))
    assert (stated["kind"], stated["base"]) == ("mobile_manipulator", "differential")
    assert list(stated["arms"].values()) == [[f"arm_joint_{index}" for index in range(5)]]
    assert list(stated["opening"].values()) == ["increasing"]
    assert stated["imu_links"] == ["imu_link"]
    assert data["base_motion"]["wheel_links"] == ["left_wheel", "right_wheel"]
    assert data["curobo"]["eef_to_gripper_info"] == {
        "palm": {
            "links": ["left_finger", "right_finger"],
            "joints": ["left_slide", "right_slide"],
        }
    }
    (camera,) = data["camera_links"]
    assert camera["link"] == "camera_optical_frame"
    assert camera["offset"]["orientation"] == [1.0, 0.0, 0.0, 0.0]
    assert [entry["link"] for entry in data["lidar_links"]] == ["laser"]


def test_each_value_has_its_evidence_and_confidence_in_a_comment(urdf: Path):
    found = infer_config(urdf)
    comments = " ".join(line.strip(" #") for line in found.text.splitlines() if line.strip().startswith("#"))
    for conclusion in found.semantic.conclusions:
        assert f"{100 * conclusion.confidence:.0f} % sure" in comments
        for reason in conclusion.evidence[:1]:
            assert reason[1:] in comments
    assert "away from the other tip" in comments


def test_an_import_of_it_gives_the_package_of_the_description_alone(urdf: Path, tmp_path: Path):
    config = tmp_path / "helper.yaml"
    config.write_text(infer_config(urdf, relative_to=tmp_path).text, encoding="utf-8")
    alone = build_package(urdf, out=tmp_path / "alone")
    configured = build_package(config, out=tmp_path / "configured")
    assert load_config(config).config == infer_config(urdf).config.model_copy(
        update={"urdf_path": "helper.urdf"}
    )
    first, second = (
        {
            file.relative_to(made.model_folder): file.read_bytes()
            for file in made.model_folder.rglob("*")
            if file.is_file()
        }
        for made in (alone, configured)
    )
    assert first.keys() == second.keys() and len(first) > 5
    changed = {str(name) for name in first if first[name] != second[name]}
    assert changed == {"import_log.json"}  # it has durations and the configuration's path
    logs = [json.loads(files[Path("import_log.json")]) for files in (first, second)]
    for key in ("decisions", "conclusions", "source", "fixes"):
        assert logs[0][key] == logs[1][key]


def test_a_changed_value_replaces_the_inferred_one(urdf: Path, tmp_path: Path):
    data = yaml.safe_load(infer_config(urdf).text)
    name = next(iter(data["understanding"]["arms"]))
    data["understanding"] |= {
        "kind": "other",
        "arms": {name: ["arm_joint_1", "arm_joint_2"]},
        "opening": {name: "decreasing"},
        "imu_links": [],
    }
    robot = build_package(data, out=tmp_path / "data").robot
    assert robot.semantic.kind == "other"
    (arm,) = robot.semantic.arms
    assert arm.joints == ("arm_joint_1", "arm_joint_2")
    gripper = arm.end_effector.gripper
    assert gripper is not None and gripper.opening == "decreasing"
    assert robot.semantic.mounted("imu") == ()
    assert robot.semantic.confidence("kind") == 1.0


def test_unknown_names_are_errors_with_their_place(urdf: Path):
    config = {"urdf_path": str(urdf), "name": "helper", "understanding": {"arms": {"left": ["arm_joint_9"]}}}
    with pytest.raises(ConfigError, match=r"understanding.arms.left\[0\].*arm_joint_9"):
        build_package(config)


def test_the_log_lists_each_conclusion_with_the_line_that_changes_it(urdf: Path, tmp_path: Path):
    facts = build_package(urdf, out=tmp_path / "data").facts
    fields = {one["field"] for one in facts["conclusions"]}
    assert {"kind", "base", "drive_wheels", "camera_links.camera", "lidar_links.laser"} <= fields
    assert all(one["setting"] and one["evidence"] for one in facts["conclusions"])
    page = "".join(conclusion_table(facts))
    assert "lidar_links: [{link: laser}]" in page and "mobile_manipulator" in page
    thin = {"conclusions": [{**facts["conclusions"][0], "confidence": 0.4}]}
    assert "check the first 1" in "".join(conclusion_table(thin))


def test_the_command_writes_yaml_a_file_or_json(
    urdf: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
):
    assert main(["infer", str(urdf)]) == 0
    printed = capsys.readouterr().out
    assert yaml.safe_load(printed)["name"] == "helper"
    out = tmp_path / "config.yaml"
    assert main(["infer", str(urdf), "--out", str(out), "--name", "mine"]) == 0
    capsys.readouterr()
    assert yaml.safe_load(out.read_text(encoding="utf-8"))["urdf_path"] == "helper.urdf"
    assert main(["infer", str(urdf), "--json"]) == 0
    data = json.loads(capsys.readouterr().out)
    assert data["understanding"]["camera_links"] == {"camera": "camera_link"}
    assert main(["infer", str(tmp_path / "missing.urdf")]) == 1
    assert "missing.urdf" in capsys.readouterr().err
