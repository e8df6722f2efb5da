"""The MJCF, as stock MuJoCo understands it."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pytest

from roboyard.description import Collision, Cylinder, Limit, Link, Mesh, Visual
from roboyard.description.robot_model import RobotModel
from roboyard.description.semantic import TUCK
from roboyard.export import mjcf
from roboyard.kinematics.description_poses import forward_kinematics
from roboyard.shapes import primitives
from roboyard.transforms import matrix_from_quaternion


@pytest.fixture
def model(robot: RobotModel, tmp_path: Path) -> mujoco.MjModel:
    mjcf.write(robot, tmp_path / "robot.xml")
    return mujoco.MjModel.from_xml_path(str(tmp_path / "robot.xml"))


def load(robot: RobotModel, folder: Path, **options: bool) -> mujoco.MjModel:
    mjcf.write(robot, folder / "robot.xml", **options)
    return mujoco.MjModel.from_xml_path(str(folder / "robot.xml"))


def changed(robot: RobotModel, joint: str, **fields: object) -> RobotModel:
    """The robot with fields of one joint replaced."""
    joints = tuple(
        replace(j, **fields) if j.name == joint else j  # type: ignore[arg-type]
        for j in robot.description.joints
    )
    return replace(robot, description=replace(robot.description, joints=joints))


def test_names_are_kept(robot: RobotModel, model: mujoco.MjModel) -> None:
    bodies = {model.body(i).name for i in range(1, model.nbody)}
    assert bodies == {link.name for link in robot.description.links}
    joints = {model.joint(i).name for i in range(model.njnt)}
    expected = {"0", "1", "slide", "spin", "grip", "grip_follower", "flat_x", "flat_y", "flat_r", "ball"}
    assert joints == expected


def test_masses_and_tensors_are_exact(robot: RobotModel, model: mujoco.MjModel) -> None:
    for link in robot.description.links:
        if link.inertial is None:
            continue
        body = model.body(link.name)
        w, x, y, z = body.iquat
        axes = matrix_from_quaternion((x, y, z, w))
        turn = matrix_from_quaternion(link.inertial.origin.quaternion)
        assert body.mass[0] == link.inertial.mass
        assert np.allclose(body.ipos, link.inertial.origin.position, atol=1e-12)
        tensor = turn @ link.inertial.matrix() @ turn.T
        assert np.allclose(axes @ np.diag(body.inertia) @ axes.T, tensor, atol=1e-12)


def test_links_stand_where_the_description_says(robot: RobotModel, model: mujoco.MjModel) -> None:
    data = mujoco.MjData(model)
    given = {"0": 0.4, "1": -0.3, "slide": 0.2, "spin": 2.0, "grip": 0.03, "grip_follower": 0.02}
    for name, value in given.items():
        data.joint(name).qpos[0] = value
    for name, value in zip(("flat_x", "flat_y", "flat_r"), (0.1, -0.2, 0.3), strict=True):
        data.joint(name).qpos[0] = value
    mujoco.mj_kinematics(model, data)
    poses = forward_kinematics(robot.description, {**given, "flat": [0.1, -0.2, 0.3]})
    for link, pose in poses.items():
        assert np.allclose(data.body(link).xpos, pose[:3, 3], atol=1e-9)
        assert np.allclose(data.body(link).xmat.reshape(3, 3), pose[:3, :3], atol=1e-9)


def test_limits(model: mujoco.MjModel) -> None:
    assert model.joint("0").range.tolist() == [-1.5, 2.0]
    assert model.joint("slide").range.tolist() == [0.0, 0.3]
    assert model.jnt_limited[model.joint("spin").id] == 0
    assert model.joint("0").damping[0] == 0.5
    assert model.joint("0").frictionloss[0] == 0.1


def test_a_joint_locked_by_its_limits_loads(robot: RobotModel, tmp_path: Path) -> None:
    model = load(changed(robot, "0", limit=Limit(lower=0.3, upper=0.3)), tmp_path)
    lower, upper = model.joint("0").range
    assert lower < 0.3 < upper and upper - lower < 1e-8


def test_an_enormous_limit_is_none(robot: RobotModel, tmp_path: Path) -> None:
    model = load(changed(robot, "0", limit=Limit(lower=-1e16, upper=1e16)), tmp_path)
    assert model.jnt_limited[model.joint("0").id] == 0


def test_a_follower_follows(model: mujoco.MjModel) -> None:
    data = mujoco.MjData(model)
    model.opt.gravity[:] = 0
    data.actuator("grip").ctrl[0] = 0.03
    for _ in range(1500):
        mujoco.mj_step(model, data)
    leader, follower = data.joint("grip").qpos[0], data.joint("grip_follower").qpos[0]
    assert leader == pytest.approx(0.03, abs=1e-3)
    assert follower == pytest.approx(1.5 * leader + 0.01, abs=1e-3)


def test_position_drives_reach_their_targets_against_gravity(model: mujoco.MjModel) -> None:
    data = mujoco.MjData(model)
    targets = {"0": 0.5, "slide": 0.1}
    for name, value in targets.items():
        data.actuator(name).ctrl[0] = value
    for _ in range(2000):
        mujoco.mj_step(model, data)
    for name, value in targets.items():
        assert data.joint(name).qpos[0] == pytest.approx(value, abs=0.03)


def test_a_velocity_drive_keeps_its_speed(model: mujoco.MjModel) -> None:
    data = mujoco.MjData(model)
    model.opt.gravity[:] = 0
    data.actuator("spin").ctrl[0] = 2.0
    for _ in range(1000):
        mujoco.mj_step(model, data)
    assert data.joint("spin").qvel[0] == pytest.approx(2.0, rel=0.05)


def test_actuators_keep_to_the_effort_limits(model: mujoco.MjModel) -> None:
    assert {model.actuator(i).name for i in range(model.nu)} == {"0", "1", "slide", "spin", "grip"}
    assert model.actuator("0").forcerange.tolist() == [-80.0, 80.0]
    assert model.actuator("1").ctrlrange.tolist() == [-40.0, 40.0]  # a motor commands the torque itself
    assert model.actuator("0").ctrlrange.tolist() == [-1.5, 2.0]


def test_shapes_have_their_classes(model: mujoco.MjModel) -> None:
    visual, collision = model.geom_group == 2, model.geom_group == 3
    assert (visual | collision).all()
    assert not model.geom_contype[visual].any() and not model.geom_conaffinity[visual].any()
    assert (model.geom_contype[collision] == 1).all()
    base = model.body("base").id
    box = np.flatnonzero((model.geom_bodyid == base) & collision)
    assert model.geom_size[box[0]].tolist() == pytest.approx([0.2, 0.15, 0.1])
    assert model.geom_friction[box[0]].tolist() == pytest.approx([0.7, 0.005, 0.0001])


def test_a_mesh_of_two_colours_becomes_two_geoms(model: mujoco.MjModel) -> None:
    geoms = np.flatnonzero((model.geom_bodyid == model.body("arm.1").id) & (model.geom_group == 2))
    colors = {tuple(np.round(model.mat_rgba[model.geom_matid[g]], 3).tolist()) for g in geoms}
    assert colors == {(1.0, 0.0, 0.0, 1.0), (0.0, 0.0, 1.0, 1.0)}
    faces = [int(model.mesh_facenum[model.geom_dataid[g]]) for g in geoms]
    assert sorted(faces) == [2, 10]


def test_a_mesh_of_too_many_faces_for_an_stl_file_is_written_in_pieces(
    robot: RobotModel, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The box of two colours, as if an STL file held four faces: its ten faces of one colour become three
    pieces of the same area in all.
    """

    def faces_and_areas(model: mujoco.MjModel) -> tuple[list[int], dict[int, float]]:
        faces, areas = [], {}
        for geom in np.flatnonzero((model.geom_bodyid == model.body("arm.1").id) & (model.geom_group == 2)):
            mesh = model.mesh(model.geom_dataid[geom])
            first, count = int(mesh.vertadr[0]), int(mesh.vertnum[0])
            points = model.mesh_vert[first : first + count].astype(float)
            used = model.mesh_face[int(mesh.faceadr[0]) : int(mesh.faceadr[0]) + int(mesh.facenum[0])]
            a, b, c = (points[used[:, k]] for k in range(3))
            area = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1).sum()
            color = int(model.geom_matid[geom])
            areas[color] = areas.get(color, 0.0) + float(area)
            faces.append(int(mesh.facenum[0]))
        return sorted(faces), areas

    whole, areas = faces_and_areas(load(robot, tmp_path / "whole"))
    monkeypatch.setattr("roboyard.export.mjcf.geoms.STL_MAX_FACES", 4)
    pieces, same = faces_and_areas(load(robot, tmp_path / "pieces"))
    assert (whole, pieces) == ([2, 10], [2, 3, 3, 4])
    assert same == pytest.approx(areas)


def test_collision_meshes_become_hulls_once(robot: RobotModel, model: mujoco.MjModel) -> None:
    arm, puck = (
        np.flatnonzero((model.geom_bodyid == model.body(name).id) & (model.geom_group == 3))[0]
        for name in ("arm.1", "puck")
    )
    assert model.geom_dataid[arm] == model.geom_dataid[puck]
    assert model.mesh_vertnum[model.geom_dataid[arm]] == 8


def test_mesh_geoms_stand_where_they_should(model: mujoco.MjModel) -> None:
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    geom = np.flatnonzero((model.geom_bodyid == model.body("puck").id) & (model.geom_group == 3))[0]
    mesh = model.geom_dataid[geom]
    start, count = model.mesh_vertadr[mesh], model.mesh_vertnum[mesh]
    corners = model.mesh_vert[start : start + count] @ data.geom_xmat[geom].reshape(3, 3).T
    corners = corners + data.geom_xpos[geom]
    puck = data.body("puck")
    local = (corners - puck.xpos) @ puck.xmat.reshape(3, 3)
    assert np.allclose(np.abs(local), [0.1, 0.05, 0.05], atol=1e-6)


def test_a_wheel_becomes_its_bounding_sphere(robot: RobotModel, tmp_path: Path) -> None:
    model = load(replace(robot, approximations={"puck": "boundingSphere"}), tmp_path)
    geom = np.flatnonzero((model.geom_bodyid == model.body("puck").id) & (model.geom_group == 3))[0]
    assert model.geom_type[geom] == mujoco.mjtGeom.mjGEOM_SPHERE
    assert model.geom_size[geom][0] == pytest.approx(np.linalg.norm([0.1, 0.05, 0.05]))


def test_joined_and_overlapping_links_do_not_push(model: mujoco.MjModel) -> None:
    excluded = set()
    for signature in model.exclude_signature:
        one, two = divmod(int(signature), 1 << 16)
        excluded.add(frozenset((model.body(one).name, model.body(two).name)))
    assert frozenset(("base", "arm.1")) in excluded
    assert frozenset(("base", "puck")) in excluded
    assert frozenset(("10", "finger_a")) in excluded, "tool between them has no shape"
    assert frozenset(("arm.1", "arm 1")) not in excluded


def test_sensors(model: mujoco.MjModel, robot: RobotModel) -> None:
    data = mujoco.MjData(model)
    data.joint("0").qpos[0] = 0.7
    mujoco.mj_forward(model, data)
    assert data.sensor("0_position").data[0] == 0.7
    marker = data.site("tool_visual_sphere").xpos
    assert np.allclose(data.sensor("tool_visual_sphere_position").data, marker)
    camera = model.cam("tool_camera")
    assert camera.fovy[0] == pytest.approx(48.43, abs=0.01)
    w, x, y, z = camera.quat
    assert np.allclose(
        matrix_from_quaternion((x, y, z, w)),
        matrix_from_quaternion(robot.sensors[1].offset.quaternion),
    )


def test_the_rest_posture_is_a_keyframe(robot: RobotModel, model: mujoco.MjModel) -> None:
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, model.key("home").id)
    assert data.joint("0").qpos[0] == 0.25
    assert data.joint("slide").qpos[0] == 0.1
    assert data.joint("grip").qpos[0] == 0.04, "kept where it is locked"
    assert data.joint("grip_follower").qpos[0] == pytest.approx(0.07)
    assert np.allclose(data.joint("ball").qpos, [1, 0, 0, 0])
    assert data.actuator("0").ctrl[0] == 0.25


def test_keyframes_stand_on_the_floor(robot: RobotModel, tmp_path: Path) -> None:
    """`home` and `tuck`, with the lowest point of the collision shapes at z = 0."""
    tucked = replace(
        robot, semantic=replace(robot.semantic, postures={**robot.semantic.postures, TUCK: {"0": 1.0}})
    )
    model = load(tucked, tmp_path, floating=True)
    data = mujoco.MjData(model)
    assert [model.key(k).name for k in range(model.nkey)] == ["home", "tuck"]
    for name, expected in (("home", 0.25), ("tuck", 1.0)):
        mujoco.mj_resetDataKeyframe(model, data, model.key(name).id)
        mujoco.mj_forward(model, data)
        assert data.joint("0").qpos[0] == expected and data.joint("grip").qpos[0] == 0.04
        lows = []
        for geom in np.flatnonzero(model.geom_contype):
            kind, size, up = model.geom_type[geom], model.geom_size[geom], data.geom_xmat[geom][6:]
            height = data.geom_xpos[geom, 2]
            if kind == mujoco.mjtGeom.mjGEOM_BOX:
                lows.append(height - np.abs(up) @ size)
            elif kind == mujoco.mjtGeom.mjGEOM_SPHERE:
                lows.append(height - size[0])
            elif kind == mujoco.mjtGeom.mjGEOM_CAPSULE:
                lows.append(height - size[0] - abs(up[2]) * size[1])
            elif kind == mujoco.mjtGeom.mjGEOM_MESH:
                mesh = model.geom_dataid[geom]
                first, count = model.mesh_vertadr[mesh], model.mesh_vertnum[mesh]
                lows.append(height + float((model.mesh_vert[first : first + count] @ up).min()))
        assert min(lows) == pytest.approx(0.0, abs=2e-3)


def test_floating_falls_and_fixed_stays(robot: RobotModel, tmp_path: Path) -> None:
    for floating in (False, True):
        model = load(robot, tmp_path / str(floating), floating=floating)
        data = mujoco.MjData(model)
        for _ in range(100):
            mujoco.mj_step(model, data)
        drop = -data.body("base").xpos[2]
        assert drop == pytest.approx(0.5 * 9.81 * 0.2**2 if floating else 0.0, rel=0.05)


def test_robots_on_wheels_float_unless_virtual_joints_carry_them(robot: RobotModel, tmp_path: Path) -> None:
    wheeled = replace(robot, semantic=replace(robot.semantic, wheel_links=("puck",)))
    holonomic = replace(wheeled, semantic=replace(wheeled.semantic, base="holonomic", virtual_joints=("x",)))
    for case, (given, floats) in {
        "bare": (robot, False),
        "wheels": (wheeled, True),
        "holonomic": (holonomic, False),
    }.items():
        model = load(given, tmp_path / case)
        assert (model.jnt_type == mujoco.mjtJoint.mjJNT_FREE).any() == floats


def test_a_link_called_world_gets_another_name(robot: RobotModel, tmp_path: Path) -> None:
    links = tuple(replace(li, name="world") if li.name == "base" else li for li in robot.description.links)
    joints = tuple(replace(j, parent="world") if j.parent == "base" else j for j in robot.description.joints)
    description = replace(robot.description, links=links, joints=joints)
    semantic = replace(robot.semantic, disabled_collision_pairs=())
    model = load(replace(robot, description=description, sensors=(), semantic=semantic), tmp_path)
    assert model.body("world_link").mass[0] == 10.0


def test_flat_and_tiny_meshes(robot: RobotModel, tmp_path: Path) -> None:
    sheet = Mesh(uri="", path=None, data=primitives.plane(0.1, 0.2))
    flat = Link(name="flat", visuals=(Visual(geometry=sheet),), collisions=(Collision(geometry=sheet),))
    nothing = Visual(geometry=Cylinder(radius=0.0, length=0.1))
    empty = Link(name="empty", visuals=(nothing,))
    fixed = robot.description.joints[4]
    joints = (
        *robot.description.joints,
        replace(fixed, name="f", parent="base", child="flat"),
        replace(fixed, name="e", parent="base", child="empty"),
    )
    description = replace(robot.description, links=(*robot.description.links, flat, empty), joints=joints)
    written = mjcf.write(replace(robot, description=description), tmp_path / "robot.xml")
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "robot.xml"))
    assert (model.geom_bodyid == model.body("flat").id).sum() == 2
    assert any('"empty"' in note for note in written.notes)


@pytest.mark.parametrize("name", ["r1", "husky", "arm7", "r2d2", "rover", "cartpole"])
def test_bundled_robots_load_from_another_folder_and_rest(
    bundled: Callable[[str], RobotModel], tmp_path: Path, name: str
) -> None:
    robot = bundled(name)
    mjcf.write(robot, tmp_path / "here" / f"{name}.xml")
    (tmp_path / "here").rename(tmp_path / "there")
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "there" / f"{name}.xml"))
    text = (tmp_path / "there" / f"{name}.xml").read_text()
    assert all(not Path(file).is_absolute() for file in re.findall(r'file="([^"]+)"', text))
    total = sum(link.inertial.mass for link in robot.description.links if link.inertial)
    assert model.body_mass.sum() == pytest.approx(total, rel=1e-4)
    data = mujoco.MjData(model)
    for _ in range(500):
        mujoco.mj_step(model, data)
    assert np.isfinite(data.qpos).all()
    assert not any(data.warning[w].number for w in range(len(data.warning)))
    assert np.abs(data.qvel).max() < 0.5
