"""Writing loses nothing."""

import dataclasses
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import pytest

from roboyard.description import (
    Heightfield,
    Joint,
    Link,
    Pose,
    RobotDescription,
    Visual,
    load_description,
    write_urdf,
)
from roboyard.description.urdf.write import to_element
from roboyard.errors import DescriptionError

DATA = Path(__file__).parents[1] / "data" / "urdf"


def plain(value):
    """The data of a description without where it was read, XML by value. Axes are written as unit vectors."""
    if isinstance(value, ET.Element):
        text = (value.text or "").strip()
        return (value.tag, sorted(value.attrib.items()), text, [plain(child) for child in value])
    if dataclasses.is_dataclass(value):
        skipped = ("source", "notes", "axis_length")
        fields = (field.name for field in dataclasses.fields(value) if field.name not in skipped)
        return {name: plain(getattr(value, name)) for name in fields}
    if isinstance(value, tuple):
        return [plain(item) for item in value]
    return value


REPAIRED = sorted((DATA / "repairs").glob("*.urdf"))


@pytest.mark.parametrize("file", [DATA / "arm.urdf", *REPAIRED], ids=lambda file: file.stem)
def test_round_trip_gives_equal_data(file, tmp_path):
    first = load_description(file)
    write_urdf(first, tmp_path / "out.urdf")
    second = load_description(tmp_path / "out.urdf", search_paths=[file.parent, DATA.parent])
    assert plain(second) == plain(first)


def bag(root: ET.Element) -> list:
    def value(text):
        try:
            return tuple(float(token) for token in text.split())
        except ValueError:
            return text

    rows = [
        (element.tag, key, value(text))
        for element in root.iter()
        for key, text in [*element.attrib.items(), ("", (element.text or "").strip())]
    ]
    return sorted(rows, key=repr)


def test_everything_in_the_file_is_in_the_output():
    file = DATA / "arm.urdf"
    written = bag(to_element(load_description(file)))
    for row in bag(ET.parse(file).getroot()):
        assert row in written


def test_numbers_read_back_exactly(tmp_path):
    rng = np.random.default_rng(1)
    axis = rng.normal(size=3)
    axis /= np.linalg.norm(axis)
    joint = Joint(
        name="j",
        type="revolute",
        parent="a",
        child="b",
        axis=tuple(axis.tolist()),
        origin=Pose(position=tuple(rng.normal(size=3).tolist())),
    )
    robot = RobotDescription(name="r", links=(Link(name="a"), Link(name="b")), joints=(joint,))
    write_urdf(robot, tmp_path / "r.urdf")
    again = load_description(tmp_path / "r.urdf").joints[0]
    assert again.origin.position == joint.origin.position
    np.testing.assert_allclose(again.axis, joint.axis, rtol=0, atol=2e-16)


def test_a_changed_rotation_wins_over_the_angles_of_the_file():
    half = np.sqrt(0.5)
    pose = Pose(quaternion=(half, 0.0, 0.0, half), rpy=(0.0, 0.0, 1.0))
    robot = RobotDescription(
        name="r",
        links=(Link(name="a"), Link(name="b")),
        joints=(Joint(name="j", type="fixed", parent="a", child="b", origin=pose),),
    )
    origin = load_description(to_element(robot)).joints[0].origin
    np.testing.assert_allclose(origin.quaternion, pose.quaternion, atol=1e-15)


def test_names_are_escaped(tmp_path):
    robot = RobotDescription(name='a "b" & <c>', links=(Link(name="nuts & bolts\u00e9"),))
    write_urdf(robot, tmp_path / "r.urdf")
    again = load_description(tmp_path / "r.urdf")
    assert again.name == robot.name
    assert again.links[0].name == robot.links[0].name


def test_extra_elements_of_the_description_are_not_shared():
    robot = load_description(DATA / "arm.urdf")
    element = to_element(robot)
    element.find("transmission").set("name", "changed")
    assert robot.extra[0].get("name") == "drive"


def test_terrain_is_refused():
    terrain = Heightfield(heights=np.zeros((2, 2)), cell=(1.0, 1.0))
    robot = RobotDescription(name="r", links=(Link(name="a", visuals=(Visual(geometry=terrain),)),))
    with pytest.raises(DescriptionError, match="no heightfields"):
        to_element(robot)
