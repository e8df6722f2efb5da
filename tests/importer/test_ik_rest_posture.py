"""Arms that a file draws stretched out rest bent, so that their tips can be led every way."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from roboyard import import_robot
from roboyard.description import RobotDescription, load_description
from roboyard.importer.planning.ik_rest_posture import ENOUGH, arm_of, dexterity, ik_posture
from roboyard.kinematics import forward_kinematics
from roboyard.robots import REGISTERED_ROBOTS
from roboyard.validation import validate


def stretched(sides: tuple[float, ...] = (0.0,)) -> RobotDescription:
    """Arms of six joints, straight up from the floor at these places along y: z y y z y z."""
    inertial = (
        "<inertial><mass value='0.5'/><inertia ixx='.002' iyy='.002' izz='.001' ixy='0' ixz='0' iyz='0'/>"
        "<origin xyz='0 0 0.1'/></inertial>"
    )
    shape = (
        "<collision><origin xyz='0 0 0.1'/><geometry><cylinder radius='0.03' length='0.14'/></geometry>"
        "</collision>"
    )
    parts = [f"<link name='base'>{inertial}</link>"]
    for k, y in enumerate(sides):
        above = "base"
        for i, axis in enumerate("zyyzyz"):
            origin = f"0 {y} 0" if i == 0 else "0 0 0.2"
            direction = "0 0 1" if axis == "z" else "0 1 0"
            name = f"arm{k}_link{i + 1}"
            parts.append(f"<link name='{name}'>{inertial}{shape}</link>")
            parts.append(
                f"<joint name='arm{k}_joint{i + 1}' type='revolute'><parent link='{above}'/>"
                f"<child link='{name}'/><origin xyz='{origin}'/><axis xyz='{direction}'/>"
                "<limit lower='-2.8' upper='2.8' effort='60' velocity='3'/></joint>"
            )
            above = name
    return load_description(f"<robot name='stretched'>{''.join(parts)}</robot>")


def test_a_stretched_arm_is_bent_where_its_joints_allow() -> None:
    robot = stretched()
    rest = {joint.name: 0.0 for joint in robot.joints}
    arm = arm_of(robot, "base", "arm0_link6", rest, ())
    assert arm is not None
    assert dexterity(arm, arm.rest) < 1e-9
    turned = ik_posture(arm, rest, lambda posture: False)
    q = np.array([turned.get(name, 0.0) for name in arm.chain.joint_names])
    assert dexterity(arm, q) > 2 * ENOUGH
    assert not {"arm0_joint1", "arm0_joint6"} & set(turned)
    assert forward_kinematics(arm.chain, q)[0, 3] > 0.2, "forwards"
    again = arm_of(robot, "base", "arm0_link6", {**rest, **turned}, ())
    assert again is not None
    assert ik_posture(again, {**rest, **turned}, lambda posture: False) == {}, "dexterous arms are kept"


def test_an_arm_of_slides_stays() -> None:
    """A telescope has nothing to bend."""
    parts = ["<link name='link0'/>"]
    parts += [
        f"<link name='link{i + 1}'/><joint name='joint{i + 1}' type='prismatic'><parent link='link{i}'/>"
        f"<child link='link{i + 1}'/><origin xyz='0 0 0.2'/><axis xyz='0 0 1'/>"
        "<limit lower='0' upper='0.1' effort='60' velocity='1'/></joint>"
        for i in range(5)
    ]
    robot = load_description(f"<robot name='telescope'>{''.join(parts)}</robot>")
    rest = {joint.name: 0.0 for joint in robot.joints}
    arm = arm_of(robot, "link0", "link5", rest, ())
    assert arm is not None
    assert ik_posture(arm, rest, lambda posture: False) == {}


def test_postures_that_touch_are_passed_over() -> None:
    robot = stretched()
    rest = {joint.name: 0.0 for joint in robot.joints}
    arm = arm_of(robot, "base", "arm0_link6", rest, ())
    assert arm is not None
    first = ik_posture(arm, rest, lambda posture: False)
    assert ik_posture(arm, rest, lambda posture: posture == {**rest, **first}) not in ({}, first)
    assert ik_posture(arm, rest, lambda posture: True) == {}


def test_arms_that_mirror_each_other_are_bent_in_mirror_images() -> None:
    robot = stretched((0.3, -0.3))
    rest = {joint.name: 0.0 for joint in robot.joints}
    tips = []
    for k in range(2):
        arm = arm_of(robot, "base", f"arm{k}_link6", rest, ())
        assert arm is not None
        turned = ik_posture(arm, rest, lambda posture: False)
        q = np.array([turned.get(name, 0.0) for name in arm.chain.joint_names])
        tips.append(forward_kinematics(arm.chain, q)[:3, 3])
    assert tips[0] * (1, -1, 1) == pytest.approx(tips[1])


def test_legs_and_short_chains_are_left_alone() -> None:
    robot = stretched()
    rest = {joint.name: 0.0 for joint in robot.joints}
    shared = [f"arm0_joint{i}" for i in (1, 2, 3)]
    assert arm_of(robot, "base", "arm0_link6", rest, shared) is None
    assert arm_of(robot, "base", "arm0_link3", rest, ()) is None


@pytest.mark.parametrize("given", [False, True])
def test_an_imported_arm_answers_every_command(
    given: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Unless the configuration gives the stretched posture, which stays."""
    from roboyard.description import write_urdf

    monkeypatch.setenv("ROBOYARD_DATA", str(tmp_path / "data"))
    write_urdf(stretched(), tmp_path / "stretched.urdf")
    curobo = "curobo:\n  default_qpos: [0, 0, 0, 0, 0, 0]\n" if given else ""
    (tmp_path / "stretched.yaml").write_text(
        f"urdf_path: stretched.urdf\nname: stretched\ncollision:\n  decompose_method: convex\n{curobo}"
    )
    import_robot(tmp_path / "stretched.yaml", validate=False, report=False)
    robot = REGISTERED_ROBOTS["stretched"]
    posture = np.array(robot.definition.default_joint_pos)
    assert (np.abs(posture) > 0.1).any() != given
    gates = {gate.name: gate for gate in validate(robot, gates=("response",)).gates}
    assert gates["response"].passed != given


def test_an_arm_of_five_joints_is_bent_for_the_position_of_its_tip() -> None:
    """No posture turns its tip about every axis; straight up, it cannot move the tip along itself either."""
    robot = stretched()
    rest = {joint.name: 0.0 for joint in robot.joints}
    arm = arm_of(robot, "base", "arm0_link5", rest, ())
    assert arm is not None and len(arm.own) == 5
    assert dexterity(arm, arm.rest) < 1e-9
    turned = ik_posture(arm, rest, lambda posture: False)
    q = np.array([turned.get(name, 0.0) for name in arm.chain.joint_names])
    assert turned and dexterity(arm, q) > ENOUGH
