"""Reading a sound URDF: every field, as written."""

import math
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from roboyard.description import (
    Box,
    Capsule,
    Contact,
    Cylinder,
    Inertial,
    Limit,
    Mesh,
    Mimic,
    Plane,
    RobotDescription,
    Sphere,
    load_description,
)
from roboyard.errors import DescriptionError

DATA = Path(__file__).parents[1] / "data"
ARM = DATA / "urdf" / "arm.urdf"


@pytest.fixture(scope="module")
def arm() -> RobotDescription:
    return load_description(ARM)


def test_links_and_joints_keep_file_order_and_any_name(arm):
    assert arm.name == "arm"
    assert [link.name for link in arm.links] == ["base", "upper", "fore arm", "手", "0", "ball", "raft"]
    assert [joint.name for joint in arm.joints] == ["shoulder", "elbow", "slide", "weld", "socket", "drift"]
    assert arm.root.name == "base"
    assert [joint.name for joint in arm.child_joints["upper"]] == ["elbow", "weld"]
    assert [joint.name for joint in arm.depth_first_joints] == [
        "shoulder",
        "elbow",
        "slide",
        "weld",
        "socket",
        "drift",
    ]
    assert arm.notes == ()


def test_elements_remember_file_and_line(arm):
    lines = ARM.read_text(encoding="utf-8").splitlines()
    for element in (*arm.links, *arm.joints):
        assert element.source.file == ARM
        assert f'name="{element.name}"' in lines[element.source.line - 1]
    assert "<visual name" in lines[arm.links[0].visuals[0].source.line - 1]
    assert "<inertial>" in lines[arm.links[0].inertial.source.line - 1]


def test_inertial(arm):
    inertial = arm.links[0].inertial
    assert inertial.mass == 4.5
    assert inertial.inertia == (0.05, 0.001, -0.002, 0.06, 0.003, 0.04)
    assert inertial.origin.position == (0, 0, 0.1)
    assert inertial.origin.rpy == (0.1, 0.2, 0.3)
    expected = Rotation.from_euler("xyz", [0.1, 0.2, 0.3]).as_quat()
    np.testing.assert_allclose(inertial.origin.quaternion, expected, atol=1e-15)
    assert arm.links[1].inertial is None


def test_joint_fields(arm):
    shoulder, elbow, slide, weld, socket, drift = arm.joints
    assert (shoulder.type, shoulder.parent, shoulder.child) == ("revolute", "base", "upper")
    assert shoulder.axis == (0, 1, 0)
    assert shoulder.limit == Limit(lower=-1.5, upper=2, effort=50, velocity=3)
    assert (shoulder.damping, shoulder.friction) == (0.2, 0.1)
    assert shoulder.position_limits() == (-1.5, 2)
    assert elbow.limit is None
    assert elbow.position_limits() is None
    assert elbow.axis == (0.36, 0.48, 0.8)
    assert slide.mimic == Mimic(joint="elbow", multiplier=0.05, offset=0.01)
    assert not weld.is_moving
    assert (socket.type, drift.type) == ("spherical", "planar")


def test_shapes(arm):
    base, upper = arm.links[:2]
    shell, box = base.visuals
    mesh = DATA / "meshes" / "cube.obj"
    assert shell.name == "shell"
    assert isinstance(shell.geometry, Mesh)
    assert shell.geometry.uri == "../meshes/cube.obj"
    assert shell.geometry.path.samefile(mesh)
    assert shell.geometry.scale == (0.1, -0.1, 0.2)
    assert box.geometry == Box(size=(0.1, 0.2, 0.3))
    assert base.collisions[0].geometry == Cylinder(radius=0.1, length=0.2)
    assert [collision.concave for collision in base.collisions] == [False, True]
    assert upper.visuals[0].geometry == Sphere(radius=0.05)
    assert upper.collisions[0].geometry == Capsule(radius=0.04, length=0.3)
    assert arm.link_by_name["0"].collisions[0].geometry == Plane(normal=(0, 0, 1))
    assert base.contact == Contact(lateral_friction=0.8, restitution=0.1, inertia_scaling=3.0)


def test_materials_are_global_or_defined_at_first_use(arm):
    shell, box = arm.links[0].visuals
    assert shell.material.rgba == (0.5, 0.55, 0.6, 1)
    assert box.material.rgba == (1, 0, 0, 0.5)
    assert arm.links[1].visuals[0].material == box.material
    assert [material.name for material in arm.materials] == ["steel"]


def test_what_is_not_read_is_kept(arm):
    assert [element.tag for element in arm.extra] == ["transmission"]
    assert arm.attributes == (("version", "1.0"),)
    assert arm.links[1].attributes == (("type", "arm"),)
    assert dict(arm.links[0].collisions[0].attributes) == {"group": "1", "mask": "2"}
    shoulder = {element.tag: element.attrib for element in arm.joints[0].extra}
    assert shoulder == {
        "safety_controller": {"k_velocity": "10", "soft_lower_limit": "-1"},
        "limit": {"current": "7"},
        "dynamics": {"spring_stiffness": "4"},
    }
    assert [element.tag for element in arm.links[0].extra] == ["self_collision_checking", "contact"]


def test_absent_numbers_are_none_never_zero():
    robot = load_description(
        '<robot name="r"><link name="a"/><link name="b"/><joint name="j" type="revolute">'
        '<parent link="a"/><child link="b"/><limit effort="3"/></joint></robot>'
    )
    assert robot.joints[0].limit == Limit(effort=3)
    assert robot.joints[0].axis == (1, 0, 0)
    assert robot.joints[0].position_limits() is None


@pytest.mark.parametrize("mass", ["-2", "0", "1e30"])
def test_absurd_masses_and_tensors_are_kept_as_written(mass):
    robot = load_description(
        f'<robot name="r"><link name="a"><inertial><mass value="{mass}"/>'
        '<inertia ixx="-1" ixy="9" ixz="0" iyy="0" iyz="0" izz="1e-30"/></inertial></link></robot>'
    )
    assert robot.links[0].inertial == Inertial(
        mass=float(mass), inertia=(-1, 9, 0, 0, 0, 1e-30), source=robot.links[0].inertial.source
    )


def test_limits_far_out_and_reversed_are_kept():
    robot = load_description(
        '<robot name="r"><link name="a"/><link name="b"/><joint name="j" type="revolute">'
        '<parent link="a"/><child link="b"/><limit lower="1e16" upper="-1e16"/></joint></robot>'
    )
    assert (robot.joints[0].limit.lower, robot.joints[0].limit.upper) == (1e16, -1e16)
    assert robot.joints[0].position_limits() is None


def test_reads_path_string_text_tree_and_element():
    text = ARM.read_text(encoding="utf-8")
    folder = [DATA / "urdf"]
    trees = [
        load_description(ARM),
        load_description(str(ARM)),
        load_description(text, search_paths=[*folder, DATA]),
        load_description(ET.parse(ARM), search_paths=[*folder, DATA]),
        load_description(ET.parse(ARM).getroot(), search_paths=[*folder, DATA]),
    ]
    for tree in trees:
        assert [joint.axis for joint in tree.joints] == [joint.axis for joint in trees[0].joints]
        assert tree.links[0].visuals[0].geometry.path.samefile(DATA / "meshes" / "cube.obj")
    assert trees[2].source.file is None


def test_quaternion_origin():
    robot = load_description(
        '<robot name="r"><link name="a"/><link name="b"/><joint name="j" type="fixed">'
        '<origin xyz="1 2 3" quat_xyzw="0 0 2 2"/><parent link="a"/><child link="b"/></joint></robot>'
    )
    half = math.sqrt(0.5)
    np.testing.assert_allclose(robot.joints[0].origin.quaternion, (0, 0, half, half), atol=1e-15)


def test_missing_meshes_can_be_noted():
    file = DATA / "urdf" / "errors" / "missing_mesh.urdf"
    robot = load_description(file, missing_meshes="note")
    assert robot.links[0].visuals[0].geometry == Mesh(uri="meshes/gone.stl", path=None)
    assert len(robot.notes) == 1
    assert "missing_mesh.urdf:5" in robot.notes[0]
    assert "gone.stl" in robot.notes[0]


def test_all_problems_are_reported_at_once():
    text = (
        '<robot name="r">\n<link name="a"/>\n<link name="a"/>\n<link name="b"/>\n'
        '<joint name="j" type="hinge">\n<parent link="a"/>\n<child link="b"/>\n<axis xyz="x 0 0"/>\n'
        '<limit lower="nan"/>\n</joint>\n</robot>'
    )
    with pytest.raises(DescriptionError) as caught:
        load_description(text)
    assert len(caught.value.problems) == 2
    assert "unknown joint type 'hinge'" in caught.value.problems[0]
    assert "'nan' is not finite" in caught.value.problems[1]
    assert caught.value.line == 5
    assert caught.value.element == 'joint "j"'


MOUNT = '<joint name="mount" type="fixed"><parent link="world"/><child link="base"/></joint>'


def test_a_joint_to_the_undeclared_world_mounts_the_robot_in_it():
    robot = load_description(f'<robot name="arm"><link name="base"/>{MOUNT}</robot>')
    declared = load_description(f'<robot name="arm"><link name="base"/><link name="world"/>{MOUNT}</robot>')
    assert [link.name for link in robot.links] == [link.name for link in declared.links]
    assert robot.joints == declared.joints
    assert [note for note in robot.notes if 'joint "mount"' in str(note)]
    assert not [note for note in declared.notes if 'joint "mount"' in str(note)]


def test_only_a_parent_is_the_undeclared_world():
    with pytest.raises(DescriptionError, match="no link named 'world'"):
        load_description(
            '<robot name="arm"><link name="base"/>'
            '<joint name="mount" type="fixed"><parent link="base"/><child link="world"/></joint></robot>'
        )


def test_a_long_chain_neither_recurses_nor_crawls():
    count = 20_000
    links = "".join(f'<link name="l{i}"/>' for i in range(count))
    joints = "".join(
        f'<joint name="j{i}" type="fixed"><parent link="l{i}"/><child link="l{i + 1}"/></joint>'
        for i in range(count - 1)
    )
    robot = load_description(f'<robot name="chain">{links}{joints}</robot>')
    assert len(robot.depth_first_joints) == count - 1
    assert robot.depth_first_joints[-1].child == f"l{count - 1}"
