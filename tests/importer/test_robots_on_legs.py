"""Imports of robots on legs: their weight over the middle of their feet, whichever axis their file has up."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
import pytest

from roboyard.description import RobotDescription, load_description
from roboyard.description.semantic import Leg
from roboyard.importer.build import build_package
from roboyard.importer.planning.centred_legs import centred_legs
from roboyard.importer.planning.standing_posture import standing_posture
from roboyard.importer.planning.support_margin import keeps_standing
from roboyard.kinematics.description_poses import forward_kinematics
from roboyard.morphology.analyze import infer_semantics
from roboyard.morphology.point_model import PointModel
from roboyard.morphology.support_mode import decide
from roboyard.morphology.upright import turn_to_upright, turned
from roboyard.robots import add_robot
from roboyard.sim import World
from roboyard.transforms import matrix_from_quaternion

LINK = """<link name="{name}"><inertial><origin xyz="{com}"/><mass value="{mass}"/>
<inertia ixx="0.05" iyy="0.05" izz="0.05" ixy="0" ixz="0" iyz="0"/></inertial>
<collision><origin xyz="{at}"/><geometry><box size="{size}"/></geometry></collision></link>"""
JOINT = """<joint name="{child}_joint" type="{kind}"><parent link="{parent}"/><child link="{child}"/>
<origin xyz="{xyz}"/><axis xyz="{axis}"/>{limit}</joint>"""
LIMIT = '<limit lower="-1.2" upper="1.2" effort="100" velocity="9"/>'


def link(name: str, size: str, at: str = "0 0 0", com: str = "0 0 0", mass: float = 1.0) -> str:
    return LINK.format(name=name, size=size, at=at, com=com, mass=mass)


def joint(child: str, parent: str, xyz: str, axis: str = "0 1 0", kind: str = "revolute") -> str:
    limit = LIMIT if kind == "revolute" else ""
    return JOINT.format(child=child, parent=parent, xyz=xyz, axis=axis, kind=kind, limit=limit)


def biped(ankle: str = "0 1 0", offset: float = -0.05, pitch: float = 0.0) -> RobotDescription:
    """A body whose centre of mass is at x = `offset`, on two legs of 0.5 m with feet of 0.2 m by 0.1 m."""
    parts = [link("body", "0.2 0.3 0.3", com=f"{offset} 0 0", mass=20.0)]
    for side, y in (("l", 0.1), ("r", -0.1)):
        parts += [
            link(f"{side}_leg", "0.06 0.06 0.4", "0 0 -0.25", "0 0 -0.25"),
            link(f"{side}_foot", "0.2 0.1 0.04", "0 0 -0.03", "0 0 -0.03", 0.5),
            joint(f"{side}_leg", "body", f"0 {y} -0.15"),
            joint(f"{side}_foot", f"{side}_leg", f'0 0 -0.5" rpy="0 {pitch} 0', ankle),
        ]
    return load_description(f'<robot name="biped">{"".join(parts)}</robot>')


LEGS = [Leg(name=s, joints=(f"{s}_leg_joint", f"{s}_foot_joint"), foot=f"{s}_foot") for s in "lr"]
REST = {name: 0.0 for leg in LEGS for name in leg.joints}
FORWARD = (1.0, 0.0, 0.0)


def margin(description: RobotDescription, posture: dict[str, float]) -> float:
    figure = PointModel(description)
    figure.home |= posture
    return decide(figure).margin


@pytest.mark.parametrize("ankle", ["0 1 0", "0 -1 0"])
def test_a_lean_of_both_legs_centres_the_weight_and_keeps_feet_level(ankle: str) -> None:
    """The body has 20 of 23 kg: at -0.09 m, the whole is at -0.078 m, of feet that reach to -0.1 m."""
    description = biped(ankle, offset=-0.09)
    assert margin(description, REST) == pytest.approx(0.1 - 0.09 * 20 / 23, abs=2e-3)
    found = centred_legs(description, LEGS, REST, FORWARD)
    assert set(found) == set(REST)
    assert margin(description, found) > 0.05
    assert centred_legs(description, LEGS, found, FORWARD) == {}, (
        "enough: ankles carry what is not above them"
    )
    poses = forward_kinematics(description, found)
    for leg in LEGS:
        assert np.abs(poses[leg.foot][2, :2]).max() < 1e-9
    assert found["l_leg_joint"] == pytest.approx(found["r_leg_joint"])
    assert 0.03 < found["l_leg_joint"] < 0.15, "the feet go back, so that the body is forwards of them"


def test_feet_that_a_file_draws_on_their_toes_are_levelled() -> None:
    """The ankles of the file are pitched by 0.15 rad: the feet stand on their front edges."""
    description = biped(offset=0.0, pitch=0.15)
    assert margin(description, REST) < 0.01
    found = centred_legs(description, LEGS, REST, FORWARD)
    assert margin(description, {**REST, **found}) > 0.08
    poses = forward_kinematics(description, found)
    for leg in LEGS:
        assert poses[leg.foot][2, 2] == pytest.approx(1.0, abs=2e-4)


def test_weight_that_is_centred_stays_and_ankles_that_turn_otherwise_do_too() -> None:
    assert centred_legs(biped(offset=0.0), LEGS, REST, FORWARD) == {}
    assert centred_legs(biped("1 0 0"), LEGS, REST, FORWARD) == {}
    assert centred_legs(biped(), LEGS[:1], REST, FORWARD) == {}


def test_arms_may_not_bring_the_weight_to_the_edge() -> None:
    description = biped(offset=0.0)
    heavy = description.joint_by_name["l_leg_joint"]
    assert heavy.child == "l_leg"
    stands = keeps_standing(description, LEGS, REST)
    assert stands(REST)
    assert not stands({**REST, "l_leg_joint": 1.2, "r_leg_joint": 1.2})
    assert keeps_standing(description, (), REST)({"l_leg_joint": 1.2})


def dog(up: str) -> str:
    """A quadruped without limits on its joints, standing straight, with z or y up."""
    parts = [link("trunk", "0.5 0.2 0.1" if up == "z" else "0.5 0.1 0.2", mass=10.0)]
    for name, x, y in (("FL", 0.2, 0.12), ("FR", 0.2, -0.12), ("RL", -0.2, 0.12), ("RR", -0.2, -0.12)):
        size, low, down, axis = ("0.03 0.03 0.16", "0 0 -0.1", "0 0 -0.2", "0 1 0")
        place = f"{x} {y} 0"
        if up == "y":
            size, low, down, axis = ("0.03 0.16 0.03", "0 -0.1 0", "0 -0.2 0", "0 0 1")
            place = f"{x} 0 {-y}"
        parts += [
            link(f"{name}_thigh", size, low, low),
            link(f"{name}_calf", size, low, low, 0.5),
            joint(f"{name}_thigh", "trunk", place, axis, "continuous"),
            joint(f"{name}_calf", f"{name}_thigh", down, axis, "continuous"),
        ]
    return f'<robot name="dog">{"".join(parts)}</robot>'


def test_a_file_with_y_up_is_turned() -> None:
    drawn = load_description(dog("y"))
    semantic = infer_semantics(drawn)
    assert semantic.up == (0.0, 1.0, 0.0)
    turn = turn_to_upright(semantic)
    assert turn is not None and np.linalg.det(turn) == pytest.approx(1.0)
    upright = turned(drawn, turn)
    again = infer_semantics(upright)
    assert again.up == (0.0, 0.0, 1.0) and turn_to_upright(again) is None
    expected, found = forward_kinematics(drawn), forward_kinematics(upright)
    for name in ("trunk", "FL_calf", "RR_thigh"):
        np.testing.assert_allclose(found[name][:3, 3], turn @ expected[name][:3, 3], atol=1e-12)
    heights = PointModel(upright)
    assert float(heights.lowest(heights.poses({}))) == pytest.approx(-0.38, abs=0.01)


def test_an_import_of_a_file_with_y_up_stands(tmp_path: Path) -> None:
    file = tmp_path / "dog.urdf"
    file.write_text(dog("y"))
    built = build_package(file, name="dog", out=tmp_path / "data").robot
    assert built.semantic.kind == "quadruped" and built.semantic.up == (0.0, 1.0, 0.0)
    turn = turn_to_upright(built.semantic)
    assert turn is not None
    figure = PointModel(turned(built.description, turn))
    figure.home |= {k: v for k, v in built.semantic.postures["rest"].items() if k in figure.home}
    assert decide(figure).margin > 0.05
    (log,) = (tmp_path / "data").rglob("objects/robot/dog/import_log.json")
    assert "the file has y up" in log.read_text()


def test_a_package_keeps_the_frames_of_a_file_with_y_up(tmp_path: Path) -> None:
    """Kinematics are the vendor's; the robot stands by the orientation that its definition states."""
    file = tmp_path / "dog.urdf"
    file.write_text(dog("y"))
    made = build_package(file, name="dog", out=tmp_path / "data")
    expected, found = (
        forward_kinematics(load_description(file)),
        forward_kinematics(load_description(made.folder / "urdf" / "dog.urdf")),
    )
    for name, pose in expected.items():
        np.testing.assert_allclose(found[name], pose, atol=1e-9)
    assert made.robot.planning is not None
    spheres = {link: np.array([s.center for s in made.robot.planning.spheres[link]]) for link in expected}
    assert np.ptp(spheres["trunk"], axis=0) == pytest.approx([0.45, 0.05, 0.15], abs=0.06)

    model = mujoco.MjModel.from_xml_path(str(made.folder / "mjcf" / "dog.xml"))
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    assert data.body("FL_calf").xpos[2] == pytest.approx(-0.2) and data.body("FL_calf").xpos[1] > 0.1

    world = World()
    world.add_plane()
    turn = (0.0, 0.0, np.sin(0.3), np.cos(0.3))
    robot = add_robot(world, made.definition, (0, 0, 0), turn)
    up = matrix_from_quaternion(robot.orientation)[:, 1]
    assert up == pytest.approx([0, 0, 1], abs=1e-6)
    world.step(480)
    up = matrix_from_quaternion(robot.orientation)[:, 1]
    assert up[2] > 0.99 and robot.position[2] == pytest.approx(0.36, abs=0.05)

    world = World()
    world.add_plane()
    drawn = add_robot(world, file)
    assert matrix_from_quaternion(drawn.orientation)[:, 1] == pytest.approx([0, 0, 1], abs=1e-6)


def test_joints_without_limits_turn_the_shorter_way() -> None:
    """Bent knees bring the feet 0.2 m behind the hips; no joint turns by more than that to undo it."""
    description = load_description(dog("z"))
    legs = infer_semantics(description).legs
    rest = {name: 1.4 if "calf" in name else 0.0 for leg in legs for name in leg.joints}
    found = standing_posture(description, legs, rest)
    assert found and max(abs(value) for value in found.values()) < 1.6
