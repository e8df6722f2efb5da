"""The SDF file, as Roboyard's reader and Drake understand it."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from roboyard.description import RobotDescription, load_description
from roboyard.description.model import LoopJoint, Pose
from roboyard.description.robot_model import RobotModel
from roboyard.export import sdf
from roboyard.export.sdf.model import CAMERA_AXES
from roboyard.kinematics.description_poses import forward_kinematics
from roboyard.transforms import matrix_from_quaternion

POSTURE = {"0": 0.3, "1": -0.4, "slide": 0.1, "spin": 2.0, "grip": 0.03}


def written(robot: RobotModel, folder: Path, **options: bool) -> RobotDescription:
    result = sdf.write(robot, folder / "model.sdf", **options)
    return load_description(result.files[0])


def poses(description: RobotDescription, root: str, posture: dict[str, float]) -> dict[str, np.ndarray]:
    found = forward_kinematics(description, posture)
    return {name: np.linalg.inv(found[root]) @ pose for name, pose in found.items()}


def test_links_joints_and_poses_are_read_back(robot: RobotModel, tmp_path: Path) -> None:
    back, own = written(robot, tmp_path, floating=True), robot.description
    expected, found = poses(own, "base", POSTURE), poses(back, "base", POSTURE)
    for link in own.links:
        np.testing.assert_allclose(found[link.name], expected[link.name], atol=1e-9, err_msg=link.name)
    for joint in own.joints:
        if joint.type not in ("revolute", "prismatic", "continuous"):
            continue
        other = back.joint_by_name[joint.name]
        assert (other.type, other.parent, other.child) == (joint.type, joint.parent, joint.child)
        assert other.axis == pytest.approx(joint.axis) and other.damping == joint.damping
        assert other.position_limits() == joint.position_limits()
        if joint.limit is not None and other.limit is not None:
            assert (other.limit.effort, other.limit.velocity) == (joint.limit.effort, joint.limit.velocity)
    mimic = back.joint_by_name["grip_follower"].mimic
    assert mimic is not None and (mimic.joint, mimic.multiplier, mimic.offset) == ("grip", 1.5, 0.01)


def test_masses_tensors_and_shapes_are_read_back(robot: RobotModel, tmp_path: Path) -> None:
    back = written(robot, tmp_path, floating=True)
    for link in robot.description.links:
        other = back.link_by_name[link.name]
        assert len(other.visuals) == len(link.visuals) and len(other.collisions) == len(link.collisions)
        if link.inertial is None or other.inertial is None:
            continue
        assert other.inertial.mass == link.inertial.mass
        assert other.inertial.origin.position == pytest.approx(link.inertial.origin.position)
        turn = matrix_from_quaternion(np.array(link.inertial.origin.quaternion))
        again = matrix_from_quaternion(np.array(other.inertial.origin.quaternion))
        np.testing.assert_allclose(
            again @ other.inertial.matrix() @ again.T, turn @ link.inertial.matrix() @ turn.T, atol=1e-9
        )
    base = back.link_by_name["base"]
    assert base.contact is not None
    assert (base.contact.lateral_friction, base.contact.restitution) == (0.7, 0.1)
    assert base.visuals[0].material is not None
    assert base.visuals[0].material.rgba == pytest.approx((0.8, 0.1, 0.1, 1.0))


def test_a_mounted_robot_is_fixed_to_the_world(robot: RobotModel, tmp_path: Path) -> None:
    mounted = replace(robot, semantic=replace(robot.semantic, base="fixed"))
    back = written(mounted, tmp_path)
    assert back.root.name == "world" and back.parent_joint["base"].type == "fixed"
    assert written(robot, tmp_path / "free").root.name == "base"


def test_a_loop_is_read_back(robot: RobotModel, tmp_path: Path) -> None:
    loop = LoopJoint(
        name="rod",
        type="revolute",
        first="arm 1",
        second="finger_a",
        first_origin=Pose(position=(0.1, 0.0, 0.2)),
        second_origin=Pose(position=(0.0, 0.0, 0.1)),
        axis=(0.0, 1.0, 0.0),
    )
    description = replace(robot.description, loops=(loop,))
    (found,) = written(replace(robot, description=description), tmp_path).loops
    assert (found.name, found.type, {found.first, found.second}) == ("rod", "revolute", {"arm 1", "finger_a"})
    ends = {found.first: found.first_origin, found.second: found.second_origin}
    assert ends["finger_a"].position == pytest.approx((0.0, 0.0, 0.1))


def test_a_camera_looks_along_x_in_gazebo(robot: RobotModel, tmp_path: Path) -> None:
    """Ours look along -z with y up, Gazebo's along x with z up."""
    assert np.linalg.det(CAMERA_AXES) == pytest.approx(1.0)
    np.testing.assert_array_equal(CAMERA_AXES[:, 0], [0, 0, -1])
    np.testing.assert_array_equal(CAMERA_AXES[:, 2], [0, 1, 0])
    sdf.write(robot, tmp_path / "model.sdf")
    root = ET.parse(tmp_path / "model.sdf").getroot()
    kinds = [sensor.get("type") for sensor in root.iter("sensor")]
    assert kinds.count("camera") == sum(sensor.kind == "camera" for sensor in robot.sensors)
    assert kinds.count("gpu_lidar") == sum(sensor.kind == "lidar" for sensor in robot.sensors)


def test_names_of_joints_and_links_differ_in_sdf(tmp_path: Path, robot: RobotModel) -> None:
    joints = tuple(replace(j, name="tool") if j.name == "1" else j for j in robot.description.joints)
    clash = replace(robot, description=replace(robot.description, joints=joints))
    result = sdf.write(clash, tmp_path / "model.sdf")
    assert any('joint "tool" is called "tool_joint"' in note for note in result.notes)
    assert "tool_joint" in load_description(result.files[0]).joint_by_name


def test_meshes_of_the_shared_folder_stay_where_they_are(
    bundled: Callable[[str], RobotModel], tmp_path: Path
) -> None:
    robot = bundled("husky")
    mesh = next(
        v.geometry for link in robot.description.links for v in link.visuals if hasattr(v.geometry, "path")
    )
    shared = mesh.path.parent.parent  # type: ignore[union-attr]
    sdf.write(robot, tmp_path / "sdf" / "model.sdf", shared=shared)
    uris = [uri.text or "" for uri in ET.parse(tmp_path / "sdf" / "model.sdf").getroot().iter("uri")]
    assert uris and all((tmp_path / "sdf" / uri).resolve().is_relative_to(shared.resolve()) for uri in uris)
    result = sdf.write(robot, tmp_path / "copied" / "model.sdf")
    assert all(file.is_relative_to(tmp_path) for file in result.files) and len(result.files) > 2
    assert load_description(result.files[0]).link_by_name.keys() == robot.description.link_by_name.keys()


def test_drake_reads_the_same_robot(robot: RobotModel, tmp_path: Path) -> None:
    plants = pytest.importorskip("pydrake.multibody.plant", reason="Drake is not a dependency")
    parsing = pytest.importorskip("pydrake.multibody.parsing")
    sdf.write(robot, tmp_path / "model.sdf", floating=True)
    plant = plants.MultibodyPlant(0.001)
    parsing.Parser(plant).AddModels(str(tmp_path / "model.sdf"))
    plant.Finalize()
    context = plant.CreateDefaultContext()
    positions = plant.GetPositions(context)
    for name, value in {**POSTURE, "grip_follower": 1.5 * POSTURE["grip"] + 0.01}.items():
        positions[plant.GetJointByName(name).position_start()] = value
    plant.SetPositions(context, positions)
    expected = poses(robot.description, "base", POSTURE)
    base = plant.EvalBodyPoseInWorld(context, plant.GetBodyByName("base"))
    total = 0.0
    for link in robot.description.links:
        if not plant.HasBodyNamed(link.name):
            continue
        body = plant.GetBodyByName(link.name)
        found = (base.inverse() @ plant.EvalBodyPoseInWorld(context, body)).GetAsMatrix4()
        np.testing.assert_allclose(found, expected[link.name], atol=1e-9, err_msg=link.name)
        if link.inertial is not None:
            total += 1
            assert body.default_mass() == pytest.approx(link.inertial.mass)
    assert total == 8
