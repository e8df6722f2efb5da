"""Loading URDF, SDF and MJCF files: flags, scale, names and errors, compared with PyBullet 3.2.7."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import roboyard.pybullet as p

ROBOT = """<robot name="flags">
  <link name="base"><inertial><origin xyz="0.1 0 0"/><mass value="1"/>
    <inertia ixx="0.3" ixy="0" ixz="0" iyy="0.4" iyz="0" izz="0.5"/></inertial>
    <visual><geometry><box size="0.1 0.2 0.3"/></geometry></visual>
    <collision><geometry><cylinder radius="0.1" length="0.4"/></geometry></collision></link>
  <link name="tip"><inertial><mass value="0.2"/>
    <inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.1"/></inertial>
    <collision><origin xyz="0 0 0.1"/><geometry><sphere radius="0.05"/></geometry></collision></link>
  <link name="bare"/>
  <joint name="bend" type="revolute"><parent link="base"/><child link="tip"/><origin xyz="0 0 0.3"/>
    <axis xyz="1 0 0"/><limit lower="-1" upper="1" effort="5" velocity="2"/></joint>
  <joint name="glue" type="fixed"><parent link="tip"/><child link="bare"/><origin xyz="0 0.1 0"/></joint>
</robot>"""
INERTIA = "<inertia><ixx>0.1</ixx><ixy>0</ixy><ixz>0</ixz><iyy>0.1</iyy><iyz>0</iyz><izz>0.1</izz></inertia>"
SDF = """<sdf version="1.6"><world name="w">
  <model name="first"><pose>1 2 3 0 0 0.5</pose><static>1</static>
    <link name="l"><inertial><mass>2</mass>INERTIA</inertial>
      <collision name="c"><geometry><box><size>0.2 0.4 0.6</size></box></geometry></collision></link></model>
  <model name="second"><pose>0 0 1 0 0 0</pose>
    <link name="a"><inertial><mass>1</mass>INERTIA</inertial>
      <collision name="c"><geometry><sphere><radius>0.1</radius></sphere></geometry></collision></link>
    <link name="b"><pose>0 0 0.5 0 0 0</pose><inertial><mass>0.5</mass>INERTIA</inertial></link>
    <joint name="j" type="revolute"><parent>a</parent><child>b</child>
      <axis><xyz>0 1 0</xyz><limit><lower>-1</lower><upper>1</upper></limit></axis></joint></model>
</world></sdf>""".replace("INERTIA", INERTIA)
MJCF = """<mujoco model="m"><compiler angle="radian"/><worldbody>
  <geom type="plane" name="floor" size="5 5 1"/>
  <body name="free" pos="0 0 1"><joint type="free"/><geom type="sphere" size="0.2"/></body>
  <body name="arm" pos="1 0 1">
    <joint type="hinge" name="swing" axis="0 1 0" range="-1 1" limited="true"/>
    <geom type="capsule" size="0.05 0.2" pos="0 0 -0.2"/>
    <body name="fore" pos="0 0 -0.5">
      <joint type="slide" name="push" axis="0 0 1" range="0 0.2" limited="true"/>
      <geom type="box" size="0.05 0.05 0.1"/></body></body>
</worldbody></mujoco>"""


def write(folder: Path, name: str, text: str) -> str:
    file = folder / name
    file.write_text(text)
    return str(file)


def message_of(call: Callable[[], Any]) -> list[str]:
    try:
        return ["no error", repr(call())]
    except Exception as problem:
        return [type(problem).__name__, str(problem)]


def summary(p: Any, body: int) -> Any:
    """Names, joints, masses, poses and boxes of a body."""
    joints = p.getNumJoints(body)
    return [
        p.getBodyInfo(body),
        [list(p.getJointInfo(body, joint)[1:3]) for joint in range(joints)],
        [p.getDynamicsInfo(body, link)[0] for link in range(-1, joints)],
        p.getBasePositionAndOrientation(body),
        [p.getLinkState(body, link)[0] for link in range(joints)],
    ]


def record_flags(p: Any, folder: Path) -> Any:
    file = write(folder, "flags.urdf", ROBOT)
    flags = (
        0, p.URDF_USE_INERTIA_FROM_FILE, p.URDF_MERGE_FIXED_LINKS, p.URDF_MAINTAIN_LINK_ORDER,
        p.URDF_IGNORE_COLLISION_SHAPES, p.URDF_IGNORE_VISUAL_SHAPES,
    )  # fmt: skip
    return [summary(p, p.loadURDF(file, flags=flag)) for flag in flags]


def record_placement(p: Any, folder: Path) -> Any:
    file = write(folder, "place.urdf", ROBOT)
    return [
        summary(p, p.loadURDF(file, [1, 2, 3])),
        summary(p, p.loadURDF(file, [1, 2, 3], [0, 0, 0.6, 0.8])),
        summary(p, p.loadURDF(file, useFixedBase=1)),
        summary(p, p.loadURDF(file, globalScaling=3.0)),
        summary(p, p.loadURDF(file, 1, 2, 3)),
        summary(p, p.loadURDF(file, 1, 2, 3, 0, 0, 0.6, 0.8)),
    ]


def record_collision_shapes_of_flags(p: Any, folder: Path) -> Any:
    file = write(folder, "shapes.urdf", ROBOT)
    flags = (0, p.URDF_USE_IMPLICIT_CYLINDER, p.URDF_IGNORE_COLLISION_SHAPES)
    bodies = [p.loadURDF(file, flags=flag) for flag in flags]
    return [[p.getCollisionShapeData(body, link) for link in (-1, 0, 1)] for body in bodies]


def record_sdf(p: Any, folder: Path) -> Any:
    return [summary(p, body) for body in p.loadSDF(write(folder, "w.sdf", SDF))]


def record_mjcf(p: Any, folder: Path) -> Any:
    """Names of joints that Bullet invents count through the whole process and are left aside."""
    bodies = p.loadMJCF(write(folder, "m.xml", MJCF))
    return [
        [
            p.getBodyInfo(body)[1],
            [p.getJointInfo(body, joint)[2] for joint in range(p.getNumJoints(body))],
            [p.getDynamicsInfo(body, link)[0] for link in range(-1, p.getNumJoints(body))],
            p.getBasePositionAndOrientation(body),
        ]
        for body in bodies
    ]


def record_poor_files(p: Any, folder: Path) -> Any:
    no_limit = ROBOT.replace('<limit lower="-1" upper="1" effort="5" velocity="2"/>', "")
    return [
        message_of(lambda: p.loadURDF(write(folder, "empty.urdf", ""))),
        message_of(lambda: p.loadURDF(write(folder, "text.urdf", "no xml"))),
        message_of(lambda: p.loadURDF(write(folder, "limit.urdf", no_limit))),
        message_of(lambda: p.loadURDF(write(folder, "r.urdf", ROBOT), [0, 0])),
        message_of(lambda: p.loadURDF(write(folder, "r.urdf", ROBOT), [0, 0, 0], [0, 0, 0])),
        message_of(lambda: p.loadSDF(write(folder, "text.sdf", "no xml"))),
        p.getNumBodies(),
    ]


@pytest.mark.parametrize(
    ("scenario", "tolerance"),
    [
        (record_flags, 1e-6),
        (record_placement, 1e-6),
        (record_collision_shapes_of_flags, 1e-6),
        (record_sdf, 1e-6),
        (record_mjcf, 1e-5),
        (record_poor_files, 0),
    ],
)
def test_bodies_are_pybullets(agrees: Any, scenario: Any, tolerance: float) -> None:
    agrees(scenario, tolerance)


def test_the_last_search_path_counts(client: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for folder, mass in (("one", "1"), ("two", "2")):
        (tmp_path / folder).mkdir()
        text = f'<robot name="r"><link name="l"><inertial><mass value="{mass}"/></inertial></link></robot>'
        write(tmp_path / folder, "same.urdf", text)
    (tmp_path / "empty").mkdir()
    monkeypatch.chdir(tmp_path / "empty")
    for folder, mass in (("one", 1.0), ("two", 2.0)):
        p.setAdditionalSearchPath(str(tmp_path / folder))
        assert p.getDynamicsInfo(p.loadURDF("same.urdf"), -1)[0] == mass


def test_a_changed_file_is_read_again(client: int, tmp_path: Path) -> None:
    for mass in ("1.5", "22.5"):
        text = f'<robot name="r"><link name="l"><inertial><mass value="{mass}"/></inertial></link></robot>'
        file = write(tmp_path, "changing.urdf", text)
        assert p.getDynamicsInfo(p.loadURDF(file), -1)[0] == float(mass)


def test_rigid_bodies_hide_their_joints(client: int, tmp_path: Path) -> None:
    body = p.loadURDF(write(tmp_path, "r.urdf", ROBOT), useMaximalCoordinates=1)
    assert p.getNumJoints(body) == 0
    assert p.getDynamicsInfo(body, -1)[10] == 1
    assert p.getBodyInfo(body) == (b"", b"base")


@pytest.mark.parametrize(
    ("arguments", "keywords"), [((1, 2), {}), ((1, 2, 3, 4), {}), ((1, 2, 3), {"flags": 1})]
)
def test_the_old_form_takes_three_or_seven_numbers(
    client: int, tmp_path: Path, arguments: Any, keywords: Any
) -> None:
    with pytest.raises(TypeError, match="three numbers, or seven") as caught:
        p.loadURDF(write(tmp_path, "r.urdf", ROBOT), *arguments, **keywords)
    assert f"got {len(arguments)} numbers" in str(caught.value)


def test_the_old_names_of_the_old_form(client: int, tmp_path: Path) -> None:
    body = p.loadURDF(write(tmp_path, "r.urdf", ROBOT), startPosX=1, startPosY=2, startPosZ=3)
    assert p.getBasePositionAndOrientation(body)[0] == pytest.approx((1.1, 2, 3))


def test_a_missing_limit_is_explained_with_its_line(client: int, tmp_path: Path) -> None:
    text = ROBOT.replace('<limit lower="-1" upper="1" effort="5" velocity="2"/>', "")
    with pytest.raises(p.error, match="Cannot load URDF file") as caught:
        p.loadURDF(write(tmp_path, "limit.urdf", text))
    note = "\n".join(caught.value.__notes__)
    assert "a revolute joint needs a <limit>" in note
    assert 'joint "bend"' in note
    assert "limit.urdf:" in note


@pytest.mark.parametrize("place", ["visual", "collision"])
@pytest.mark.parametrize("name", ["missing.obj", "package://other/missing.stl", "notes.txt"])
def test_a_robot_whose_mesh_is_missing_is_not_loaded(
    client: int, tmp_path: Path, place: str, name: str
) -> None:
    (tmp_path / "notes.txt").write_text("no mesh")
    shape = f'<{place}><geometry><mesh filename="{name}"/></geometry></{place}>'
    text = f'<robot name="r"><link name="a">{shape}</link></robot>'
    with pytest.raises(p.error, match="Cannot load URDF file"):
        p.loadURDF(write(tmp_path, "mesh.urdf", text))
    assert p.getNumBodies() == 0


@pytest.mark.parametrize("content", ["", "# nothing\n", "v 0 0 0\nv 1 0 0\nv 0 1 0\n"])
def test_a_mesh_file_without_triangles_makes_no_collision_shape(
    client: int, tmp_path: Path, content: str
) -> None:
    file = write(tmp_path, "empty.obj", content)
    for flags in (0, p.GEOM_FORCE_CONCAVE_TRIMESH):
        with pytest.raises(p.error, match=r"createCollisionShape failed\."):
            p.createCollisionShape(p.GEOM_MESH, fileName=file, flags=flags)


def test_self_collision_is_a_flag(client: int, tmp_path: Path) -> None:
    """Two links on one base that overlap meet only with URDF_USE_SELF_COLLISION."""
    links = "".join(
        f'<link name="{name}"><inertial><mass value="1"/></inertial><collision><geometry>'
        f'<sphere radius="0.2"/></geometry></collision></link><joint name="j{name}" type="continuous">'
        f'<parent link="base"/>'
        f'<child link="{name}"/><origin xyz="{x} 0 0"/><axis xyz="1 0 0"/></joint>'
        for name, x in (("a", 0.1), ("b", -0.1))
    )
    file = write(tmp_path, "pair.urdf", f'<robot name="r"><link name="base"/>{links}</robot>')
    for flags, contacts in ((0, 0), (p.URDF_USE_SELF_COLLISION, 1)):
        p.resetSimulation()
        body = p.loadURDF(file, useFixedBase=1, flags=flags)
        p.performCollisionDetection()
        assert bool(p.getContactPoints(body, body)) == bool(contacts)


@pytest.mark.parametrize(
    ("behind", "loads"),
    [
        ("\n\n</robot>\n", True),
        ("\n<!-- end -->\n", True),
        ("\n\0", True),
        ("\n\0words", True),
        ('\n<robot name="s"><link name="b"/></robot>\n', True),
        ("\nsome words\n", False),
        ("\n<link>\n", False),
    ],
)
def test_what_stands_behind_the_root_element(client: int, tmp_path: Path, behind: str, loads: bool) -> None:
    file = tmp_path / "a.urdf"
    file.write_text('<robot name="r"><link name="a"/></robot>' + behind)
    if loads:
        assert p.getBodyInfo(p.loadURDF(str(file))) == (b"a", b"r")
    else:
        with pytest.raises(p.error, match=r"^Cannot load URDF file"):
            p.loadURDF(str(file))


def record_collisions_with_ancestors(p: Any, folder: Path) -> Any:
    """Three boxes in a row of joints at one place: which pairs touch, by the flags of self-collision."""
    link = (
        '<link name="{0}"><inertial><mass value="1"/>'
        '<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'
        '<collision><geometry><box size="0.2 0.2 0.2"/></geometry></collision></link>'
    )
    joint = (
        '<joint name="to_{1}" type="revolute"><parent link="{0}"/><child link="{1}"/><axis xyz="0 0 1"/>'
        '<origin xyz="0.05 0 0"/><limit lower="-1" upper="1" effort="1" velocity="1"/></joint>'
    )
    parts = [link.format(name) for name in "abcd"] + [joint.format(*pair) for pair in ("ab", "bc", "cd")]
    file = folder / "boxes.urdf"
    file.write_text('<robot name="boxes">' + "".join(parts) + "</robot>")
    found = []
    for flags in (0, 8, 8 | 16, 8 | 32):
        body = p.loadURDF(str(file), [0, 0, 1], flags=flags)
        p.performCollisionDetection()
        pairs = {tuple(sorted(point[3:5])) for point in p.getContactPoints(body, body)}
        if flags & 32:  # no filter lets them touch again
            p.setCollisionFilterPair(body, body, -1, 2, 1)
            p.performCollisionDetection()
            pairs |= {tuple(sorted(point[3:5])) for point in p.getContactPoints(body, body)}
        found.append(sorted(pairs))
        p.removeBody(body)
    return found


def test_collisions_with_ancestors(agrees: Callable[..., None]) -> None:
    agrees(record_collisions_with_ancestors)


def record_search_order(p: Any, folder: Path) -> list[float | str]:
    """Masses of files of one name, by the folder in which it is found: beside, in data folders, searched."""
    text = ROBOT.replace('<mass value="1"/>', '<mass value="{}"/>')
    places = {"work": 1.0, "work/data": 2.0, "data": 3.0, "searched": 4.0, "searched/data": 5.0}
    for place, mass in places.items():
        (folder / place).mkdir(parents=True)
        write(folder / place, "same.urdf", text.format(mass))
    before = Path.cwd()
    os.chdir(folder / "work")
    p.setPhysicsEngineParameter(enableFileCaching=0)
    p.setAdditionalSearchPath(str(folder / "searched"))
    found: list[float | str] = []
    try:
        for place in places:
            found.append(p.getDynamicsInfo(p.loadURDF("same.urdf"), -1)[0])
            (folder / place / "same.urdf").unlink()
            if place == "searched":
                break
        found.extend(message_of(lambda: p.loadURDF("same.urdf"))[:2])
    finally:
        os.chdir(before)
    return found


def record_searched_by_all_clients(p: Any, folder: Path) -> list[list[str]]:
    """The folder of one client is searched by another, after a reset, and by the one that connects next."""
    write(folder, "only.urdf", ROBOT)
    other = p.connect(p.DIRECT)
    p.setAdditionalSearchPath(str(folder), physicsClientId=other)
    found = [message_of(lambda: p.loadURDF("only.urdf"))]
    p.resetSimulation()
    found.append(message_of(lambda: p.loadURDF("only.urdf")))
    p.disconnect(other)
    last = p.connect(p.DIRECT)
    found.append(message_of(lambda: p.loadURDF("only.urdf", physicsClientId=last)))
    p.setAdditionalSearchPath(str(folder / "none"), physicsClientId=last)
    found.append(message_of(lambda: p.loadURDF("only.urdf")))
    p.disconnect(last)
    return found


def test_data_folders_come_before_the_searched_one(agrees: Callable[..., None]) -> None:
    agrees(record_search_order)


def test_all_clients_search_one_folder(agrees: Callable[..., None]) -> None:
    agrees(record_searched_by_all_clients)


@pytest.mark.parametrize(
    ("kind", "expected"),
    [("fixed", (0, 0, 0, -1, 0, 0)), ("revolute", (2, 3, -1e16, 1e16, 0, 0))],
)
def test_fixed_joints_of_sdf_files_have_no_limits(
    client: int, tmp_path: Path, kind: str, expected: tuple[float, ...]
) -> None:
    """Their axes are not read, as in PyBullet 3.2.7."""
    moments = "".join(f"<{key}>1</{key}>" for key in ("ixx", "iyy", "izz"))
    links = "".join(
        f'<link name="{name}"><inertial><mass>1</mass><inertia>{moments}</inertia></inertial></link>'
        for name in "ab"
    )
    axis = "<xyz>0 0 1</xyz><limit><lower>-1e+16</lower><upper>1e+16</upper></limit>"
    axis += "<dynamics><damping>2</damping><friction>3</friction></dynamics>"
    joint = f'<joint name="j" type="{kind}"><parent>a</parent><child>b</child><axis>{axis}</axis></joint>'
    file = tmp_path / "m.sdf"
    file.write_text(f'<sdf version="1.6"><model name="m">{links}{joint}</model></sdf>')
    (body,) = p.loadSDF(str(file))
    assert p.getJointInfo(body, 0)[6:12] == expected
