"""loadSDF and loadMJCF: Bullet's links, names, frames and masses for files worked out by hand."""

from __future__ import annotations

from math import pi
from pathlib import Path

import numpy as np
import pytest

import roboyard.pybullet as p

TETRAHEDRON = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n"
"""An OBJ file."""
SDF = """<sdf version="1.6"><world name="default">
<model name="ground"><static>1</static><link name="slab"><pose>0 0 -0.5 0 0 0</pose>
  <collision name="c"><geometry><box><size>4 4 1</size></box></geometry></collision></link></model>
<model name="arm"><pose>1 0 2 0 0 1.5707963267948966</pose>
  <link name="base"><pose>0 0 0.1 0 0 0</pose>
    <inertial><pose>0 0 0.2 0 0 0</pose><mass>3</mass>
      <inertia><ixx>1</ixx><iyy>1</iyy><izz>1</izz></inertia></inertial>
    <visual name="v"><geometry><sphere><radius>0.1</radius></sphere></geometry>
      <material><diffuse>1 0 0 1</diffuse></material></visual></link>
  <link name="tip"><pose>0.5 0 0.1 0 0.3 0</pose><inertial><mass>1</mass></inertial>
    <collision name="c"><geometry><cylinder><radius>0.1</radius><length>0.4</length></cylinder></geometry>
    </collision></link>
  <joint name="hinge" type="revolute"><parent>base</parent><child>tip</child>
    <axis><xyz>0 1 0</xyz><limit><lower>-1</lower><upper>2</upper><effort>5</effort></limit>
    <dynamics><damping>0.25</damping></dynamics></axis></joint>
</model></world></sdf>"""

MJCF = """<mujoco model="toy"><compiler angle="degree"/>
<default><joint limited="true"/><geom friction="0.7 0.1 0.1"/></default>
<worldbody><geom name="floor" type="plane" size="1 1 1"/>
<body name="swing" pos="0 0 2">
  <joint name="first" type="hinge" axis="0 1 0" range="-90 45" pos="0 0 0.5"/>
  <joint name="second" type="slide" axis="0 0 1" limited="false" pos="0 0 0.5"/>
  <geom type="capsule" fromto="0 0 0 0 0 -0.4" size="0.1"/>
  <body pos="0 0 -0.5"><geom type="box" size="0.1 0.2 0.3" contype="0" conaffinity="0" friction="0.9"/></body>
</body>
<body name="loose" pos="2 0 1"><joint type="free"/><geom type="sphere" size="0.2"/></body>
</worldbody></mujoco>"""


@pytest.fixture
def sdf(client: int, tmp_path: Path) -> tuple[int, ...]:
    (tmp_path / "arm.sdf").write_text(SDF)
    return p.loadSDF(str(tmp_path / "arm.sdf"))


@pytest.fixture
def mjcf(client: int, tmp_path: Path) -> tuple[int, ...]:
    (tmp_path / "toy.xml").write_text(MJCF)
    return p.loadMJCF(str(tmp_path / "toy.xml"))


def test_an_sdf_gives_one_body_per_model(sdf: tuple[int, ...]) -> None:
    assert sdf == (0, 1)
    assert [p.getBodyInfo(body) for body in sdf] == [(b"slab", b"ground"), (b"base", b"arm")]
    assert p.getDynamicsInfo(0, -1)[0] == 0.0, "a static model has no mass"


def test_an_sdf_that_has_changed_is_read_again(client: int, tmp_path: Path) -> None:
    file = tmp_path / "arm.sdf"
    for mass in (3, 4, 25):
        file.write_text(SDF.replace("<mass>3</mass>", f"<mass>{mass}</mass>"))
        for scale in (1.0, 2.0, 1.0):
            _, arm = p.loadSDF(str(file), globalScaling=scale)
            assert p.getDynamicsInfo(arm, -1)[0] == mass
            assert np.allclose(p.getBasePositionAndOrientation(arm)[0], [scale, 0, 2.3 * scale])
            p.changeDynamics(arm, -1, mass=7)
    assert p.getDynamicsInfo(1, -1)[0] == 7


def test_an_sdf_finds_meshes_that_came_later(client: int, tmp_path: Path) -> None:
    file = tmp_path / "mesh.sdf"
    file.write_text(
        '<sdf version="1.6"><model name="a"><link name="b"><collision name="c"><geometry><mesh>'
        "<uri>m.obj</uri></mesh></geometry></collision></link></model></sdf>"
    )
    with pytest.raises(p.error, match=r"Cannot load SDF file\.[\s\S]*m\.obj"):
        p.loadSDF(str(file))
    assert p.getNumBodies() == 0
    (tmp_path / "m.obj").write_text(TETRAHEDRON)
    (body,) = p.loadSDF(str(file))
    assert b"m.obj" in p.getCollisionShapeData(body, -1)[0][4]


def test_meshes_of_an_sdf_with_a_leading_slash_are_beside_it(client: int, tmp_path: Path) -> None:
    (tmp_path / "meshes").mkdir()
    (tmp_path / "meshes" / "m.obj").write_text(TETRAHEDRON)
    file = tmp_path / "mesh.sdf"
    file.write_text(
        '<sdf version="1.6"><model name="a"><link name="b"><collision name="c"><geometry><mesh>'
        "<uri>/meshes/m.obj</uri></mesh></geometry></collision></link></model></sdf>"
    )
    (body,) = p.loadSDF(str(file))
    assert b"m.obj" in p.getCollisionShapeData(body, -1)[0][4]


def test_poses_of_an_sdf_nest(sdf: tuple[int, ...]) -> None:
    position, turn = p.getBasePositionAndOrientation(1)
    assert np.allclose(position, [1, 0, 2 + 0.1 + 0.2])
    assert np.allclose(turn, [0, 0, np.sqrt(0.5), np.sqrt(0.5)])
    link = p.getLinkState(1, 0)
    assert np.allclose(link[4], [1, 0.5, 2.1], atol=1e-6)
    assert np.allclose(p.getEulerFromQuaternion(link[5]), [0, 0.3, pi / 2], atol=1e-6)


def test_an_sdf_joint(sdf: tuple[int, ...]) -> None:
    info = p.getJointInfo(1, 0)
    assert info[1:3] == (b"hinge", p.JOINT_REVOLUTE)
    assert info[6] == 0.25
    assert info[8:12] == (-1.0, 2.0, 5.0, 0.0)
    assert info[12:14] == (b"tip", (0.0, 1.0, 0.0))
    assert p.getVisualShapeData(1)[0][7] == (1.0, 0.0, 0.0, 1.0)


def test_an_sdf_grows(client: int, tmp_path: Path) -> None:
    (tmp_path / "arm.sdf").write_text(SDF)
    _, arm = p.loadSDF(str(tmp_path / "arm.sdf"), globalScaling=2.0)
    assert np.allclose(p.getBasePositionAndOrientation(arm)[0], [2, 0, 4.6])


def test_an_mjcf_makes_a_link_of_every_joint(mjcf: tuple[int, ...]) -> None:
    assert len(mjcf) == 3
    assert [p.getBodyInfo(body) for body in mjcf] == [
        (b"floor", b"toy"), (b"link1_1", b"toy"), (b"loose", b"toy")
    ]  # fmt: skip
    infos = [p.getJointInfo(mjcf[1], j) for j in range(p.getNumJoints(mjcf[1]))]
    kinds = [info[2] for info in infos]
    assert kinds == [p.JOINT_REVOLUTE, p.JOINT_PRISMATIC, p.JOINT_FIXED, p.JOINT_FIXED]
    assert [info[12] for info in infos] == [b"link1_2", b"link1_3", b"swing", b"link1_4"]
    assert infos[0][1] == b"first"
    assert infos[2][1].startswith(b"jointfix_")
    assert infos[2][1].endswith(b"_3"), "the number of the link it hangs from"
    assert infos[0][8:10] == pytest.approx((-pi / 2, pi / 4))
    assert infos[1][8:10] == (1.0, 0.0), "without a range"


def test_an_mjcf_that_is_loaded_again_goes_on_counting(client: int, tmp_path: Path) -> None:
    """Bullet counts joints and bodies without a name as long as the process runs: here two in each load."""
    file = tmp_path / "toy.xml"
    file.write_text(MJCF)
    numbers, data = [], []
    for turn in range(4):
        if turn == 2:
            p.resetSimulation()
        if turn == 3:
            p.setPhysicsEngineParameter(enableFileCaching=0)
        _, body, _ = p.loadMJCF(str(file))
        infos = [p.getJointInfo(body, j) for j in range(p.getNumJoints(body))]
        assert [info[0] for info in infos] == [0, 1, 2, 3]
        assert infos[0][1] == b"first"
        numbers.append([int(info[1].decode().split("_")[1]) for info in infos[2:]])
        data.append(
            (p.getDynamicsInfo(body, 2)[:4], p.getLinkState(body, 3)[:2], [info[2:] for info in infos])
        )
    start = numbers[0][1]
    assert numbers == [[start + 3 * turn + 1, start + 3 * turn] for turn in range(4)], "as PyBullet 3.2.7"
    assert data[0] == data[1] == data[2] == data[3]


def test_an_mjcf_that_has_changed_is_read_again(client: int, tmp_path: Path) -> None:
    file = tmp_path / "toy.xml"
    for width, mesh in ((0.1, ""), (0.25, ""), (0.3, '<asset><mesh name="m" file="m.obj"/></asset>')):
        file.write_text(
            MJCF.replace("<default>", mesh + "<default>").replace("0.1 0.2 0.3", f"{width} 0.2 0.3")
        )
        for _ in range(2):
            _, body, _ = p.loadMJCF(str(file))
            assert p.getDynamicsInfo(body, 3)[0] == pytest.approx(1000 * 8 * width * 0.2 * 0.3)


def test_an_mjcf_finds_meshes_that_came_later(client: int, tmp_path: Path) -> None:
    file = tmp_path / "toy.xml"
    file.write_text(
        '<mujoco><asset><mesh name="m" file="m.obj"/></asset><worldbody><body name="a" pos="0 0 1">'
        '<joint type="free"/><geom type="mesh" mesh="m"/></body></worldbody></mujoco>'
    )
    (first,) = p.loadMJCF(str(file))
    assert p.getCollisionShapeData(first, -1) == ()
    (tmp_path / "m.obj").write_text(TETRAHEDRON)
    (second,) = p.loadMJCF(str(file))
    assert len(p.getCollisionShapeData(second, -1)) == 1


def test_masses_of_an_mjcf_follow_from_volumes(mjcf: tuple[int, ...]) -> None:
    capsule = 1000 * (pi * 0.01 * 0.4 + 4 / 3 * pi * 0.001)
    assert p.getDynamicsInfo(mjcf[1], 2)[0] == pytest.approx(capsule)
    assert p.getDynamicsInfo(mjcf[1], 2)[3] == pytest.approx((0, 0, -0.2)), "between the two ends"
    assert p.getDynamicsInfo(mjcf[1], 3)[0] == pytest.approx(1000 * 8 * 0.1 * 0.2 * 0.3)
    assert p.getDynamicsInfo(mjcf[1], -1)[0] == 0.0
    frictions = [p.getDynamicsInfo(mjcf[1], link)[1] for link in (2, 3)]
    assert frictions == [0.699999988079071, 0.8999999761581421], "in single precision, as in PyBullet"


def test_an_mjcf_chain_hangs_and_turns_about_its_joint(mjcf: tuple[int, ...]) -> None:
    body = mjcf[1]
    p.resetJointState(body, 0, 0.5)
    position = np.array(p.getLinkState(body, 2)[4])
    assert np.allclose(position, [-0.5 * np.sin(0.5), 0, 2.5 - 0.5 * np.cos(0.5)], atol=1e-6)


def test_a_free_body_of_an_mjcf_falls_onto_the_floor(mjcf: tuple[int, ...]) -> None:
    assert np.allclose(p.getBasePositionAndOrientation(mjcf[2])[0], [2, 0, 1])
    p.setGravity(0, 0, -10)
    for _ in range(480):
        p.stepSimulation()
    assert p.getBasePositionAndOrientation(mjcf[2])[0][2] == pytest.approx(0.2, abs=2e-3)


def test_contype_and_conaffinity_filter(mjcf: tuple[int, ...]) -> None:
    shape = p.createCollisionShape(p.GEOM_BOX, halfExtents=[1, 1, 1])
    block = p.createMultiBody(0, shape, basePosition=[0, 0, 1.5])
    p.performCollisionDetection()
    touched = {contact[3] for contact in p.getContactPoints(mjcf[1], block)}
    assert touched == {2}, "the box has contype 0 and conaffinity 0"


def test_files_that_cannot_be_used(client: int, tmp_path: Path) -> None:
    with pytest.raises(p.error, match=r"Cannot load SDF file\."):
        p.loadSDF("missing.sdf")
    with pytest.raises(p.error, match=r"Couldn't load \.mjcf file\."):
        p.loadMJCF("missing.xml")
    (tmp_path / "bad.sdf").write_text(SDF.replace("0.5 0 0.1 0 0.3 0", "0.5 zero"))
    with pytest.raises(p.error, match=r"Cannot load SDF file\.") as caught:
        p.loadSDF(str(tmp_path / "bad.sdf"))
    assert "six finite numbers" in " ".join(caught.value.__notes__)
    (tmp_path / "bad.xml").write_text(MJCF.replace("0.1 0.2 0.3", "0.1 nan 0.3"))
    with pytest.raises(p.error, match=r"Couldn't load \.mjcf file\.") as caught:
        p.loadMJCF(str(tmp_path / "bad.xml"))
    assert "bad.xml:8" in " ".join(caught.value.__notes__)


CONTYPES = {
    ((1, 0), (1, 0)): False, ((1, 0), (0, 1)): True, ((0, 1), (0, 1)): False, ((0, 1), (1, 0)): True,
    ((1, 1), (0, 1)): True, ((1, 1), (0, 0)): False, ((0, 0), (1, 1)): False, ((2, 4), (4, 2)): True,
    ((2, 2), (1, 1)): False, ((3, 0), (0, 2)): True,
}  # fmt: skip
"""(contype, conaffinity) of a plane and of a ball: whether PyBullet 3.2.7 lets the ball rest on the plane."""


@pytest.mark.parametrize(("bits", "rests"), list(CONTYPES.items()))
def test_shapes_touch_where_one_contype_meets_the_other_conaffinity(
    client: int, tmp_path: Path, bits: tuple[tuple[int, int], tuple[int, int]], rests: bool
) -> None:
    plane, ball = (f'contype="{own}" conaffinity="{other}"' for own, other in bits)
    (tmp_path / "plane.xml").write_text(
        f'<mujoco><worldbody><geom type="plane" size="5 5 .1" {plane}/></worldbody></mujoco>'
    )
    (tmp_path / "ball.xml").write_text(
        '<mujoco><worldbody><body pos="0 0 .11"><joint type="free"/>'
        f'<geom type="sphere" size=".1" {ball}/></body></worldbody></mujoco>'
    )
    p.setGravity(0, 0, -10)
    p.loadMJCF(str(tmp_path / "plane.xml"))
    (body,) = p.loadMJCF(str(tmp_path / "ball.xml"))
    for _ in range(60):
        p.stepSimulation()
    assert (p.getBasePositionAndOrientation(body)[0][2] > 0.09) == rests


@pytest.mark.parametrize(
    ("bit", "height", "touching"),
    [
        (0, -0.15, []),
        (1, -0.15, [(-1, 3), (1, 3)]),
        (1, -0.2, [(-1, 3)]),
    ],  # link 2, fixed to 3, is the parent
)
def test_contype_and_conaffinity_0_collide_with_nothing_within_their_body(
    client: int, tmp_path: Path, bit: int, height: float, touching: list[tuple[int, int]]
) -> None:
    """Link 2, fixed to 3, is its parent. In the last case links 1 and 3 touch but for rounding."""
    ball = f'<geom type="sphere" size="0.1" contype="{bit}" conaffinity="{bit}"/>'
    (tmp_path / "tree.xml").write_text(
        f'<mujoco><worldbody><body pos="0 0 1">{ball}'
        f'<body pos="0 0 .3"><joint type="hinge" axis="0 1 0"/>{ball}'
        f'<body pos="0 0 {height}"><joint type="hinge" axis="0 1 0"/>{ball}</body>'
        "</body></body></worldbody></mujoco>"
    )
    p.loadMJCF(str(tmp_path / "tree.xml"), flags=p.URDF_USE_SELF_COLLISION)
    p.stepSimulation()
    assert sorted(point[3:5] for point in p.getContactPoints()) == touching


@pytest.mark.parametrize(
    ("compiler", "upper"),
    [
        ("", 60.0),
        ("<compiler/>", 1.0471976),
        ('<compiler angle="degree"/>', 1.0471976),
        ('<compiler angle="radian"/>', 60.0),
    ],
)
def test_angles_of_mjcf_are_radians_without_a_compiler_element(
    client: int, tmp_path: Path, compiler: str, upper: float
) -> None:
    """As PyBullet 3.2.7 reads them; MuJoCo itself takes degrees."""
    (tmp_path / "a.xml").write_text(
        f'<mujoco>{compiler}<worldbody><body><geom type="sphere" size=".2"/><body pos=".4 0 0">'
        '<joint name="j" type="hinge" range="-10 60" limited="true"/><geom type="sphere" size=".1"/>'
        "</body></body></worldbody></mujoco>"
    )
    body = p.loadMJCF(str(tmp_path / "a.xml"))[0]
    assert p.getJointInfo(body, 0)[9] == pytest.approx(upper, abs=1e-5)
