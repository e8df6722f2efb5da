"""The report's picture of parts: colours by the nearest part above a link, and a floor under the robot."""

from __future__ import annotations

import numpy as np
import pytest

from roboyard.description.loader import load_description
from roboyard.description.robot_model import RobotModel
from roboyard.description.semantic import REST, Arm, EndEffector, Gripper, MountedSensor, SemanticDescription
from roboyard.importer.report.parts import parts_section, rest_frames, view_of_parts
from roboyard.morphology.part_colours import ARMS, BODY, GRIPPER, colours_of_links


@pytest.fixture
def robot() -> RobotModel:
    """Return a base with an arm of two links, a camera fixed to the second, and a finger."""
    text = '<robot name="r">'
    for name in ("base", "upper", "lower", "camera", "finger", "flap"):
        text += f'<link name="{name}"><visual><geometry><box size="0.1 0.1 0.4"/></geometry></visual></link>'
    for name, kind, parent, child in (
        ("shoulder", "revolute", "base", "upper"),
        ("elbow", "revolute", "upper", "lower"),
        ("mount", "fixed", "lower", "camera"),
        ("grip", "revolute", "lower", "finger"),
        ("hinge", "revolute", "base", "flap"),
    ):
        text += (
            f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
            '<origin xyz="0 0 0.4"/><axis xyz="0 1 0"/><limit lower="-2" upper="2" effort="1" velocity="1"/>'
            "</joint>"
        )
    gripper = Gripper(kind="single_jaw", palm="lower", joints=("grip",), links=("finger",))
    effector = EndEffector(link="lower", gripper_links=("finger",), gripper=gripper)
    return RobotModel(
        name="r",
        description=load_description(text + "</robot>"),
        semantic=SemanticDescription(
            base_link="base",
            arms=(Arm(name="0", joints=("shoulder", "elbow"), end_effector=effector),),
            grippers=(gripper,),
            sensors=(MountedSensor(kind="camera", name="eye<", link="camera"),),
            postures={REST: {"shoulder": np.pi / 2, "elbow": 0.0}},
        ),
    )


def test_links_have_the_colour_of_the_nearest_part_above(robot: RobotModel) -> None:
    expected = {"base": BODY, "upper": ARMS[0], "lower": ARMS[0], "camera": ARMS[0]}
    assert colours_of_links(robot.description, robot.semantic) == {
        **expected,
        "finger": GRIPPER,
        "flap": BODY,
    }


def test_the_floor_is_under_the_lowest_point_of_the_rest_posture(robot: RobotModel) -> None:
    """At rest the arm is along x at 0.4 m; the base's box reaches 0.2 m below its frame."""
    frames = rest_frames(robot)
    np.testing.assert_allclose(frames["lower"][:3, 3], [0.4, 0.0, 0.4], atol=1e-9)
    bare, standing = (view_of_parts(robot, frames, floor=floor) for floor in (False, True))
    assert bare.points()[:, 2].min() == pytest.approx(-0.2)
    assert set(standing.bounds) - set(bare.bounds) == {"floor"}
    assert standing.bounds["floor"][1, 2] == pytest.approx(-0.2)
    assert "sensor 0" in bare.bounds


def test_the_section_has_two_pictures_and_a_legend_with_escaped_names(robot: RobotModel) -> None:
    text = "".join(parts_section(robot))
    assert text.count("<img") == 2
    for words in (
        "as it will stand",
        "zero pose",
        "<b>arm 0</b>",
        "<b>gripper 0</b>",
        "eye&lt;",
        "on camera",
    ):
        assert words in text
    assert "eye<" not in text
