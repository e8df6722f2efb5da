"""The MoveIt 2 configuration: read back as an SRDF, by xacro, and by pinocchio where it is installed."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest
import yaml

from roboyard.assets import asset_path
from roboyard.description import load_description
from roboyard.description.evidence.srdf import load_srdf
from roboyard.description.files.resolver import Resolver
from roboyard.description.robot_model import RobotModel
from roboyard.description.xacro.expand import expand_xacro
from roboyard.export import moveit, urdf
from roboyard.morphology.analyze import infer_semantics


def robot_of(name: str) -> RobotModel:
    """A bundled robot with its parts, driven joints and one posture."""
    description = load_description(asset_path(name))
    semantic = infer_semantics(description)
    wheels = {wheel.joint for wheel in semantic.wheels}
    drives = {
        joint.name: "velocity" if joint.name in wheels else "position"
        for joint in description.joints
        if joint.type in ("revolute", "continuous", "prismatic") and joint.mimic is None
    }
    rest = {joint.name: 0.25 * sum(joint.position_limits() or (0.0, 0.0)) for joint in description.joints}
    return RobotModel(
        name=name,
        description=description,
        semantic=replace(semantic, postures={"rest": rest}),
        drives=drives,  # type: ignore[arg-type]
    )


@pytest.fixture
def written(tmp_path: Path) -> Callable[[str], tuple[RobotModel, Path]]:
    def write(name: str) -> tuple[RobotModel, Path]:
        robot = robot_of(name)
        moveit.write(robot, tmp_path / "moveit")
        return robot, tmp_path / "moveit"

    return write


def _srdf(folder: Path) -> ET.Element:
    return ET.parse(next(folder.glob("*.srdf"))).getroot()


def test_the_srdf_names_the_parts_of_the_robot(written: Callable[[str], tuple[RobotModel, Path]]) -> None:
    robot, folder = written("r1")
    description = robot.description
    again = load_srdf(next(folder.glob("*.srdf")), description)
    groups = {group.name: set(group.joints) for group in again.groups}
    assert len(robot.semantic.arms) == 2
    for arm in robot.semantic.arms:
        assert set(arm.joints) <= groups[f"{arm.name}_arm"]
    root = _srdf(folder)
    for element in root.iter():
        for key in ("link", "base_link", "tip_link", "parent_link", "child_link", "link1", "link2"):
            if element.get(key) is not None:
                assert element.get(key) in description.link_by_name
        if element.tag in ("joint", "passive_joint"):
            assert element.get("name") in description.joint_by_name
    pairs = [frozenset((e.get("link1"), e.get("link2"))) for e in root.iter("disable_collisions")]
    assert len(pairs) == len(set(pairs))
    shaped = {link.name for link in description.links if link.collisions}
    for joint in description.joints:
        if {joint.parent, joint.child} <= shaped:
            assert frozenset((joint.parent, joint.child)) in pairs


def test_postures_are_those_of_the_robot(written: Callable[[str], tuple[RobotModel, Path]]) -> None:
    robot, folder = written("arm7")
    states = {(e.get("name"), e.get("group")): e for e in _srdf(folder).iter("group_state")}
    assert {("rest", "arm")} <= set(states)
    for (posture, _), state in states.items():
        for joint in state:
            value = robot.semantic.postures[str(posture)][joint.attrib["name"]]
            assert float(joint.attrib["value"]) == value


@pytest.mark.parametrize("name", ["r1", "arm7", "husky"])
def test_controllers_agree(written: Callable[[str], tuple[RobotModel, Path]], name: str) -> None:
    robot, folder = written(name)
    read = {
        stem: yaml.safe_load((folder / f"{stem}.yaml").read_text())
        for stem in ("kinematics", "joint_limits", "moveit_controllers", "ros2_controllers")
    }
    manager = read["moveit_controllers"]["moveit_simple_controller_manager"]
    run = read["ros2_controllers"]["controller_manager"]["ros__parameters"]
    for controller in manager["controller_names"]:
        joints = manager[controller]["joints"]
        assert set(joints) <= set(robot.description.joint_by_name)
        if all(robot.drives.get(joint, "none") != "none" for joint in joints):
            assert controller in run
    for controller, settings in run.items():
        if isinstance(settings, dict) and controller != "joint_state_broadcaster":
            assert "ros__parameters" in read["ros2_controllers"][controller]
    chains = {group.get("name") for group in _srdf(folder).iter("group") if group.find("chain") is not None}
    assert set(read["kinematics"] or {}) == chains
    for joint, limits in read["joint_limits"]["joint_limits"].items():
        limit = robot.description.joint_by_name[joint].limit
        if limits["has_velocity_limits"]:
            assert limit is not None
            assert limits["max_velocity"] == pytest.approx(limit.velocity, rel=1e-5)


def test_wheels_of_a_differential_base_have_a_controller(tmp_path: Path) -> None:
    from roboyard.importer.pipeline import import_robot

    made = import_robot(asset_path("husky"), name="base", out=tmp_path, validate=False, report=False)
    base = yaml.safe_load((made.folder / "moveit" / "ros2_controllers.yaml").read_text())
    settings = base["base_controller"]["ros__parameters"]
    wheels = made.robot.semantic.wheels
    assert settings["wheel_radius"] == pytest.approx(wheels[0].radius, rel=1e-5)
    sides = {wheel.centre[1] > 0 for wheel in wheels}
    assert sides == {True, False}
    left = {wheel.joint for wheel in wheels if wheel.centre[1] > 0}
    assert set(settings["left_wheel_names"]) == left
    assert 0.4 < settings["wheel_separation"] < 0.7


def test_the_tags_expand_by_xacro(written: Callable[[str], tuple[RobotModel, Path]]) -> None:
    robot, folder = written("arm7")
    file = next(folder.glob("*.xacro"))
    whole = folder / "whole.urdf.xacro"
    whole.write_text(
        '<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro">'
        f'<xacro:include filename="{file.name}"/>'
        f'<xacro:{file.name.partition(".")[0]}_ros2_control plugin="my_hardware/System"/></robot>'
    )
    root, _ = expand_xacro(whole, Resolver.of_file(whole))
    control = root.find("ros2_control")
    assert control is not None
    assert control.findtext("hardware/plugin") == "my_hardware/System"
    joints = {joint.get("name"): joint for joint in control.iter("joint")}
    driven = {name for name, kind in robot.drives.items() if kind != "none"}
    assert driven <= set(joints)
    for name in driven:
        joint = robot.description.joint_by_name[name]
        command = joints[name].find("command_interface")
        assert command is not None
        assert command.get("name") == robot.drives[name]
        limits = joint.position_limits()
        if robot.drives[name] == "position" and limits is not None:
            ends = {param.get("name"): float(param.text or "") for param in command}
            assert (ends["min"], ends["max"]) == limits


def test_pinocchio_reads_the_srdf(written: Callable[[str], tuple[RobotModel, Path]], tmp_path: Path) -> None:
    pinocchio = pytest.importorskip("pinocchio", reason="pinocchio is not a dependency")
    robot, folder = written("r1")
    made = urdf.write(robot, tmp_path / "urdf").files[0]
    srdf = str(next(folder.glob("*.srdf")))
    model = pinocchio.buildModelFromUrdf(str(made))
    pinocchio.loadReferenceConfigurations(model, srdf, False)
    assert {entry.key() for entry in model.referenceConfigurations} >= set(robot.semantic.postures)
    geometry = pinocchio.buildGeomFromUrdf(
        model, str(made), pinocchio.GeometryType.COLLISION, package_dirs=[str(made.parent)]
    )
    geometry.addAllCollisionPairs()
    before = len(geometry.collisionPairs)
    pinocchio.removeCollisionPairs(model, geometry, srdf, False)
    assert len(geometry.collisionPairs) < before
