"""SDF files as robot descriptions: poses and inertias as Drake 1.57's reading of the same files has them."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from roboyard import cli
from roboyard.audit import audit_urdf
from roboyard.description import load_description, write_urdf
from roboyard.description.evidence.read import read_evidence
from roboyard.description.files.resolver import Resolver
from roboyard.description.model import Capsule, Contact, RobotDescription
from roboyard.errors import DescriptionError
from roboyard.kinematics.description_poses import forward_kinematics
from roboyard.sim import World


def inertial(mass: float, moment: float, pose: str = "0 0 0 0 0 0") -> str:
    """Return an <inertial> with equal moments."""
    tensor = "".join(f"<{key}>{moment}</{key}>" for key in ("ixx", "iyy", "izz"))
    return f"<inertial><pose>{pose}</pose><mass>{mass}</mass><inertia>{tensor}</inertia></inertial>"


ARM = f"""<sdf version="1.10">
<model name="arm" canonical_link="base">
  <pose>0.3 -0.2 0.1 0 0 0.4</pose>
  <frame name="table"><pose>1 2 0.5 0.1 0 0.3</pose></frame>
  <frame name="mount" attached_to="base"><pose degrees="true">0 0 0.4 0 45 0</pose></frame>
  <link name="base"><pose relative_to="table">0 0 0.1 0 0 0.2</pose>
    <inertial><pose>0.01 0.02 0.03 0.1 0.2 0.3</pose><mass>3</mass>
      <inertia><ixx>0.2</ixx><iyy>0.3</iyy><izz>0.25</izz><ixy>0.01</ixy></inertia></inertial></link>
  <link name="upper"><pose relative_to="mount" rotation_format="quat_xyzw">0.1 0 0 0 0 0.6 0.8</pose>
    {inertial(2, 0.02, "0 0 0.2 0 0 0")}</link>
  <joint name="shoulder" type="revolute"><pose>0.02 0.03 0.04 0.3 0.2 0.1</pose>
    <parent>mount</parent><child>upper</child>
    <axis><xyz expressed_in="table">1 1 0</xyz>
      <limit><lower>-1</lower><upper>2</upper><effort>5</effort></limit>
      <dynamics><damping>0.25</damping></dynamics></axis></joint>
  <link name="cross"><pose relative_to="shoulder">0 0 0.5 0 0.3 0</pose>{inertial(0.5, 0.01)}</link>
  <joint name="cardan" type="universal"><pose relative_to="upper">0 0.01 0.4 0 0 0.2</pose>
    <parent>upper</parent><child>cross</child>
    <axis><xyz>1 0 0</xyz></axis><axis2><xyz>0 1 0</xyz></axis2></joint>
  <link name="nut"><pose relative_to="cross">0 0 0.2 0 0 0</pose>
    {inertial(0.4, 0.01, "0.05 0 0 0 0 0")}</link>
  <joint name="spindle" type="screw"><parent>cross</parent><child>nut</child>
    <screw_thread_pitch>0.02</screw_thread_pitch><axis><xyz>0 0 1</xyz></axis></joint>
  <include><uri>model://claw</uri><name>claw</name><placement_frame>grip</placement_frame>
    <pose relative_to="nut">0 0 0.1 0 0.5 0</pose></include>
  <joint name="wrist" type="continuous"><parent>nut</parent><child>claw::palm</child>
    <axis><xyz expressed_in="claw::finger">0 1 0</xyz></axis></joint>
  <include merge="true"><uri>model://lamp</uri><pose relative_to="upper">0.2 0 0 0 0 0.5</pose></include>
  <joint name="lamp_joint" type="fixed"><parent>upper</parent><child>shade</child></joint>
</model></sdf>"""
CLAW = f"""<sdf version="1.8"><model name="jaw">
  <frame name="grip" attached_to="palm"><pose>0 0.1 0.2 0.3 0 0</pose></frame>
  <link name="palm"><pose>0 0 0.05 0 0 0</pose>{inertial(0.3, 0.01)}
    <visual name="v"><geometry><mesh><uri>meshes/palm.obj</uri></mesh></geometry></visual></link>
  <link name="finger"><pose relative_to="palm">0 0.05 0.1 0.2 0 0</pose>{inertial(0.1, 0.001)}</link>
  <joint name="slide" type="prismatic"><parent>palm</parent><child>finger</child>
    <axis><xyz expressed_in="__model__">0 1 0</xyz>
      <limit><lower>0</lower><upper>0.05</upper></limit></axis></joint></model></sdf>"""
LAMP = f"""<sdf version="1.8"><model name="lamp"><link name="shade"><pose>0 0 0.3 0 0 0</pose>
  {inertial(0.2, 0.001)}</link></model></sdf>"""
CONFIG = '<model><name>claw</name><sdf version="1.4">old.sdf</sdf><sdf version="1.8">claw.sdf</sdf></model>'
PALM = "v 0 0 0\nv 0.1 0 0\nv 0 0.1 0\nv 0 0 0.1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n"

Q = {
    "shoulder": 0.7,
    "cardan": 0.4,
    "cardan_axis2": -0.3,
    "spindle": 1.1,
    "wrist": -0.6,
    "claw::slide": 0.03,
}
DRAKE = {
    "base": (3.0, (0.01, 0.02, 0.03), (0.0, 0.0, 1.0)),
    "upper": (
        2.0,
        (0.234274883841, -0.033402436348, 0.387032995697),
        (0.908037471703, -0.303103473879, 0.289130133513),
    ),
    "cross": (
        0.5,
        (0.555554909712, 0.011289953172, 0.353205352039),
        (0.946895889953, 0.186224344849, -0.262123381206),
    ),
    "nut": (
        0.4,
        (0.761472914756, 0.049816747759, 0.3480784953),
        (0.946895889953, 0.186224344849, -0.262123381206),
    ),
    "claw::palm": (
        0.3,
        (0.659964168714, 0.19235798431, 0.241904924713),
        (0.925561237949, -0.097215582515, -0.365903710451),
    ),
    "claw::finger": (
        0.1,
        (0.744559092618, 0.103039944527, 0.206324219002),
        (0.926882213242, 0.102389503225, -0.361117366524),
    ),
    "shade": (
        0.2,
        (0.368531983615, 0.122471395379, 0.474659360124),
        (0.908037471703, -0.303103473879, 0.289130133513),
    ),
}
"""Mass (kg), centre of mass (m) and z axis of each link in the base frame at `Q`, as Drake computes."""


@pytest.fixture
def arm(tmp_path: Path) -> Path:
    """Write the arm and the models that it includes."""
    (tmp_path / "claw" / "meshes").mkdir(parents=True)
    (tmp_path / "lamp").mkdir()
    (tmp_path / "claw" / "model.config").write_text(CONFIG)
    (tmp_path / "claw" / "claw.sdf").write_text(CLAW)
    (tmp_path / "claw" / "meshes" / "palm.obj").write_text(PALM)
    (tmp_path / "lamp" / "model.sdf").write_text(LAMP)
    file = tmp_path / "arm.sdf"
    file.write_text(ARM)
    return file


def model(*parts: str, version: str = "1.7", name: str = "r") -> str:
    """Return a file with one model."""
    return f'<sdf version="{version}"><model name="{name}">{"".join(parts)}</model></sdf>'


def link(name: str, pose: str = "0 0 0 0 0 0", more: str = "") -> str:
    """Return a link of 1 kg."""
    return f'<link name="{name}"><pose>{pose}</pose>{inertial(1, 0.1)}{more}</link>'


def joint(name: str, parent: str, child: str, more: str = "", kind: str = "revolute") -> str:
    """Return a joint about y."""
    axis = "" if kind == "ball" else f"<axis><xyz>0 1 0</xyz>{more}</axis>"
    return f'<joint name="{name}" type="{kind}"><parent>{parent}</parent><child>{child}</child>{axis}</joint>'


def centres(description: RobotDescription, q: dict[str, float] | None = None) -> dict[str, np.ndarray]:
    """Return each link's pose at the centre of mass, in the root's frame."""
    poses = forward_kinematics(description, q or {})
    return {
        each.name: poses[each.name] @ each.inertial.origin.matrix()
        for each in description.links
        if each.inertial is not None
    }


def test_places_and_masses_agree_with_drake(arm: Path) -> None:
    description = load_description(arm)
    found = centres(description, Q)
    assert set(found) == set(DRAKE)
    poses = forward_kinematics(description, Q)
    for name, (mass, centre, z) in DRAKE.items():
        each = description.link_by_name[name].inertial
        assert each is not None
        assert each.mass == mass
        np.testing.assert_allclose(found[name][:3, 3], centre, atol=1e-11)
        np.testing.assert_allclose(poses[name][:3, 2], z, atol=1e-11)
    base = description.link_by_name["base"].inertial
    assert base is not None
    R = base.origin.matrix()[:3, :3]
    expected = [
        [0.20480021480212346, -0.01855615041845888, 0.009417455508926332],
        [-0.01855615041845888, 0.29708336348665304, 0.005939278594636794],
        [0.009417455508926332, 0.005939278594636794, 0.24811642171122325],
    ]
    np.testing.assert_allclose(R @ base.matrix() @ R.T, expected, atol=1e-14)
    np.testing.assert_allclose(
        poses["claw::grip"][:3, 3], (0.83512491644, 0.073419265892, 0.16998626429), atol=1e-11
    )
    np.testing.assert_allclose(poses["mount"][:3, 3], (0, 0, 0.4), atol=1e-14)


def test_a_screw_is_a_turn_and_a_travel_that_follows(arm: Path) -> None:
    travel = load_description(arm).joint_by_name["spindle_travel"]
    assert travel.mimic is not None
    assert (travel.mimic.joint, travel.mimic.multiplier) == ("spindle", pytest.approx(0.02 / (2 * math.pi)))


def test_limits_and_damping(arm: Path) -> None:
    description = load_description(arm)
    shoulder, slide = (description.joint_by_name[name] for name in ("shoulder", "claw::slide"))
    assert shoulder.limit is not None
    assert (shoulder.limit.lower, shoulder.limit.upper, shoulder.limit.effort) == (-1, 2, 5)
    assert (shoulder.limit.velocity, shoulder.damping) == (None, 0.25)
    assert slide.position_limits() == (0, 0.05)
    assert description.joint_by_name["cardan"].type == "continuous"


def test_meshes_of_included_models_are_found(arm: Path) -> None:
    visual = load_description(arm).link_by_name["claw::palm"].visuals[0]
    assert getattr(visual.geometry, "path", None) == arm.parent / "claw" / "meshes" / "palm.obj"


def test_the_robot_survives_urdf_and_simulates(arm: Path, tmp_path: Path) -> None:
    description = load_description(arm)
    write_urdf(description, tmp_path / "arm.urdf")
    again = load_description(tmp_path / "arm.urdf")
    first, second = centres(description, Q), centres(again, Q)
    for name in first:
        np.testing.assert_allclose(first[name], second[name], atol=1e-12)
    world = World()
    robot = world.add_urdf(arm, fixed_base=True)
    world.step(10)
    assert robot.mass == pytest.approx(sum(mass for mass, _, _ in DRAKE.values()))


def test_the_command_line_audits_and_repairs_it(arm: Path, tmp_path: Path) -> None:
    assert cli.main(["audit", str(arm)]) == 0
    assert cli.main(["repair", str(arm), "--out", str(tmp_path / "out")]) == 0
    assert (tmp_path / "out" / "arm.urdf").is_file()


@pytest.mark.parametrize(
    ("version", "expected"), [("1.4", (1.0, 0.0, 0.0)), ("1.5", (0.0, 1.0, 0.0)), ("1.7", (0.0, 1.0, 0.0))]
)
def test_axes_are_in_the_models_frame_before_1_5(version: str, expected: tuple[float, ...]) -> None:
    turned = link("b", f"0 0 1 0 0 {math.pi / 2}")
    text = model(link("a"), turned, joint("j", "a", "b"), version=version)
    np.testing.assert_allclose(load_description(text).joints[0].axis, expected, atol=1e-12)


def test_use_parent_model_frame() -> None:
    turned = link("b", f"0 0 1 0 0 {math.pi / 2}")
    text = model(
        link("a"), turned, joint("j", "a", "b", "<use_parent_model_frame>1</use_parent_model_frame>")
    )
    np.testing.assert_allclose(load_description(text).joints[0].axis, (1, 0, 0), atol=1e-12)


def test_a_joint_against_the_tree_is_turned_round() -> None:
    """Both `b` and `c` call `d` their child: from `a`, `c` hangs from `d`."""
    text = model(
        link("a"),
        link("b", "0 0 1 0 0 0"),
        link("d", "1 0 1 0 0 0"),
        link("c", "1 0 0 0 0 0"),
        joint("j", "a", "b"),
        joint("k", "b", "d"),
        joint("m", "c", "d"),
    )
    description = load_description(text)
    assert description.root.name == "a"
    turned = description.joint_by_name["m"]
    assert (turned.parent, turned.child) == ("d", "c")
    poses = forward_kinematics(description, {"m": 0.3})
    # the file's joint turns d by +0.3 about y as seen from c, about d's origin
    T_c_d = np.linalg.inv(centres(description, {"m": 0.3})["c"]) @ poses["d"]
    np.testing.assert_allclose(T_c_d[:3, 0], (math.cos(0.3), 0, -math.sin(0.3)), atol=1e-12)
    np.testing.assert_allclose(T_c_d[:3, 3], (0, 0, 1), atol=1e-12)


def test_what_closes_a_loop_or_hangs_nowhere_is_noted() -> None:
    text = model(
        link("a"),
        link("b"),
        link("c"),
        link("d"),
        joint("j", "a", "b"),
        joint("k", "a", "c"),
        joint("m", "b", "c"),
        joint("n", "b", "c").replace("revolute", "prismatic"),
    )
    description = load_description(text)
    assert [each.name for each in description.joints] == ["j", "k"]
    notes = " ".join(description.notes)
    assert [loop.name for loop in description.loops] == ["m"]
    assert "joint 'n' is omitted: it closes a loop" in notes
    assert "not joined to the robot are omitted: d" in notes


def test_the_world_is_a_root_where_the_file_fixes_the_robot() -> None:
    placed = model(
        "<pose>0 0 2 0 0 0</pose>", link("a", "0 0 1 0 0 0"), joint("j", "world", "a", kind="fixed")
    )
    description = load_description(placed)
    assert description.root.name == "world"
    np.testing.assert_allclose(forward_kinematics(description)["a"][:3, 3], (0, 0, 3))
    static = load_description(model("<static>true</static>", '<link name="a"/>', '<link name="b"/>'))
    assert {(each.parent, each.child, each.type) for each in static.joints} == {
        ("world", "a", "fixed"),
        ("world", "b", "fixed"),
    }
    assert static.link_by_name["a"].inertial is None


def test_a_link_without_inertial_weighs_1_kg_as_sdf_says() -> None:
    description = load_description(model('<link name="a"/>'))
    assert description.root.inertial is not None
    assert description.root.inertial.mass == 1.0
    assert description.root.inertial.inertia == (1.0, 0.0, 0.0, 1.0, 0.0, 1.0)
    assert "has no <inertial>" in description.notes[0]


def test_the_model_with_most_links_is_the_robot() -> None:
    world = (
        '<sdf version="1.6"><world name="w"><include><uri>model://sun</uri></include>'
        f'<model name="box">{link("box")}</model>'
        f'<model name="car">{link("a")}{link("b")}{joint("j", "a", "b")}</model></world></sdf>'
    )
    description = load_description(world)
    assert description.name == "car"
    notes = " ".join(description.notes)
    assert "models other than 'car' are omitted: box" in notes
    assert "'model://sun' is not found" in notes


def test_a_mimic_follows_from_its_reference() -> None:
    mimic = (
        '<mimic joint="j"><multiplier>-2</multiplier><offset>0.3</offset><reference>0.1</reference></mimic>'
    )
    text = model(
        link("a"), link("b"), link("c"), joint("j", "a", "b"), joint("k", "b", "c", mimic), version="1.11"
    )
    found = load_description(text).joint_by_name["k"].mimic
    assert found is not None
    assert (found.joint, found.multiplier, found.offset) == ("j", -2.0, pytest.approx(0.3 + 2 * 0.1))


def test_limits_of_one_side_and_none() -> None:
    one = "<limit><lower>-0.5</lower><effort>-1</effort><velocity>inf</velocity></limit>"
    none = "<limit><lower>-1e16</lower><upper>1e16</upper><effort>3</effort></limit>"
    text = model(
        link("a"), link("b"), link("c"), joint("j", "a", "b", one), joint("k", "b", "c", none), version="1.9"
    )
    joints = load_description(text).joint_by_name
    assert joints["j"].type == "revolute"
    limit = joints["j"].limit
    assert limit is not None
    assert (limit.lower, limit.effort, limit.velocity) == (-0.5, None, None)
    assert (limit.upper or 0) >= 1e6
    assert joints["k"].type == "continuous"
    assert joints["k"].limit is not None
    assert joints["k"].limit.effort == 3


def test_shapes_colours_and_friction() -> None:
    shape = (
        '<visual name="v"><pose>0 0 0.5 0 0 0</pose><transparency>0.25</transparency>'
        "<geometry><ellipsoid><radii>0.1 0.2 0.4</radii></ellipsoid></geometry>"
        "<material><diffuse>1 0 0 1</diffuse></material></visual>"
        '<visual name="w"><geometry><sphere><radius>1</radius></sphere></geometry>'
        "<material><script><name>Gazebo/Blue</name></script></material></visual>"
        '<visual name="e"><geometry><empty/></geometry></visual>'
        '<collision name="c"><geometry><box><size>1 2 3</size></box></geometry><surface><friction><ode>'
        "<mu>0.7</mu></ode></friction></surface></collision>"
        '<collision name="h"><geometry><heightmap/></geometry></collision>'
    )
    description = load_description(model(link("a", more=shape)))
    root = description.root
    assert [type(each.geometry).__name__ for each in root.visuals] == ["Capsule", "Sphere"]
    first = root.visuals[0]
    assert isinstance(first.geometry, Capsule)
    assert (first.geometry.radius, first.geometry.length) == pytest.approx((0.15, 0.5))
    assert first.origin.position == (0, 0, 0.5)
    colours = [each.material.rgba for each in root.visuals if each.material]
    assert colours == [(1.0, 0.0, 0.0, 0.75), (0.0, 0.0, 1.0, 1.0)]
    assert root.contact == Contact(lateral_friction=0.7)
    assert any("a collision that is a heightmap is omitted" in note for note in description.notes)


def test_a_model_that_is_not_here_is_not_that_of_another_folder(tmp_path: Path) -> None:
    """The file's own folder is among the packages given, and holds a file of that name: itself."""
    folder = tmp_path / "arm_demo"
    folder.mkdir()
    file = folder / "model.sdf"
    file.write_text(model(link("a"), "<include><uri>model://arm</uri></include>"))
    description = load_description(file, packages={"arm_demo": folder})
    assert [each.name for each in description.links] == ["a"]
    (note, *_) = description.notes
    assert "'model://arm' is not found: name the model's folder with --package arm=FOLDER" in note
    other = tmp_path / "elsewhere"
    other.mkdir()
    (other / "model.sdf").write_text(model(link("b")))
    for packages, links in (({"arm": other}, 1), ({"other": other}, 0)):
        notes = load_description(file, packages=packages).notes
        assert sum("not joined" in note for note in notes) == links


def test_sensors_and_plugins_are_kept_where_the_link_is() -> None:
    """The wheel's frame moves to its joint; the sensor stays where it was."""
    sensor = '<sensor name="eye" type="camera"><pose>0.1 0 0 0 0 0</pose></sensor>'
    wheel = (
        '<joint name="j" type="revolute"><pose>0 0 -0.2 0 0 0</pose><parent>a</parent><child>b</child>'
        "<axis><xyz>0 1 0</xyz></axis></joint>"
    )
    drive = '<plugin name="drive" filename="libgazebo_ros_diff_drive.so"><left_joint>j</left_joint></plugin>'
    description = load_description(model(link("a"), link("b", "0 0 1 0 0 0", sensor), wheel, drive))
    evidence = read_evidence(description)
    (found,) = evidence.sensors
    assert (found.name, found.kind, found.link) == ("eye", "camera", "b")
    assert found.pose.position == pytest.approx((0.1, 0, 0.2))
    assert [plugin.kind for plugin in evidence.plugins] == ["differential"]
    np.testing.assert_allclose(centres(description)["b"][:3, 3], (0, 0, 1))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('<sdf version="1.0"><model name="m"/></sdf>', "SDF 1.0 is too old"),
        (model(), 'model "r" has no <link>'),
        (model("<include><uri>model://gone</uri></include>"), "'model://gone' is not found"),
        (model("<include><uri>https://fuel.example/gone</uri></include>"), "is not fetched"),
        (model(link("a"), link("a")), "two elements are called 'a'"),
        (model('<link name="a"><pose relative_to="b">0 0 0 0 0 0</pose></link>'), "no frame named 'b'"),
        (model(link("base"), joint("j", "base", "bases")), "no frame named 'bases'; did you mean 'base'?"),
        (model(link("a"), link("lad"), joint("j", "a", "lad", kind="hinge")), "unknown type 'hinge'"),
        (model('<link name="a"><pose>1 2 3</pose></link>'), "must have six finite numbers"),
        (model('<link name="a"><pose>nan 0 0 0 0 0</pose></link>'), "must have six finite numbers"),
        (
            model(
                '<frame name="f"><pose relative_to="g"/></frame>',
                '<frame name="g"><pose relative_to="f"/></frame>',
                '<link name="a"><pose relative_to="f">1 0 0 0 0 0</pose></link>',
            ),
            "in a ring",
        ),
        (
            model('<frame name="f" attached_to="g"/><frame name="g" attached_to="f"/>', link("a")),
            "in a ring",
        ),
        (
            model(link("a"), link("b"), joint("j", "a", "b").replace("0 1 0", "0 0 0")),
            "<xyz>0 0 0</xyz> is no direction",
        ),
    ],
)
def test_what_is_wrong_names_the_place(tmp_path: Path, text: str, message: str) -> None:
    file = tmp_path / "wrong.sdf"
    file.write_text(text)
    with pytest.raises(DescriptionError) as caught:
        load_description(file)
    assert message in str(caught.value)
    assert str(caught.value).startswith("wrong.sdf:1: ")
    result = audit_urdf(file)
    assert "format-refused" in result.codes
    assert not result.is_usable


def test_a_joint_to_a_missing_model_is_omitted_with_it() -> None:
    text = model(
        link("a"), "<include><uri>model://gps</uri></include>", joint("j", "gps::link", "a", kind="fixed")
    )
    description = load_description(text)
    assert [each.name for each in description.links] == ["a"]
    assert "joint 'j' to a model that is not included is omitted" in description.notes


def test_a_bare_name_is_a_model_as_in_gazebo(tmp_path: Path) -> None:
    """PX4's models include each other as `<uri>x500_base</uri>`."""
    (tmp_path / "base").mkdir()
    (tmp_path / "base" / "model.sdf").write_text(model(link("hull"), name="base"))
    (tmp_path / "drone").mkdir()
    file = tmp_path / "drone" / "model.sdf"
    include = '<include merge="true"><uri>base</uri></include>'
    file.write_text(model(include, link("arm"), joint("j", "hull", "arm")))
    assert {each.name for each in load_description(file).links} == {"hull", "arm"}
    file.write_text(file.read_text().replace("<uri>base", "<uri>x500"))
    with pytest.raises(DescriptionError, match=r"no frame named 'hull'.*--package x500=FOLDER"):
        load_description(file)


def test_includes_stay_in_the_robots_folders_and_end(tmp_path: Path) -> None:
    (tmp_path / "secret").mkdir()
    (tmp_path / "secret" / "model.sdf").write_text(model(link("s")))
    robot = tmp_path / "deep" / "robot"
    robot.mkdir(parents=True)
    file = robot / "model.sdf"
    file.write_text(model(link("a"), "<include><uri>../../secret/model.sdf</uri></include>"))
    description = load_description(file)
    assert [each.name for each in description.links] == ["a"]
    file.write_text(model(link("a"), "<include><uri>model://robot</uri></include>"))
    with pytest.raises(DescriptionError, match="includes itself"):
        load_description(file)
    deep = link("a")
    for k in range(20):
        deep = f'<model name="m{k}">{deep}</model>'
    file.write_text(f'<sdf version="1.7">{deep}</sdf>')
    with pytest.raises(DescriptionError, match="beyond any robot"):
        load_description(file)


def test_many_includes_of_one_file_are_refused(tmp_path: Path) -> None:
    """Eight levels that each include the next one ten times would be 1e8 models."""
    for k in range(8):
        folder = tmp_path / f"m{k}"
        folder.mkdir()
        inner = "".join(f"<include><name>n{i}</name><uri>model://m{k + 1}</uri></include>" for i in range(10))
        (folder / "model.sdf").write_text(model(link("a"), inner if k < 7 else ""))
    with pytest.raises(DescriptionError, match="beyond any robot"):
        load_description(tmp_path / "m0" / "model.sdf")


def test_a_model_is_looked_for_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = tmp_path / "leaf"
    folder.mkdir()
    (folder / "model.sdf").write_text(model(link("a")))
    inner = "".join(
        f'<include><name>n{i}</name><uri>model://leaf</uri></include><joint name="j{i}" type="fixed">'
        f"<parent>base</parent><child>n{i}::a</child></joint>"
        for i in range(50)
    )
    (tmp_path / "robot.sdf").write_text(model(link("base"), inner))
    asked: list[str] = []
    resolve = Resolver.resolve
    monkeypatch.setattr(Resolver, "resolve", lambda self, uri: asked.append(uri) or resolve(self, uri))
    assert len(load_description(tmp_path / "robot.sdf").links) == 51
    assert sorted(asked) == ["model://leaf/model.config", "model://leaf/model.sdf"]


def test_a_loop_of_links_is_kept(tmp_path: Path) -> None:
    """A parallelogram whose last joint closes it; its frames coincide where the file draws the links."""
    links = "".join(
        f'<link name="{name}"><pose>{pose}</pose></link>'
        for name, pose in (
            ("ground", "0 0 0 0 0 0"),
            ("crank", "0 0 0 0 0 0"),
            ("rod", "0 0 1 0 0 0.5"),
            ("rocker", "2 0 0 0 0.3 0"),
        )
    )
    joints = "".join(
        f'<joint name="{name}" type="revolute"><pose relative_to="__model__">{pose}</pose>'
        f"<parent>{parent}</parent><child>{child}</child>"
        '<axis><xyz expressed_in="__model__">0 1 0</xyz></axis></joint>'
        for name, parent, child, pose in (
            ("a", "ground", "crank", "0 0 0 0 0 0"),
            ("b", "crank", "rod", "0 0 1 0 0 0"),
            ("c", "ground", "rocker", "2 0 0 0 0 0"),
            ("closing", "rod", "rocker", "2 0 1 0.1 0 0"),
        )
    )
    file = tmp_path / "linkage.sdf"
    file.write_text(f'<sdf version="1.10"><model name="linkage">{links}{joints}</model></sdf>')
    description = load_description(file)
    (loop,) = description.loops
    assert (loop.name, loop.type, {loop.first, loop.second}) == ("closing", "revolute", {"rod", "rocker"})
    poses = forward_kinematics(description)
    ends = [
        poses[link] @ pose.matrix()
        for link, pose in ((loop.first, loop.first_origin), (loop.second, loop.second_origin))
    ]
    np.testing.assert_allclose(ends[0], ends[1], atol=1e-9)
    np.testing.assert_allclose(ends[0][:3, 3], (2, 0, 1), atol=1e-9)
    np.testing.assert_allclose(ends[0][:3, :3] @ np.array(loop.axis), (0, 1, 0), atol=1e-9)
