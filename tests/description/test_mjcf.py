"""MJCF files as robot descriptions: MuJoCo's own numbers for places, masses, limits and shapes."""

from __future__ import annotations

import struct
from pathlib import Path

import mujoco
import numpy as np
import pytest

from roboyard import cli
from roboyard.description import load_description
from roboyard.description.mjcf.build import read_mjcf
from roboyard.description.model import Box, Capsule, Mesh, RobotDescription, Sphere
from roboyard.errors import DescriptionError
from roboyard.kinematics.description_poses import forward_kinematics
from roboyard.sim import World

ROBOT = """
<mujoco model="walker">
  <compiler angle="radian" meshdir="parts"/>
  <asset><mesh name="wedge" file="wedge.obj" scale="2 1 1"/>
    <material name="red" rgba="1 0 0 1"/></asset>
  <worldbody>
    <geom type="plane" size="5 5 0.1"/>
    <body name="trunk" pos="0 0 1" quat="0.9 0.1 0.2 0.3">
      <freejoint/>
      <geom type="box" size="0.2 0.1 0.05" mass="4" material="red"/>
      <geom type="mesh" mesh="wedge" pos="0.1 0 0.2" euler="0.3 0.2 0.1" contype="0" conaffinity="0"/>
      <site name="imu" pos="0 0 0.1"/>
      <body name="arm" pos="0.2 0 0" euler="0 0.4 0">
        <joint name="swing" axis="0 1 0" pos="0 0 0.05" range="-1 2" damping="0.3" frictionloss="0.1"/>
        <joint name="twist" axis="0 0 1" ref="0.4"/>
        <geom type="capsule" fromto="0 0 0 0 0 -0.3" size="0.03" mass="1"/>
        <body name="slider" pos="0 0 -0.3">
          <joint name="slide" type="slide" axis="1 0 0" range="-0.1 0.2" ref="0.05"/>
          <geom type="sphere" size="0.05" mass="0.5" group="3"/>
          <body name="wrist" pos="0 0.1 0">
            <joint name="ball" type="ball"/>
            <geom type="ellipsoid" size="0.02 0.05 0.03" mass="0.2"/>
          </body>
        </body>
      </body>
      <body name="mirror" pos="-0.2 0 0">
        <joint name="follow" axis="0 1 0" range="-1 2"/>
        <geom type="cylinder" size="0.03 0.1" mass="1"/>
      </body>
    </body>
  </worldbody>
  <equality><joint joint1="follow" joint2="swing" polycoef="0.1 -2 0 0 0"/></equality>
  <actuator>
    <motor joint="swing" gear="20" ctrlrange="-1.5 1.5" ctrllimited="true"/>
    <position joint="slide" kp="50" forcerange="-8 8"/>
  </actuator>
  <tendon><fixed name="t"><joint joint="swing" coef="1"/></fixed></tendon>
</mujoco>
"""
WEDGE = "v 0 0 0\nv 0.1 0 0\nv 0 0.2 0\nv 0 0 0.3\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n"


@pytest.fixture
def file(tmp_path: Path) -> Path:
    """Write the robot and its mesh."""
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts" / "wedge.obj").write_text(WEDGE)
    path = tmp_path / "walker.xml"
    path.write_text(ROBOT)
    return path


Position = np.ndarray | float


def placed(description: RobotDescription, q: dict[str, Position], data, model) -> dict[str, np.ndarray]:
    """Return link poses in MuJoCo's world, the root where MuJoCo has it."""
    body = model.body(description.root.name).id
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = data.xmat[body].reshape(3, 3), data.xpos[body]
    return {name: T @ pose for name, pose in forward_kinematics(description, q).items()}


@pytest.mark.parametrize("seed", range(4))
def test_links_and_shapes_are_where_mujoco_has_them(file: Path, seed: int) -> None:
    description = read_mjcf(file)
    model = mujoco.MjModel.from_xml_path(str(file))
    data = mujoco.MjData(model)
    rng = np.random.default_rng(seed)
    q: dict[str, Position] = {n: rng.uniform(-0.1, 0.2) for n in ("swing", "twist", "slide", "follow")}
    for name, value in q.items():
        data.qpos[model.jnt_qposadr[model.joint(name).id]] = value
    ball = rng.normal(size=4)
    ball /= np.linalg.norm(ball)
    start = model.jnt_qposadr[model.joint("ball").id]
    data.qpos[start : start + 4] = ball
    q["ball"] = ball[[1, 2, 3, 0]]
    mujoco.mj_kinematics(model, data)
    poses = placed(description, q, data, model)
    for body in range(1, model.nbody):
        inertial = description.link_by_name[model.body(body).name].inertial
        assert inertial is not None
        T = poses[model.body(body).name] @ inertial.origin.matrix()
        np.testing.assert_allclose(T[:3, 3], data.xipos[body], atol=1e-9)
        inertia = T[:3, :3] @ inertial.matrix() @ T[:3, :3].T
        R = data.ximat[body].reshape(3, 3)
        np.testing.assert_allclose(inertia, R @ np.diag(model.body_inertia[body]) @ R.T, atol=1e-9)
        assert inertial.mass == model.body_mass[body]
    np.testing.assert_allclose(poses["imu"][:3, 3], data.site("imu").xpos, atol=1e-9)
    (wedge,) = [v for v in description.link_by_name["trunk"].visuals if isinstance(v.geometry, Mesh)]
    geom = next(g for g in range(model.ngeom) if model.geom_type[g] == mujoco.mjtGeom.mjGEOM_MESH)
    drawn = {tuple(np.round(v, 6)) for v in _vertices(model, data, geom)}
    corners = np.array([[0, 0, 0, 1], [0.2, 0, 0, 1], [0, 0.2, 0, 1], [0, 0, 0.3, 1]])  # scaled by 2 along x
    ours = (poses["trunk"] @ wedge.origin.matrix() @ corners.T).T[:, :3]
    assert wedge.geometry.scale == (2.0, 1.0, 1.0)  # type: ignore[union-attr]
    for corner in ours:
        assert min(np.linalg.norm(corner - np.array(v)) for v in drawn) < 1e-5


def _vertices(model, data, geom: int) -> np.ndarray:
    mesh = model.geom_dataid[geom]
    start, count = model.mesh_vertadr[mesh], model.mesh_vertnum[mesh]
    return (
        data.geom_xpos[geom] + model.mesh_vert[start : start + count] @ data.geom_xmat[geom].reshape(3, 3).T
    )


def test_joints_limits_and_couplings(file: Path) -> None:
    joints = read_mjcf(file).joint_by_name
    assert {name: joints[name].type for name in ("swing", "twist", "slide", "ball", "follow")} == {
        "swing": "revolute",
        "twist": "continuous",
        "slide": "prismatic",
        "ball": "spherical",
        "follow": "revolute",
    }
    swing = joints["swing"]
    assert swing.limit is not None
    assert (swing.limit.lower, swing.limit.upper, swing.limit.effort) == (-1.0, 2.0, 30.0)
    assert (swing.damping, swing.friction) == (0.3, 0.1)
    assert joints["slide"].limit is not None
    assert joints["slide"].limit.effort == 8.0
    mimic = joints["follow"].mimic
    assert mimic is not None
    assert (mimic.joint, mimic.multiplier, mimic.offset) == ("swing", -2.0, 0.1)


def test_shapes_and_notes(file: Path) -> None:
    description = read_mjcf(file)
    trunk, slider = description.link_by_name["trunk"], description.link_by_name["slider"]
    assert [type(shape.geometry) for shape in trunk.collisions] == [Box]
    assert trunk.visuals[0].material is not None
    assert trunk.visuals[0].material.rgba == (1.0, 0.0, 0.0, 1.0)
    assert (len(slider.visuals), [type(c.geometry) for c in slider.collisions]) == (0, [Sphere])  # group 3
    (ellipsoid,) = description.link_by_name["wrist"].collisions
    assert isinstance(ellipsoid.geometry, Capsule)
    assert ellipsoid.geometry.length + 2 * ellipsoid.geometry.radius == pytest.approx(0.1)
    assert ellipsoid.origin.matrix()[:3, 2] == pytest.approx([0, 1, 0])
    text = "\n".join(description.notes)
    assert "tendons" in text
    assert "bodies other than 'trunk'" in text


def test_images_of_meshes_are_kept_and_never_decoded(tmp_path: Path) -> None:
    """ANYmal's model has 80 million pixels; the second image here would be 16 GB."""
    (tmp_path / "w.obj").write_text(WEDGE)
    (tmp_path / "skins").mkdir()
    head = b"\x89PNG\r\n\x1a\n" + b"\0\0\0\rIHDR"
    (tmp_path / "skins" / "fur.png").write_bytes(head + struct.pack(">II", 64, 64) + b"\x08\x02\0\0\0")
    (tmp_path / "skins" / "big.png").write_bytes(head + struct.pack(">II", 65536, 65536) + b"\x08\x02\0\0\0")
    file = tmp_path / "cat.xml"
    file.write_text("""
        <mujoco><compiler texturedir="skins"/><asset><mesh name="w" file="w.obj"/>
          <texture name="fur" type="2d" file="fur.png"/><texture name="big" type="2d" file="big.png"/>
          <texture name="sky" type="cube" builtin="flat" width="9" height="9"/>
          <material name="fur" texture="fur" rgba="1 0.5 0 1"/><material name="sky" texture="sky"/>
          <material name="big"><layer role="rgb" texture="big"/></material></asset>
        <worldbody><body name="cat">
          <geom type="mesh" mesh="w" material="fur"/><geom type="mesh" mesh="w" material="big"/>
          <geom size="0.1" material="sky"/><geom size="0.1" material="fur"/>
        </body></worldbody></mujoco>""")
    description = load_description(file)
    materials = [visual.material for visual in description.root.visuals]
    assert [material and material.texture for material in materials] == [
        tmp_path / "skins" / "fur.png",
        tmp_path / "skins" / "big.png",
        None,
        None,
    ]
    assert materials[0] is not None
    assert materials[0].rgba == (1.0, 0.5, 0.0, 1.0)
    assert sum("not flat images on meshes" in note for note in description.notes) == 1


def test_every_command_takes_mjcf(file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    loaded = load_description(file)
    assert {link.name for link in loaded.links} == {link.name for link in read_mjcf(file).links}
    assert cli.main(["audit", str(file), "--json"]) == 0
    assert "tendons are omitted" in capsys.readouterr().out
    world = World()
    body = world.add_urdf(file)
    assert body.mass == pytest.approx(mujoco.MjModel.from_xml_path(str(file)).body_mass.sum(), rel=1e-3)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("<mujoco><worldbody/></mujoco>", "no <body>"),
        ("<mujoco><worldbody><body><geom/></body></worldbody></mujoco>", "MuJoCo cannot read it"),
        ('<mujoco><include file="/etc/passwd"/></mujoco>', "outside"),
    ],
)
def test_unusable_files_are_refused(tmp_path: Path, text: str, message: str) -> None:
    file = tmp_path / "bad.xml"
    file.write_text(text)
    with pytest.raises(DescriptionError, match=message):
        load_description(file)


def _closed(equality: str) -> str:
    return (
        '<mujoco><option gravity="0 0 -9.81"/><worldbody><body name="base"><geom size="0.01" mass="1"/>'
        '<body name="a"><joint name="ja" axis="0 1 0" pos="0 0 0.1"/><geom size="0.01" pos="0 0 1" mass="1"/>'
        '<site name="sa" pos="0 0 1" euler="0 0 30"/></body>'
        '<body name="b" pos="1 0 0" euler="0 0 20"><joint name="jb" axis="0 1 0"/>'
        '<geom size="0.01" pos="0 0 1" mass="1"/><site name="sb" pos="-1 0 1"/></body></body></worldbody>'
        f"<equality>{equality}</equality></mujoco>"
    )


@pytest.mark.parametrize(
    "equality",
    [
        '<connect name="c" body1="a" body2="b" anchor="0 0 1"/>',
        '<connect name="c" site1="sa" site2="sb"/>',
        '<weld name="c" body1="a" body2="b" anchor="0.1 0.2 0.3"/>',
        '<weld name="c" site1="sa" site2="sb"/>',
    ],
)
def test_equalities_that_close_loops_are_loop_joints(tmp_path, equality):
    """MuJoCo's own residual at any position is the distance of the two frames of the loop joint."""

    file = tmp_path / "closed.xml"
    file.write_text(_closed(equality))
    description = load_description(file)
    (loop,) = description.loops
    assert (loop.name, loop.first, loop.second) == ("c", "a", "b")
    assert loop.type == ("fixed" if "weld" in equality else "spherical")
    model = mujoco.MjModel.from_xml_path(str(file))
    data = mujoco.MjData(model)
    data.qpos[:] = 0.2, -0.3
    mujoco.mj_forward(model, data)
    poses = forward_kinematics(description, {"ja": 0.2, "jb": -0.3})
    first = poses["a"] @ loop.first_origin.matrix()
    second = poses["b"] @ loop.second_origin.matrix()
    np.testing.assert_allclose(first[:3, 3] - second[:3, 3], data.efc_pos[:3], atol=1e-9)
    if loop.type == "fixed":
        turn = first[:3, :3].T @ second[:3, :3]
        angle = np.arccos((np.trace(turn) - 1) / 2)
        assert np.linalg.norm(data.efc_pos[3:6]) == pytest.approx(abs(np.sin(angle / 2)), abs=1e-6)


def test_equalities_to_the_world_are_noted(tmp_path):
    file = tmp_path / "closed.xml"
    file.write_text(_closed('<connect body1="a" anchor="0 0 1"/>'))
    description = load_description(file)
    assert description.loops == ()
    assert any("does not join two links" in note for note in description.notes)
