"""Robots that fail one gate each, with figures from hand calculations, and one that fails none."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np
import pytest

from roboyard._second_process import SecondProcess
from roboyard.description import load_description
from roboyard.description.model import RobotDescription
from roboyard.errors import RoboyardError
from roboyard.robots import add_robot, parse_definition
from roboyard.sim import World
from roboyard.validation import validate
from roboyard.validation.gates import GATES
from roboyard.validation.gates.ik_reach import ik_reach_gates, reach
from roboyard.validation.gates.sensors import camera_findings
from roboyard.validation.page import plot
from roboyard.validation.report import Curve, Gate, ValidationReport
from roboyard.validation.test_world import TestWorld as ValidationWorld
from roboyard.validation.test_world import own_contacts

BOX = "<geometry><box size='{size} {size} {size}'/></geometry>"
MASS = (
    "<inertial><mass value='{mass}'/>"
    "<inertia ixx='.02' iyy='.02' izz='.02' ixy='0' ixz='0' iyz='0'/></inertial>"
)


def link(name: str, size: float = 0.1, mass: float = 1.0) -> str:
    shape = BOX.format(size=size)
    return (
        f"<link name='{name}'>{MASS.format(mass=mass)}<visual>{shape}</visual>"
        f"<collision>{shape}</collision></link>"
    )


def hinge(
    name: str, parent: str, child: str, xyz: str, limit: str = "lower='-1' upper='1'", extra: str = ""
) -> str:
    return (
        f"<joint name='{name}' type='revolute'><parent link='{parent}'/><child link='{child}'/>"
        f"<origin xyz='{xyz}'/><axis xyz='0 0 1'/><limit {limit} effort='40' velocity='2'/>{extra}</joint>"
    )


def two_arms(*, apart: float = 0.3, left: str = "lower='-1' upper='1'") -> RobotDescription:
    """Return a fixed base with two boxes on vertical hinges `apart` metres from each other."""
    return load_description(
        "<robot name='pair'>"
        + link("base")
        + link("a")
        + link("b")
        + hinge("left", "base", "a", f"0 {apart / 2} 1", left)
        + hinge("right", "base", "b", f"0 {-apart / 2} 1")
        + "</robot>"
    )


DEFINITION = {
    "raw_controller_order": ["trunk", "camera"],
    "default_controllers": {},
    "articulated_trunk": {"trunk_joint_names": ["left"]},
    "active_camera": {"camera_joint_names": ["right"]},
    "default_joint_pos": [0.0, 0.0],
}


def failed(report: ValidationReport) -> list[str]:
    return [gate.name for gate in report.failed]


def test_a_sound_robot_fails_none() -> None:
    report = validate(two_arms(), definition=DEFINITION)
    assert failed(report) == []
    assert report.joints == 2
    assert {gate.name for gate in report.gates if not gate.skipped} == {
        "limits",
        "start",
        "self_collision",
        "rest_contact",
        "settle",
        "base_drift",
        "joint_drift",
        "response",
        "isolation",
        "overshoot",
        "error",
    }
    assert report.gate("isolation").figure < 0.01


def test_overlapping_links_fail_only_the_gate_of_self_collision() -> None:
    report = validate(two_arms(apart=0.096), definition=DEFINITION, gates=["limits", "self_collision"])
    assert failed(report) == ["self_collision"]
    gate = report.gate("self_collision")
    assert gate.figure == 1.0
    assert gate.findings == ["a and b overlap by 4.00 mm"]


@pytest.mark.parametrize(("gap", "counted"), [(-0.00015, 0), (-0.0003, 1)])
def test_overlaps_of_less_than_a_fifth_of_a_millimetre_are_not_counted(gap: float, counted: int) -> None:
    report = validate(two_arms(apart=0.1 + gap), definition=DEFINITION, gates=["self_collision"])
    assert report.gate("self_collision").figure == counted


def test_the_depth_of_overlaps_is_listed_from_the_deepest() -> None:
    world = World()
    text = "<robot name='row'>" + link("base") + "".join(link(name) for name in "abc")
    places = (("a", 0.0), ("b", 0.09), ("c", 0.17))
    text += "".join(hinge(f"j{name}", "base", name, f"0 {y} 1") for name, y in places) + "</robot>"
    robot = add_robot(world, load_description(text))
    found = own_contacts(world, robot.body)
    assert [(a, b) for a, b, _ in found] == [("b", "c"), ("a", "b")]
    assert [depth for _, _, depth in found] == pytest.approx([0.02, 0.01])


@pytest.mark.parametrize(
    ("limit", "finding"),
    [
        ("lower='0.5' upper='0.5'", "joint 'left': range 0.5 to 0.5 is empty"),
        ("lower='-2e5' upper='1'", "joint 'left': range -200000 to 1 is too wide; set the real limits"),
        ("lower='0.3' upper='1'", "default_joint_pos: left = 0 is outside 0.3 to 1"),
    ],
)
def test_impossible_limits_fail_the_gate_of_limits(limit: str, finding: str) -> None:
    report = validate(two_arms(left=limit), definition=DEFINITION, gates=["limits"])
    assert failed(report) == ["limits"]
    assert finding in report.gate("limits").findings


def test_efforts_and_speeds_of_zero_are_reported_with_the_assumed_ones() -> None:
    text = (
        "<robot name='locked'>"
        + link("base")
        + link("a")
        + hinge("left", "base", "a", "0 0 1").replace("effort='40' velocity='2'", "effort='0' velocity='0'")
        + "</robot>"
    )
    report = validate(load_description(text), gates=["limits"])
    assert report.gate("limits").findings == [
        "joint 'left': effort limit 0 locks the joint; assumed 100; set the real limit",
        "joint 'left': velocity limit 0 locks the joint; assumed 15; set the real limit",
    ]


def lying(effort: float, lower: float = -1.0, upper: float = 1.0) -> RobotDescription:
    """Return an arm of 1 kg beside a post that it meets when it has turned by a right angle."""
    box = "<collision><origin xyz='{}'/><geometry><box size='{}'/></geometry></collision>"
    tensor = "<inertia ixx='.01' iyy='.01' izz='.01' ixy='0' ixz='0' iyz='0'/>"
    mass = f"<inertial><mass value='1'/>{tensor}</inertial>"
    return load_description(
        f"<robot name='arm'><link name='base'>{mass}{box.format('0 0 -.1', '.1 .1 .1')}</link>"
        f"<link name='post'>{mass}{box.format('0 0 0', '.1 .1 .3')}</link>"
        f"<link name='arm'>{mass}{box.format('.2 0 0', '.4 .05 .05')}</link>"
        "<joint name='stand' type='fixed'><parent link='base'/><child link='post'/>"
        "<origin xyz='0 .3 0'/></joint>"
        f"<joint name='turn' type='revolute'><parent link='base'/><child link='arm'/><axis xyz='0 0 1'/>"
        f"<limit lower='{lower}' upper='{upper}' effort='{effort}' velocity='2'/></joint></robot>"
    )


def test_an_effort_that_is_no_motors_is_a_warning() -> None:
    """The weight of 3 kg at a diagonal of 0.72 m or less is a torque of 21 N m at most."""
    assert not validate(lying(20.0), gates=["limits"]).gate("limits").warnings
    (text,) = validate(lying(5000.0), gates=["limits"]).gate("limits").warnings
    assert text.startswith("joint 'turn': effort limit 5000 N m is ")
    assert 5000.0 / 21.2 < float(text.split(" N m is ")[1].split()[0]) < 5000.0 / 10.0
    assert "of more than 2 turns" not in text


def test_such_an_effort_over_several_turns_names_what_is_hit() -> None:
    (text,) = validate(lying(5000.0, -10.0, 10.0), gates=["limits"]).gate("limits").warnings
    assert "the range of 'turn', -10 to 10, is of more than 2 turns, but at " in text
    hit = float(text.split("but at ")[1].split()[0])
    assert abs(hit - math.pi / 2) < 0.5  # the post is 0.3 m to the left
    assert "arm meets post" in text


def serial(effort: float) -> RobotDescription:
    """Return two links in a row, the second with its mass 0.3 m from its hinge."""
    text = "<robot name='row'>" + link("base") + link("a") + link("b")
    text = text.replace("<mass value='1'/>", "<origin xyz='0.3 0 0'/><mass value='1'/>")
    text += hinge("left", "base", "a", "0 0 1")
    text += hinge("right", "a", "b", "0.5 0 0").replace("effort='40'", f"effort='{effort}'")
    return load_description(text + "</robot>")


def test_a_weak_joint_that_swings_with_another_fails_the_gate_of_isolation() -> None:
    assert failed(validate(serial(60.0), definition=DEFINITION, gates=["response"])) == []
    report = validate(serial(0.05), definition=DEFINITION, gates=["response"])
    assert "isolation" in failed(report)
    (finding,) = report.gate("isolation").findings
    assert finding.startswith("trunk[0] also moves right, by")
    assert f"by {report.gate('isolation').figure:.0%} of its own motion" in finding
    assert finding.endswith("the drive of 'right' is at its effort limit of 0.05")


def test_a_joint_is_not_isolated_from_a_part_that_runs_into_it(monkeypatch: pytest.MonkeyPatch) -> None:
    """Two bars side by side meet when one turns; what the push moves is no leak of the command."""
    text = "<robot name='pair'>" + link("base")
    text += "".join(link(name) for name in "ab").replace("0.1 0.1 0.1", "0.4 0.02 0.1")
    text += hinge("left", "base", "a", "0 0.0125 1")
    text += hinge("right", "base", "b", "0 -0.0125 1").replace("effort='40'", "effort='0.2'")
    description = load_description(text + "</robot>")
    assert "isolation" not in failed(validate(description, definition=DEFINITION, gates=["response"]))
    monkeypatch.setattr("roboyard.validation.gates.response._free_steps", lambda *_: 1000)
    assert "isolation" in failed(validate(description, definition=DEFINITION, gates=["response"]))


def test_mimic_joints_of_a_group_may_move_with_it() -> None:
    text = "<robot name='copy'>" + link("base") + "".join(link(name) for name in "abc")
    belt = "<mimic joint='left' multiplier='0.5'/>"
    text += hinge("left", "base", "a", "0 0.3 1") + hinge("right", "base", "b", "0 -0.3 1")
    text += hinge("belt", "base", "c", "0.5 0 1", extra=belt) + "</robot>"
    own = {**DEFINITION, "default_joint_pos": [0.0, 0.0, 0.0]}
    report = validate(load_description(text), definition=own, gates=["response"])
    assert failed(report) == []
    assert report.gate("isolation").figure < 0.01


def test_a_command_without_motion_fails_the_gate_of_response() -> None:
    definition = {**DEFINITION, "default_controllers": {"camera": "NullJointController"}}
    assert failed(validate(two_arms(), definition=definition, gates=["response"])) == []
    narrow = two_arms(left="lower='0' upper='1e-4'")
    report = validate(narrow, definition=DEFINITION, gates=["limits", "response"])
    assert failed(report) == ["response"]
    assert report.gate("response").figure < 2e-3
    assert report.gate("response").findings[0].startswith("trunk[0] moves its joints by only")


def test_robots_without_commands_skip_the_gate_of_response() -> None:
    definition = {
        **DEFINITION,
        "default_controllers": {"trunk": "NullJointController", "camera": "NullJointController"},
    }
    gate = validate(two_arms(), definition=definition, gates=["response"]).gate("response")
    assert gate.skipped == "no controller takes commands" and gate.passed


TABLE = """<robot name="table">
<link name="base"><inertial><origin xyz="{com} 0 0.3"/><mass value="10"/>
<inertia ixx=".2" iyy=".2" izz=".2" ixy="0" ixz="0" iyz="0"/></inertial>
<collision><origin xyz="0 0 0.05"/><geometry><box size="0.4 0.3 0.1"/></geometry></collision></link>
<link name="a"><inertial><mass value=".1"/><inertia ixx=".001" iyy=".001" izz=".001" ixy="0" ixz="0" iyz="0"/>
</inertial></link>
<joint name="left" type="revolute"><parent link="base"/><child link="a"/><origin xyz="0 0 0.5"/>
<axis xyz="0 0 1"/><limit lower="-1" upper="1" effort="5" velocity="2"/></joint></robot>"""


@pytest.mark.parametrize(("com", "falls"), [(0.17, False), (0.26, True)])
def test_a_robot_whose_mass_is_beyond_its_edge_tips_over(com: float, falls: bool) -> None:
    definition = {
        "raw_controller_order": ["base"],
        "default_controllers": {},
        "locomotion": {"base_joint_names": ["left"]},
        "default_joint_pos": [0.0],
    }
    report = validate(load_description(TABLE.format(com=com)), definition=definition, gates=["drift"])
    assert failed(report) == (["base_drift"] if falls else [])
    figure = report.gate("base_drift").figure
    assert figure > 0.05 if falls else figure < 1e-3


REACH = """<robot name="reach">{links}</robot>"""


def planar_arm(effort: float, velocity: float = 2.0) -> RobotDescription:
    """Return an arm of three hinges about y that carry 2 kg, 0.3 m apart."""
    links, parent = link("base", 0.02), "base"
    for k in range(1, 4):
        xyz = "0 0 1.5" if k == 1 else "0.3 0 0"
        links += (
            f"<link name='l{k}'><inertial><origin xyz='0.3 0 0'/><mass value='2'/><inertia ixx='.01' "
            f"iyy='.01' izz='.01' ixy='0' ixz='0' iyz='0'/></inertial></link>"
            f"<joint name='j{k}' type='revolute'>"
            f"<parent link='{parent}'/><child link='l{k}'/><origin xyz='{xyz}'/><axis xyz='0 1 0'/>"
            f"<limit lower='-1.5' upper='1.5' effort='{effort}' velocity='{velocity}'/></joint>"
        )
        parent = f"l{k}"
    links += (
        f"<link name='tip'>{MASS.format(mass=0.01)}</link><joint name='t' type='fixed'><parent link='l3'/>"
        "<child link='tip'/><origin xyz='0.3 0 0'/></joint>"
    )
    return load_description(REACH.format(links=links))


def reach_definition(name: str = "InverseKinematicsController") -> dict:
    return {
        "raw_controller_order": ["arm_0"],
        "default_controllers": {"arm_0": name},
        "default_joint_pos": [-0.5, 0.9, 0.4],
        "manipulation": {"arm_joint_names": {"0": ["j1", "j2", "j3"]}, "eef_link_names": {"0": "tip"}},
    }


def world_of(description: RobotDescription, definition: dict) -> ValidationWorld:
    return ValidationWorld(name="reach", source=description, definition=parse_definition(definition))


def reached(description: RobotDescription, definition: dict, poses: int = 3) -> Gate:
    (gate,) = ik_reach_gates(world_of(description, definition), poses=poses)
    return gate


def test_an_arm_reaches_the_poses_of_its_own_postures() -> None:
    gate = reached(planar_arm(200.0), reach_definition())
    assert gate.passed and gate.figure == 1.0
    assert gate.curve is not None and len(gate.curve.x) == 3


def test_an_arm_too_weak_for_its_weight_has_no_pose_to_reach() -> None:
    """The shoulder carries 6 kg at 0.6 m on average: 35 N m, more than 0.8 of its effort limit."""
    gate = reached(planar_arm(8.0), reach_definition())
    assert not gate.passed and gate.figure == 0.0
    assert "no path to a posture is free" in gate.detail
    assert "gravity needs more than 80% of the effort limit 8 of joint 'j1'" in gate.findings[0]


def test_no_more_poses_are_tried_once_the_gate_cannot_pass() -> None:
    """At 0.05 rad/s no pose is reached in time; three of 20 missed are more than a tenth."""
    gate = reached(planar_arm(200.0, velocity=0.05), reach_definition(), poses=20)
    assert not gate.passed and gate.figure == 0.0
    assert gate.curve is not None and len(gate.curve.x) == len(gate.findings) == 3


def test_an_arm_at_rest_away_from_its_pose_is_not_waited_for() -> None:
    """A pose beside the arm's plane: after a minute the errors are those at which it was left."""
    absolute = {"mode": "absolute_pose", "command_output_limits": None, "command_input_limits": None}
    robot = world_of(planar_arm(200.0), reach_definition()).robot(
        action_normalize=False, controllers={"arm_0": absolute}
    )
    beside = np.eye(4)
    beside[:3, 3] = 0.6, 0.3, 1.4
    began = robot.world.time
    left = reach(robot, "arm_0", beside, 60.0)
    assert robot.world.time - began < 20.0
    robot.world.step(round(60.0 / robot.world.timestep))
    assert left == pytest.approx(reach(robot, "arm_0", beside, 0.05), abs=1e-3)
    assert left[0] > 0.1


def test_arms_without_inverse_kinematics_skip_the_gate_of_reach() -> None:
    gate = reached(planar_arm(200.0), reach_definition("JointController"))
    assert gate.skipped == "no group has inverse kinematics"


def camera_on(
    position: Iterable[float], forward: Iterable[float], up: Iterable[float], name: str = "head_cam"
):
    world = World()
    body = add_robot(world, two_arms()).body
    f, u = np.array(forward, float), np.array(up, float)
    rotation = np.column_stack([np.cross(f, u), u, -f])
    return camera_findings(body, name, np.array(position, float), rotation)


def test_a_camera_inside_its_housing_is_occluded() -> None:
    inside = camera_on((0.02, 0.15, 1.0), (1, 0, 0), (0, 0, 1))
    assert inside[0] == 1.0
    assert inside[2] == ["head_cam: 100% of the view is occluded within 5 cm"]
    ahead = camera_on((0.06, 0.15, 1.0), (1, 0, 0), (0, 0, 1))
    assert ahead == (0.0, True, [])
    backwards = camera_on((0.06, 0.15, 1.0), (-1, 0, 0), (0, 0, 1))
    assert backwards[0] == 1.0


def test_a_camera_of_the_head_must_be_upright_and_others_need_not() -> None:
    place = (0.3, 0.0, 1.5)
    tilt = math.acos(0.2)
    up = (0, math.sin(tilt), math.cos(tilt))
    _, upright, findings = camera_on(place, (1, 0, 0), up)
    assert not upright
    assert findings == ["head_cam: +y of the camera does not point up (z 0.20)"]
    assert camera_on(place, (1, 0, 0), up, name="wrist")[1:] == (True, [])


def test_an_error_in_a_gate_is_a_failed_gate_with_its_message(monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(world: object) -> tuple[Gate, ...]:
        raise RoboyardError("the drive of 'left'\n   has no gain")

    monkeypatch.setitem(GATES, "settle", broken)
    seen: list[tuple[str, float]] = []
    report = validate(
        two_arms(),
        definition=DEFINITION,
        gates=["settle", "limits"],
        progress=lambda *step: seen.append(step),
        scene=lambda world: world.add_plane(),
    )
    assert failed(report) == ["settle"]
    assert report.gate("settle").findings == ["the drive of 'left' has no gain"]
    assert seen == [("limits", 0.0), ("settle", 0.5)]


def test_gates_of_two_processes_are_those_of_one(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("ROBOYARD_THREADS", raising=False)
    monkeypatch.setattr("os.sched_getaffinity", lambda _: {0, 1}, raising=False)
    monkeypatch.setattr("os.cpu_count", lambda: 2)
    chosen = ["limits", "settle", "ik_reach"]
    alone = validate(planar_arm(200.0), definition=reach_definition(), gates=chosen, fixed_base=True)
    with SecondProcess() as second:
        second.begin()
        seen: list[str] = []
        together = validate(
            planar_arm(200.0),
            definition=reach_definition(),
            gates=chosen,
            progress=lambda name, share: seen.append(name),
            second=second,
            fixed_base=True,
        )
    assert seen == ["ik_reach", "limits", "settle"]  # first what takes longest
    assert together.to_json() | {"seconds": 0} == alone.to_json() | {"seconds": 0}
    assert [gate.name for gate in together.gates] == [gate.name for gate in alone.gates]


@pytest.mark.parametrize(
    ("figure", "sense", "passes"),
    [(1.0, "at most", True), (1.01, "at most", False), (1.0, "at least", True), (0.99, "at least", False)],
)
def test_a_figure_at_its_threshold_passes(figure: float, sense: str, passes: bool) -> None:
    gate = Gate(
        name="x", title="Speed", figure=figure, threshold=1.0, unit="m/s", sense=sense, advice="slow down"
    )
    assert gate.passed is passes
    assert gate.line().startswith("  ok  Speed: " if passes else " FAIL Speed: ")
    assert gate.line().endswith(f"{figure:.4g} m/s ({sense} 1)")
    assert gate.to_json()["advice"] == ("" if passes else "slow down")


def test_infinite_figures_are_null_in_json_and_missing_gates_are_key_errors() -> None:
    gate = Gate(name="x", title="x", figure=math.inf, threshold=1.0, unit="m")
    report = ValidationReport(robot="r", gates=(gate,), seconds=1.23456)
    data = report.to_json()
    assert data["gates"][0]["figure"] is None and data["passed"] is False and data["seconds"] == 1.235
    with pytest.raises(KeyError, match="y"):
        report.gate("y")


def test_a_plot_spans_its_axes_with_a_bounded_number_of_points() -> None:
    x = np.linspace(2.0, 12.0, 4001)
    text = plot(Curve(x=x, lines={"a<b": x - 2.0}, x_label="time, s", y_label="m"))
    points = [tuple(map(float, p.split(","))) for p in text.split('points="')[1].split('"')[0].split()]
    assert len(points) <= 410
    assert points[0] == (64.0, 136.0) and points[-1] == (510.0, 10.0)
    assert "a&lt;b" in text and ">2</text>" in text and ">12</text>" in text and ">10</text>" in text
