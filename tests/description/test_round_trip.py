"""Writing against other readers: the standard library's XML, MuJoCo's URDF reader, and Roboyard's own."""

import dataclasses
import xml.etree.ElementTree as ET
from pathlib import Path

import mujoco
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from roboyard.description import load_description, write_urdf
from roboyard.description.model import (
    Box,
    Capsule,
    Collision,
    Contact,
    Cylinder,
    Inertial,
    Joint,
    Limit,
    Link,
    Material,
    Mesh,
    Mimic,
    Plane,
    Pose,
    RobotDescription,
    Sphere,
    Visual,
)
from roboyard.description.urdf.write import mimic_element, to_element
from roboyard.errors import DescriptionError


def of_link(link: Link, **robot) -> RobotDescription:
    return RobotDescription(name="r", links=(link,), **robot)


def written_link(link: Link) -> ET.Element:
    found = to_element(of_link(link)).find("link")
    assert found is not None
    return found


def random_pose(rng: np.random.Generator) -> Pose:
    quaternion = Rotation.random(random_state=rng).as_quat()
    return Pose(position=tuple(rng.normal(size=3).tolist()), quaternion=tuple(quaternion.tolist()))


def random_robot(seed: int, count: int = 8) -> RobotDescription:
    """A random tree of links with masses and boxes on joints of all kinds that MuJoCo's reader has."""
    rng = np.random.default_rng(seed)
    links, joints = [Link(name="l0")], []
    for i in range(1, count):
        size = rng.uniform(0.1, 0.5, 3)
        mass = float(rng.uniform(0.5, 3))
        moments = mass / 12 * (np.sum(size**2) - size**2)
        turn = Rotation.random(random_state=rng).as_matrix()
        tensor = turn @ np.diag(moments) @ turn.T
        inertial = Inertial(
            mass=mass,
            origin=random_pose(rng),
            inertia=tuple(tensor[np.triu_indices(3)].tolist()),
        )
        shape = Collision(geometry=Box(size=tuple(size.tolist())), origin=random_pose(rng))
        links.append(Link(name=f"l{i}", inertial=inertial, collisions=(shape,)))
        kind = ("revolute", "prismatic", "continuous", "fixed")[i % 4]
        axis = rng.normal(size=3)
        limit = Limit(lower=-float(rng.uniform(0.1, 2)), upper=float(rng.uniform(0.1, 2)), effort=9.0)
        joints.append(
            Joint(
                name=f"j{i}",
                type=kind,
                parent=f"l{rng.integers(i)}",
                child=f"l{i}",
                origin=random_pose(rng),
                axis=tuple((axis / np.linalg.norm(axis)).tolist()) if kind != "fixed" else (1.0, 0.0, 0.0),
                limit=limit if kind in ("revolute", "prismatic") else None,
                damping=float(rng.uniform(0, 1)),
                friction=float(rng.uniform(0, 1)),
            )
        )
    return RobotDescription(name="random", links=tuple(links), joints=tuple(joints))


@pytest.mark.parametrize("seed", range(4))
def test_mujoco_reads_a_written_robot_as_the_description_says(seed: int, tmp_path: Path) -> None:
    robot = random_robot(seed)
    options = ET.Element("mujoco")
    ET.SubElement(options, "compiler", fusestatic="false")
    write_urdf(dataclasses.replace(robot, extra=(options,)), tmp_path / "r.urdf")
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "r.urdf"))
    for link in robot.links[1:]:
        body, inertial = model.body(link.name), link.inertial
        assert inertial is not None
        assert body.mass[0] == pytest.approx(inertial.mass, rel=1e-9)
        np.testing.assert_allclose(body.ipos, inertial.origin.position, atol=1e-9)
        turn = Rotation.from_quat(body.iquat, scalar_first=True).as_matrix()
        own = Rotation.from_quat(inertial.origin.quaternion).as_matrix()
        np.testing.assert_allclose(
            turn @ np.diag(body.inertia) @ turn.T, own @ inertial.matrix() @ own.T, atol=1e-7
        )
    for joint in robot.joints:
        body = model.body(joint.child)
        np.testing.assert_allclose(body.pos, joint.origin.position, atol=1e-9)
        assert abs(body.quat @ np.roll(joint.origin.quaternion, 1)) == pytest.approx(1, abs=1e-9)
        if joint.type == "fixed":
            assert body.jntnum[0] == 0
            continue
        read = model.joint(joint.name)
        np.testing.assert_allclose(read.axis, joint.axis, atol=1e-9)
        assert read.damping[0] == pytest.approx(joint.damping)
        assert read.frictionloss[0] == pytest.approx(joint.friction)
        if joint.limit is not None:
            assert read.range == pytest.approx(joint.position_limits())


@pytest.mark.parametrize("seed", range(4, 8))
def test_writing_what_was_read_from_a_written_file_gives_the_same_bytes(seed: int, tmp_path: Path) -> None:
    robot = random_robot(seed)
    write_urdf(robot, tmp_path / "1.urdf")
    write_urdf(load_description(tmp_path / "1.urdf"), tmp_path / "2.urdf")
    write_urdf(load_description(tmp_path / "2.urdf"), tmp_path / "3.urdf")
    assert (tmp_path / "3.urdf").read_bytes() == (tmp_path / "2.urdf").read_bytes()
    once, twice = (load_description(tmp_path / f"{i}.urdf") for i in (1, 2))
    for a, b in zip(once.joints, twice.joints, strict=True):
        assert (a.origin, a.limit, a.damping) == (b.origin, b.limit, b.damping)
        np.testing.assert_allclose(a.axis, b.axis, atol=3e-16)


@pytest.mark.parametrize(
    ("geometry", "tag", "attributes"),
    [
        (Box(size=(1, 2.5, 3)), "box", {"size": "1 2.5 3"}),
        (Sphere(radius=0.1), "sphere", {"radius": "0.1"}),
        (Cylinder(radius=1, length=1e-7), "cylinder", {"radius": "1", "length": "1e-07"}),
        (Capsule(radius=0.3, length=0), "capsule", {"radius": "0.3", "length": "0"}),
        (Plane(normal=(0, -1, 0)), "plane", {"normal": "0 -1 0"}),
        (Mesh(uri="a b.stl", path=None), "mesh", {"filename": "a b.stl"}),
        (Mesh(uri="m", path=None, scale=(1, -1, 2)), "mesh", {"filename": "m", "scale": "1 -1 2"}),
    ],
)
@pytest.mark.parametrize("kind", [Visual, Collision])
def test_each_geometry_is_written_as_its_element(
    kind, geometry, tag: str, attributes: dict[str, str]
) -> None:
    shape = kind(geometry=geometry, name="n")
    link = Link(name="a", visuals=(shape,)) if kind is Visual else Link(name="a", collisions=(shape,))
    element = written_link(link).find(f"{kind.__name__.lower()}[@name='n']/geometry/{tag}")
    assert element is not None
    assert element.attrib == attributes
    if tag != "mesh":
        read = load_description(to_element(of_link(link))).links[0]
        assert (*read.visuals, *read.collisions)[0].geometry == geometry


def test_contact_parameters_that_are_not_given_are_not_written() -> None:
    element = written_link(Link(name="a", contact=Contact(lateral_friction=0.0, damping=2.5))).find("contact")
    assert element is not None
    assert [(child.tag, child.get("value")) for child in element] == [
        ("lateral_friction", "0"),
        ("damping", "2.5"),
    ]


@pytest.mark.parametrize("key", ["lower", "upper", "effort", "velocity"])
def test_a_limit_of_zero_is_written_and_one_not_given_is_not(key: str) -> None:
    joint = Joint(name="j", type="revolute", parent="a", child="b", limit=Limit(**{key: 0.0}))
    robot = RobotDescription(name="r", links=(Link(name="a"), Link(name="b")), joints=(joint,))
    limit = to_element(robot).find("joint/limit")
    assert limit is not None
    assert limit.attrib == {key: "0"}


def test_an_identity_origin_is_not_written_and_a_turned_one_is() -> None:
    shapes = tuple(
        Visual(geometry=Sphere(radius=1), origin=pose)
        for pose in (Pose(), Pose(quaternion=(0, 0, 1, 0)), Pose(position=(0, 0, 1)), Pose(rpy=(0, 0, 0)))
    )
    origins = [visual.find("origin") for visual in written_link(Link(name="a", visuals=shapes))]
    assert origins[0] is None
    assert [None if origin is None else sorted(origin.attrib) for origin in origins[1:]] == [
        ["rpy", "xyz"],
        ["xyz"],
        ["rpy", "xyz"],
    ]
    angles = np.array(origins[1].get("rpy").split(), dtype=float)  # type: ignore[union-attr]
    np.testing.assert_allclose(np.abs(angles), (0, 0, np.pi), atol=1e-12)


@pytest.mark.parametrize("pitch", [np.pi / 2, -np.pi / 2, np.pi / 2 - 1e-9, 1e-5 - np.pi / 2, 1.56])
def test_rotations_at_the_gimbal_lock_come_back(pitch: float, tmp_path: Path) -> None:
    turn = Rotation.from_euler("xyz", [0.7, pitch, -1.1])
    pose = Pose(quaternion=tuple(turn.as_quat().tolist()))
    write_urdf(
        of_link(Link(name="a", visuals=(Visual(geometry=Sphere(radius=1), origin=pose),))), tmp_path / "r"
    )
    again = load_description(tmp_path / "r").links[0].visuals[0].origin
    assert (Rotation.from_quat(again.quaternion) * turn.inv()).magnitude() < 1e-12


def test_a_material_is_written_with_what_it_has() -> None:
    specular = ET.Element("specular", {"rgba": "1 1 1 1"})
    materials = (
        Material(name="red", rgba=(1, 0, 0, 0.5)),
        Material(texture_uri="wood.png", extra=(specular,)),
    )
    red, wood = to_element(of_link(Link(name="a"), materials=materials)).findall("material")
    assert red.attrib == {"name": "red"}
    assert [(child.tag, child.attrib) for child in red] == [("color", {"rgba": "1 0 0 0.5"})]
    assert wood.attrib == {}
    assert [child.tag for child in wood] == ["texture", "specular"]


def test_unread_parts_go_back_into_their_elements_and_contradictions_beside_them() -> None:
    text = (
        '<robot name="r"><link name="a"/><link name="b"/><joint name="j" type="revolute" speed="fast">'
        '<parent link="a" frame="x"/><child link="b"/><limit effort="1" current="3"><motor/></limit>'
        '<limit effort="2"/><axis xyz="0 0 1" note="up"/><calibration rising="0.1"/></joint></robot>'
    )
    joint = to_element(load_description(text)).find("joint")
    assert joint is not None
    assert joint.get("speed") == "fast"
    assert joint.find("parent").attrib == {"link": "a", "frame": "x"}  # type: ignore[union-attr]
    assert joint.find("axis").attrib == {"xyz": "0 0 1", "note": "up"}  # type: ignore[union-attr]
    first, second = joint.findall("limit")
    assert first.attrib == {"effort": "1", "current": "3"}
    assert [child.tag for child in first] == ["motor"]
    assert second.attrib == {"effort": "2"}
    assert joint.find("calibration") is not None


def test_unknown_elements_keep_text_and_children(tmp_path: Path) -> None:
    text = (
        '<robot name="r"><link name="a"><sensor type="imu"><rate>100 &amp; more</rate></sensor></link>'
        '<gazebo reference="a"><mu1>0.3</mu1><plugin name="p"><p><q>1</q></p></plugin></gazebo></robot>'
    )
    write_urdf(load_description(text), tmp_path / "r.urdf")
    root = ET.parse(tmp_path / "r.urdf").getroot()
    assert root.findtext("link/sensor/rate") == "100 & more"
    assert root.findtext("gazebo/mu1") == "0.3"
    assert root.findtext("gazebo/plugin/p/q") == "1"


@pytest.mark.parametrize("mimic", [Mimic(joint="k"), Mimic(joint="k", multiplier=-0.1, offset=1 / 3)])
def test_a_mimic_comes_back_exactly(mimic: Mimic) -> None:
    element = mimic_element(mimic)
    read = Mimic(
        joint=element.get("joint", ""),
        multiplier=float(element.get("multiplier", "nan")),
        offset=float(element.get("offset", "nan")),
    )
    assert read == mimic


@pytest.mark.parametrize("value", [0.1, 1e-300, 1e300, 1 / 3, 123456789.123456789, 5e-324, -0.0, 2.0**53])
def test_any_number_comes_back_bit_for_bit(value: float) -> None:
    inertial = Inertial(mass=value, inertia=(value, 0, 0, value, 0, value))
    read = load_description(to_element(of_link(Link(name="a", inertial=inertial)))).links[0].inertial
    assert read is not None
    assert np.float64(read.mass).tobytes() == np.float64(value).tobytes() or value == 0
    assert read.inertia[0] == value


def test_a_mesh_without_a_name_is_refused_with_the_remedy() -> None:
    link = Link(name="a", visuals=(Visual(geometry=Mesh(uri="", path=None)),))
    with pytest.raises(DescriptionError, match=r"made in memory has no file name.*save it and set Mesh\.uri"):
        to_element(of_link(link))


def test_a_failed_write_leaves_the_file_of_before(tmp_path: Path) -> None:
    file = tmp_path / "r.urdf"
    write_urdf(of_link(Link(name="a")), file)
    before = file.read_bytes()
    with pytest.raises(DescriptionError):
        write_urdf(of_link(Link(name="a", visuals=(Visual(geometry=Mesh(uri="", path=None)),))), file)
    assert file.read_bytes() == before
