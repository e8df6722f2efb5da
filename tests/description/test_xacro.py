"""Xacro files are expanded as the xacro package does, inside the robot's folders and without running code."""

from __future__ import annotations

import math
import os
import subprocess
import sys
import textwrap
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest

from roboyard import World
from roboyard.audit import audit_urdf
from roboyard.cli.xacro_args import read_xacro_args
from roboyard.description import load_description
from roboyard.description.files.resolver import Resolver
from roboyard.description.xacro import expand as expansion
from roboyard.description.xacro import worker
from roboyard.description.xacro.expand import expand_xacro
from roboyard.errors import ConfigError, DescriptionError
from roboyard.repair import repair_urdf

HEAD = '<robot name="arm" xmlns:xacro="http://www.ros.org/wiki/xacro">'
LINK = """
<xacro:macro name="segment" params="name parent length:=0.5 *origin">
  <link name="${name}">
    <inertial>
      <mass value="${2 * length}"/><inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/>
    </inertial>
    <visual><geometry><box size="0.1 0.1 ${length}"/></geometry></visual>
    <collision><geometry><box size="0.1 0.1 ${length}"/></geometry></collision>
  </link>
  <joint name="${parent}_to_${name}" type="revolute">
    <xacro:insert_block name="origin"/>
    <parent link="${parent}"/><child link="${name}"/><axis xyz="0 1 0"/>
    <limit lower="${-pi / 2}" upper="${radians(90)}" effort="10" velocity="1"/>
  </joint>
</xacro:macro>
"""
BODY = """
<xacro:arg name="count" default="2"/>
<xacro:property name="lengths" value="${xacro.load_yaml('sizes.yaml')}"/>
<link name="base"/>
<xacro:segment name="upper" parent="base" length="${lengths['upper']}"><origin xyz="0 0 1"/></xacro:segment>
<xacro:if value="${int('$(arg count)') > 1}">
  <xacro:segment name="lower" parent="upper"><origin xyz="0 0 ${lengths.upper}"/></xacro:segment>
</xacro:if>
"""


def write(folder: Path, **files: str) -> Path:
    """Write a package `arm_description` with these files in `urdf/`, and return its `arm.urdf.xacro`."""
    package = folder / "arm_description"
    (package / "urdf").mkdir(parents=True)
    (package / "package.xml").write_text("<package><name>arm_description</name></package>")
    for name, text in files.items():
        (package / "urdf" / name.replace("__", ".")).write_text(textwrap.dedent(text))
    return package / "urdf" / "arm.urdf.xacro"


@pytest.fixture
def arm(tmp_path: Path) -> Path:
    include = '<xacro:include filename="$(find arm_description)/urdf/segment.xacro"/>'
    return write(
        tmp_path,
        arm__urdf__xacro=f"{HEAD}\n{include}\n{BODY}</robot>",
        segment__xacro=f"{HEAD}{LINK}</robot>",
        sizes__yaml="upper: 0.75\n",
    )


def expand(file: Path, **arguments: str) -> ET.Element:
    return expand_xacro(file, Resolver.of_file(file), arguments)[0]


def refusal(file: Path, **arguments: str) -> str:
    with pytest.raises(DescriptionError) as caught:
        expand(file, **arguments)
    return str(caught.value)


def test_macros_includes_yaml_blocks_and_conditions_give_the_robot(arm: Path):
    robot = load_description(arm)
    assert [joint.name for joint in robot.joints] == ["base_to_upper", "upper_to_lower"]
    limit = robot.joints[0].limit
    assert limit is not None
    assert (limit.lower, limit.upper) == pytest.approx((-math.pi / 2, math.pi / 2))
    assert [link.inertial.mass for link in robot.links if link.inertial] == [1.5, 1.0]
    assert robot.joints[1].origin.position[2] == 0.75


def test_arguments_choose(arm: Path):
    robot = load_description(arm, xacro_args={"count": "1"})
    assert [link.name for link in robot.links] == ["base", "upper"]


def by_command(file: Path, *arguments: str) -> ET.Element:
    """Return what the xacro command makes of a file."""
    command = [sys.executable, "-c", "import xacro; xacro.main()", str(file), *arguments]
    done = subprocess.run(command, capture_output=True, text=True, check=True, cwd=file.parent)
    return ET.fromstring(done.stdout)


def plain(root: ET.Element) -> list:
    return [(e.tag, dict(e.attrib), (e.text or "").strip()) for e in root.iter() if isinstance(e.tag, str)]


def test_the_expansion_equals_that_of_the_xacro_command(tmp_path: Path):
    """The command finds no package without ROS, so this robot includes by relative path."""
    file = write(
        tmp_path,
        arm__urdf__xacro=f'{HEAD}<xacro:include filename="segment.xacro"/>{BODY}</robot>',
        segment__xacro=f"{HEAD}{LINK}</robot>",
        sizes__yaml="upper: 0.75\n",
    )
    assert plain(expand(file, count="2")) == plain(by_command(file, "count:=2"))


def test_world_audit_and_repair_take_it(arm: Path, tmp_path: Path):
    assert World().add_urdf(arm).joint_names == ("base_to_upper", "upper_to_lower")
    audit = audit_urdf(arm)
    assert audit.is_usable
    assert audit.facts.links == 3
    made = repair_urdf(arm, tmp_path / "repaired", xacro_args={"count": "1"})
    assert made.urdf.name == "arm.urdf"
    assert len(load_description(made.urdf).links) == 2


def test_findings_name_lines_of_the_file_itself(tmp_path: Path):
    text = f'{HEAD}\n<xacro:property name="a" value="1"/>\n<link name="base"/>\n<link name="base"/>\n</robot>'
    (audit,) = [f for f in audit_urdf(write(tmp_path, arm__urdf__xacro=text)).findings if "name" in f.code][
        :1
    ]
    assert audit.line == 4


def test_a_name_from_an_argument_without_value_is_the_files(tmp_path: Path):
    head = HEAD.replace('"arm"', '"$(arg robot_name)"', 1)
    file = write(tmp_path, arm__urdf__xacro=f'{head}<link name="base"/></robot>')
    assert expand(file).get("name") == "arm"
    assert expand(file, robot_name="left").get("name") == "left"


def test_elements_without_prefix_are_those_of_old_xacro(tmp_path: Path):
    inertial = '<inertial><mass value="${mass}"/></inertial>'
    body = f'<property name="mass" value="3"/><link name="base">{inertial}</link>'
    root = expand(write(tmp_path, arm__urdf__xacro=f"{HEAD}{body}</robot>"))
    assert root.find("link/inertial/mass").get("value") == "3"  # type: ignore[union-attr]


@pytest.mark.parametrize("with_link", [True, False])
def test_an_include_without_prefix_is_read_only_where_no_link_comes_out_else(tmp_path: Path, with_link: bool):
    """ROS's xacro leaves it unread, and its robot is kept where there is one."""
    link = '<link name="base"/>' if with_link else ""
    file = write(
        tmp_path,
        arm__urdf__xacro=f'{HEAD}\n{link}<include filename="more.xacro"/></robot>',
        more__xacro=f'{HEAD}<link name="more"/></robot>',
    )
    theirs = by_command(file)
    root, notes = expand_xacro(file, Resolver.of_file(file))
    (note,) = notes
    assert "<include> in arm.urdf.xacro:2" in note
    assert (plain(root) == plain(theirs)) is with_link
    assert [each.get("name") for each in root.iter("link")] == ["base" if with_link else "more"]
    assert ("write <xacro:include> to use it" if with_link else "no link comes out otherwise") in note


@pytest.mark.parametrize(
    ("body", "message"),
    [
        ('<link name="${nothing}"/>', "arm.urdf.xacro:2: xacro: name 'nothing' is not defined"),
        (
            '<link name="$(arg size)"/>',
            "arm.urdf.xacro:2: xacro: the argument 'size' has no value; give it with",
        ),
        ('<xacro:include filename="gone.xacro"/>', "gone.xacro: no such file"),
        ('<xacro:include filename="$(find other)/a.xacro"/>', "--package other=FOLDER"),
        ('<xacro:unknown_macro name="a"/>', "unknown macro name: xacro:unknown_macro"),
        ("<link>", "arm.urdf.xacro:2: xacro: not well-formed XML: mismatched tag"),
    ],
)
def test_an_error_names_file_line_and_remedy(tmp_path: Path, body: str, message: str):
    assert message in refusal(write(tmp_path, arm__urdf__xacro=f"{HEAD}\n{body}</robot>"))


def test_a_property_may_begin_with_an_underscore(tmp_path: Path):
    text = f'{HEAD}<xacro:property name="_base" value="first"/><link name="${{_base}}"/></robot>'
    root = expand(write(tmp_path, arm__urdf__xacro=text))
    assert [link.get("name") for link in root.iter("link")] == ["first"]
    assert "two underscores" in refusal(
        write(tmp_path / "b", arm__urdf__xacro=f'{HEAD}<link name="${{__builtins__}}"/></robot>')
    )


def test_a_property_may_be_stated_after_its_use_as_in_old_xacro(tmp_path: Path):
    text = f'{HEAD}<link name="${{base}}_link"/><xacro:property name="base" value="first"/></robot>'
    root = expand(write(tmp_path, arm__urdf__xacro=text))
    assert [link.get("name") for link in root.iter("link")] == ["first_link"]


def test_a_file_of_a_package_that_is_not_here_is_omitted_with_a_note(tmp_path: Path):
    """Accessories of other packages are included by many robots that do not use them."""
    include = '<xacro:include filename="$(find lidars)/urdf/lidar.xacro"/>'
    file = write(tmp_path, arm__urdf__xacro=f'{HEAD}{include}<link name="base"/></robot>')
    root, notes = expand_xacro(file, Resolver.of_file(file))
    assert [link.get("name") for link in root.iter("link")] == ["base"]
    (note,) = notes
    assert "package://lidars/urdf/lidar.xacro is omitted" in note and "--package lidars=FOLDER" in note
    file.write_text(f'{HEAD}{include}<link name="base"/><xacro:lidar parent="base"/></robot>')
    root, notes = expand_xacro(file, Resolver.of_file(file))
    assert [child.get("name") for child in root] == ["base"]
    assert "<xacro:lidar> is omitted: a file that was omitted may define it" in notes[1]
    file.write_text(f'{HEAD}<link name="base"/><xacro:lidar parent="base"/></robot>')
    assert "unknown macro name: xacro:lidar" in refusal(file)
    file.write_text(f'{HEAD}{include}<xacro:lidar parent="base"/></robot>')
    assert "--package lidars=FOLDER" in refusal(file)
    file.write_text(f'{HEAD}{include}<link name="base"/><xacro:lidar parent="base"/></robot>')
    (tmp_path / "lidars").mkdir()
    (tmp_path / "lidars" / "package.xml").write_text("<package><name>lidars</name></package>")
    assert "no such file in the package's folder" in refusal(file)


def test_an_error_in_a_macro_of_another_file_names_that_file(tmp_path: Path):
    macro = '<xacro:macro name="part" params="">\n<link name="${gone}"/></xacro:macro>'
    file = write(
        tmp_path,
        arm__urdf__xacro=f'{HEAD}<xacro:include filename="part.xacro"/><xacro:part/></robot>',
        part__xacro=f"{HEAD}\n{macro}</robot>",
    )
    assert refusal(file).startswith("part.xacro:3: xacro: name 'gone' is not defined")


@pytest.mark.parametrize(
    "expression",
    [
        "().__class__.__base__.__subclasses__()",
        "'{0.__class__}'.format(1)",
        "[x for x in [1]].__class__",
        "(x for x in [1]).gi_frame",
        "(lambda: 1).func_globals",
        "__import__('os').system('touch hit')",
        "open('/etc/hostname')",
        "python.vars(python)",
        "__attribute(xacro, '__class__')",
        "_attribute(xacro, '__class__')",
        "(lambda __attribute: xacro.load_yaml)(1)",
        "python.type(1)",
        "xacro.load_yaml.func_globals",
        "getattr(1, 'real')",
    ],
)
def test_expressions_cannot_leave_the_data(tmp_path: Path, expression: str):
    file = write(tmp_path, arm__urdf__xacro=f'{HEAD}\n<link name="${{{expression}}}"/></robot>')
    assert refusal(file).startswith("arm.urdf.xacro:2: xacro: ")
    evaluated = write(
        tmp_path / "eval", arm__urdf__xacro=f'{HEAD}\n<link name="$(eval {expression})"/></robot>'
    )
    assert "arm.urdf.xacro" in refusal(evaluated)
    assert not list(tmp_path.rglob("hit"))


def test_files_outside_the_robots_folders_are_not_read(tmp_path: Path):
    secret = tmp_path / "secret.xacro"
    secret.write_text(f'{HEAD}<link name="canary"/></robot>')
    (tmp_path / "secret.yaml").write_text("canary: 1")
    for k, body in enumerate(
        (
            f'<xacro:include filename="{secret}"/>',
            '<xacro:include filename="../../secret.xacro"/>',
            '<xacro:include filename="$(find arm_description)/../secret.xacro"/>',
            f"<link name=\"${{xacro.load_yaml('{tmp_path / 'secret.yaml'}')}}\"/>",
            '<xacro:include filename="link.xacro"/>',
        )
    ):
        file = write(tmp_path / f"case{k}" / "deep", arm__urdf__xacro=f"{HEAD}{body}</robot>")
        (file.parent / "link.xacro").symlink_to(secret)
        (file.parents[2] / "secret.xacro").symlink_to(secret)
        message = refusal(file)
        assert "canary" not in message
        assert "outside the robot's folders" in message or "no such file" in message


def test_secrets_of_the_environment_count_as_unset(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setenv("ARM_SIDE", "left")
    monkeypatch.setenv("REGISTRY_TOKEN", "canary")
    body = '<link name="$(optenv ARM_SIDE right)"/><link name="$(optenv REGISTRY_TOKEN none)"/>'
    root = expand(write(tmp_path, arm__urdf__xacro=f"{HEAD}{body}</robot>"))
    assert [link.get("name") for link in root] == ["left", "none"]


@pytest.mark.parametrize(
    "body",
    [
        '<xacro:macro name="again" params=""><xacro:again/></xacro:macro><xacro:again/>',
        '<xacro:include filename="arm.urdf.xacro"/>',
        "<link name=\"${'a' * 10**10}\"/>",
        '<link name="${10 ** 10 ** 10}"/>' if sys.platform != "win32" else '<link name="${gone}"/>',
    ],
)
def test_expansions_without_end_stop(tmp_path: Path, body: str, monkeypatch: pytest.MonkeyPatch):
    """By a bound on processor time of two seconds instead of ten."""
    assert worker.MAX_CPU == 10
    (tmp_path / "hasty_worker.py").write_text(
        "from roboyard.description.xacro import worker\nworker.MAX_CPU = 2\nworker.main()\n"
    )
    monkeypatch.setenv("PYTHONPATH", str(tmp_path), prepend=os.pathsep)
    monkeypatch.setattr(expansion, "_WORKER", "hasty_worker")
    assert "xacro: " in refusal(write(tmp_path, arm__urdf__xacro=f"{HEAD}{body}</robot>"))


def test_arguments_for_a_plain_file_are_refused(tmp_path: Path):
    file = tmp_path / "arm.urdf"
    file.write_text('<robot name="arm"><link name="base"/></robot>')
    with pytest.raises(DescriptionError, match="given for a plain file; omit them"):
        load_description(file, xacro_args={"side": "left"})


def test_the_option_is_name_and_value():
    assert read_xacro_args(["ur_type:=ur5e", "tool:="]) == {"ur_type": "ur5e", "tool": ""}
    with pytest.raises(ConfigError, match="write NAME:=VALUE"):
        read_xacro_args(["ur_type=ur5e"])


def test_an_installation_without_xacro_is_named(arm: Path, monkeypatch: pytest.MonkeyPatch):
    from roboyard.description.xacro import expand

    monkeypatch.setattr(expand, "_WORKER", "roboyard.no_such_module")
    with pytest.raises(DescriptionError, match=r"No module named .*; install Roboyard again"):
        load_description(arm)


XML_LAUNCH = """
<launch>
  <arg name="long" default="3"/>
  <!-- <param command="xacro '$(find arm_description)/urdf/arm.urdf.xacro' size:=9"/> -->
  <param name="robot_description"
    command="$(find xacro)/xacro '$(find arm_description)/urdf/arm.urdf.xacro'
      size:=$(arg long) side:='left'"/>
</launch>
"""
PYTHON_LAUNCH = """
from launch.actions import DeclareLaunchArgument

def generate_launch_description():
    raise SystemExit("launch files are not run")
    declared = [
        DeclareLaunchArgument("arm_size", description="(m)", default_value="3", choices=["3", "4"]),
        DeclareLaunchArgument("side", choices=["left", "right"]),
    ]
    size = LaunchConfiguration("arm_size")
    file = PathJoinSubstitution([share, "urdf", "arm.urdf.xacro"])
    text = Command([FindExecutable(name="xacro"), " ", file, " ", "size:=", size, " ", "side:=", {side}])
"""
SIZED = f"""{HEAD}<xacro:arg name="side" default="none"/><link name="$(arg side)_link">
<visual><geometry><sphere radius="$(arg size)"/></geometry></visual></link></robot>"""


@pytest.mark.parametrize(
    ("name", "text"),
    [("show.launch", XML_LAUNCH), ("show.launch.py", PYTHON_LAUNCH.replace("{side}", '"left"'))],
)
@pytest.mark.parametrize("beside", [False, True])
def test_arguments_without_value_are_those_of_a_launch_file(
    tmp_path: Path, name: str, text: str, beside: bool
):
    file = write(tmp_path, arm__urdf__xacro=SIZED)
    package = tmp_path / ("arm_bringup" if beside else "arm_description")
    (package / "launch").mkdir(parents=True)
    (package / "package.xml").write_text(f"<package><name>{package.name}</name></package>")
    (package / "launch" / name).write_text(text)
    root, notes = expand_xacro(file, Resolver.of_file(file))
    assert root.find("link/visual/geometry/sphere").get("radius") == "3"  # type: ignore[union-attr]
    (note,) = notes
    assert f"arguments of {name} are used: size:=3" in note
    given, _ = expand_xacro(file, Resolver.of_file(file), {"size": "7"})
    assert given.find("link/visual/geometry/sphere").get("radius") == "7"  # type: ignore[union-attr]


@pytest.mark.parametrize(
    ("named", "known"), [("arm_description", True), ("other", False)], ids=["own", "other"]
)
def test_a_launch_file_may_complete_the_name_of_the_robot(tmp_path: Path, named: str, known: bool):
    """As Talos's does: `talos_$(arg robot).urdf.xacro`, of its own package alone."""
    file = write(tmp_path, arm__urdf__xacro=SIZED)
    package = tmp_path / "arm_description"
    (package / "launch").mkdir()
    (package / "package.xml").write_text("<package><name>arm_description</name></package>")
    text = XML_LAUNCH.replace(
        "(find arm_description)/urdf/arm.urdf", f"(find {named})/urdf/a$(arg kind).urdf"
    )
    (package / "launch" / "show.launch").write_text(text)
    if not known:
        assert "'size' has no value" in refusal(file)
        return
    _, notes = expand_xacro(file, Resolver.of_file(file))
    assert "arguments of show.launch are used: size:=3" in notes[0]
    (package / "launch" / "show.launch").rename(file.with_name("upload.launch"))
    _, notes = expand_xacro(file, Resolver.of_file(file))
    assert "arguments of upload.launch are used: size:=3" in notes[0]


def test_arguments_that_a_launch_file_leaves_open_are_listed_with_their_choices(tmp_path: Path):
    body = '<link name="a"/><xacro:include filename="$(arg side).xacro"/></robot>'
    file = write(tmp_path, arm__urdf__xacro=f'{HEAD}<xacro:arg name="side" default="none"/>{body}')
    launch = file.parent.parent / "launch"
    launch.mkdir()
    text = PYTHON_LAUNCH.replace("{side}", 'LaunchConfiguration("side")')
    (launch / "show.launch.py").write_text(text)
    message = refusal(file)
    assert "none.xacro: no such file" in message
    other = file.with_name("arm.urdf.xacro")
    other.write_text(file.read_text().replace('<link name="a"/>', '<link name="$(arg missing)"/>'))
    assert "the argument 'missing' has no value; give it with --xacro-arg missing:=VALUE; " in refusal(other)
    other.write_text(file.read_text().replace("$(arg missing)", "a"))
    assert "show.launch.py passes arguments that have no default: side (left, right)" in message
