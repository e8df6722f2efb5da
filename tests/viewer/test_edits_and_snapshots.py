"""Edits saved into files and read back, snapshots of a world, texts and checkerboards, without a page."""

from __future__ import annotations

import io
import struct
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import mujoco
import numpy as np
import pytest
import yaml

from roboyard.errors import ConfigError
from roboyard.rendering.scene import RenderShape
from roboyard.shapes import primitives
from roboyard.sim import World
from roboyard.transforms import matrix_from_quaternion, quaternion_from_axis_angle
from roboyard.viewer.inspector.edits.edit_state import (
    EditedSphere,
    EditState,
    SensorPose,
    ignore_tables,
    pair,
    read_edit_state,
    sphere_tables,
)
from roboyard.viewer.inspector.edits.planner_spheres import read_spheres
from roboyard.viewer.inspector.edits.save_edits import write_config, write_planner_files
from roboyard.viewer.scene import texts
from roboyard.viewer.scene.glb import glb, linear_rgb, triangles
from roboyard.viewer.scene.snapshot import PoseSender, gather_links, node_name, take
from roboyard.viewer.scene.texts import SceneText, Texts

URDF = """<robot name="r"><link name="base"/><link name="palm"/><link name="tip"/>
<joint name="j" type="revolute"><parent link="base"/><child link="palm"/><axis xyz="0 0 1"/>
<limit lower="-1" upper="1" effort="1" velocity="1"/></joint>
<joint name="k" type="fixed"><parent link="palm"/><child link="tip"/></joint></robot>"""
CONFIG = """\
urdf_path: r.urdf  # beside
name: r
camera_links:
  # first
  - {link: eye, parent_link: palm, offset: {position: [0, 0, 0.1]}}  # on the palm
  - link: tip
    offset: {position: [0.5, 0, 0]}  # kept
curobo:
  collision_spheres:
    palm: [{center: [0, 0, 0], radius: 0.05}]  # one
    tip: [{center: [0, 0, 0.1], radius: 0.02}]
  self_collision_ignore: {base: [tip]}
"""


@pytest.fixture
def config(tmp_path: Path) -> Path:
    (tmp_path / "r.urdf").write_text(URDF)
    file = tmp_path / "r_config.yaml"
    file.write_text(CONFIG)
    return file


def state_of(file: Path) -> EditState:
    source: Any = SimpleNamespace(config=file, cameras=None, planner_file=None, definition=None)
    return read_edit_state(source)


def save(file: Path, edits: EditState, before: EditState, **options: Any) -> Path:
    options = {"source": file, "urdf": file.with_name("r.urdf"), "name": "r", **options}
    return write_config(options.pop("target", file), edits, before, **options)


# --------------------------------------------------------------------------------------------------- edits


def test_a_configuration_reads_as_the_edits_that_made_it(config: Path) -> None:
    before = state_of(config)
    after = before.copy()
    after.sensors[0].position = (0.01, -0.02, 0.3)
    after.sensors[0].quaternion = tuple(quaternion_from_axis_angle((0, 0, 1), 0.5).tolist())
    after.sensors.append(SensorPose(kind="lidar_links", link="tip", position=(0.0, 0.0, 0.25)))
    after.spheres["palm"].append(EditedSphere(center=(0.1, 0.2, 0.3), radius=0.04))
    after.spheres["base"] = [EditedSphere(center=(0.0, 0.0, 0.0), radius=0.2)]
    del after.spheres["tip"]
    after.planner_pairs = {("base", "palm")}
    assert save(config, after, before) == config
    found = state_of(config)
    assert found.spheres == after.spheres
    assert found.planner_pairs == after.planner_pairs
    assert [(s.kind, s.link, s.parent) for s in found.sensors] == [
        ("camera_links", "eye", "palm"), ("camera_links", "tip", None), ("lidar_links", "tip", None)
    ]  # fmt: skip
    for one, other in zip(found.sensors, after.sensors, strict=True):
        assert one.pose == pytest.approx(other.pose, abs=2e-6)
    text = config.read_text()
    assert [note for note in ("# beside", "# first", "# kept", "# one") if note not in text] == []
    assert config.with_name("r_config.yaml.bak").read_text() == CONFIG


def test_a_state_without_changes_leaves_every_byte_as_it_was(config: Path) -> None:
    before = state_of(config)
    save(config, before.copy(), before)
    assert config.read_text() == CONFIG


def test_a_copy_of_the_state_is_independent(config: Path) -> None:
    before = state_of(config)
    after = before.copy()
    after.sensors[0].position = (9.0, 9.0, 9.0)
    after.spheres["palm"][0].radius = 9.0
    after.planner_pairs.clear()
    assert before == state_of(config)


def test_an_unchanged_sensor_keeps_its_text_beside_a_changed_one(config: Path) -> None:
    before = state_of(config)
    after = before.copy()
    after.sensors[1].position = (0.6, 0.0, 0.0)
    save(config, after, before)
    old, new = CONFIG.splitlines(), config.read_text().splitlines()
    assert [line for line in old if line not in new] == ["    offset: {position: [0.5, 0, 0]}  # kept"]
    added = yaml.safe_load("\n".join(line for line in new if line not in old))
    assert added == {"offset": {"position": [0.6, 0.0, 0.0]}, "parent_link": None}


def test_a_removed_sensor_goes_and_the_other_keeps_its_text(config: Path) -> None:
    before = state_of(config)
    after = before.copy()
    del after.sensors[0]
    save(config, after, before)
    assert [entry["link"] for entry in yaml.safe_load(config.read_text())["camera_links"]] == ["tip"]
    assert state_of(config).sensors == after.sensors


def test_a_configuration_in_another_folder_finds_the_same_urdf(config: Path, tmp_path: Path) -> None:
    before = state_of(config)
    target = tmp_path / "elsewhere" / "new.yaml"
    target.parent.mkdir()
    save(config, before, before, target=target)
    assert config.read_text() == CONFIG
    assert Path(yaml.safe_load(target.read_text())["urdf_path"]) == tmp_path / "r.urdf"
    assert state_of(target) == before
    with pytest.raises(ConfigError, match="exists already; name another file"):
        save(config, before, before, target=target)


def test_a_robot_without_configuration_gets_one_that_loads(config: Path, tmp_path: Path) -> None:
    edits = EditState(
        sensors=[SensorPose(kind="camera_links", link="eye", parent="palm", position=(0.1, 0.0, 0.0))],
        spheres={"tip": [EditedSphere(center=(0.0, 0.0, 0.1234567), radius=0.05)]},
        planner_pairs={("base", "tip")},
    )
    target = save(config, edits, EditState(), target=tmp_path / "new.yaml", source=None)
    data = yaml.safe_load(target.read_text())
    assert (data["urdf_path"], data["name"], data["canonical_frame"]) == ("r.urdf", "r", False)
    found = state_of(target)
    assert found.sensors == edits.sensors
    assert found.spheres["tip"][0].center == (0.0, 0.0, 0.123457)  # micrometres
    with pytest.raises(ConfigError, match="is not this robot's"):
        save(config, edits, EditState(), target=target, source=None)


def test_sensors_on_links_of_other_sensors_are_placed_on_a_link_of_the_robot() -> None:
    """eye is made on the palm, lens on eye: the poses multiply."""
    half = float(np.sqrt(0.5))
    eye = SensorPose(
        kind="camera_links", link="eye", parent="palm", position=(1.0, 0, 0), quaternion=(0, 0, half, half)
    )
    lens = SensorPose(kind="camera_links", link="lens", parent="eye", position=(0.5, 0, 0))
    beam = SensorPose(kind="lidar_links", link="lens", position=(0.0, 0.0, 2.0))
    state = EditState(sensors=[beam, lens, eye])
    assert state.place_of(eye)[0] == "palm"
    name, pose = state.place_of(lens)
    assert name == "palm"
    assert pose[:3, 3] == pytest.approx([1.0, 0.5, 0.0])
    name, pose = state.place_of(beam)
    assert name == "palm"
    assert pose[:3, 3] == pytest.approx([1.0, 0.5, 2.0])
    assert pose[:3, :3] == pytest.approx(matrix_from_quaternion(eye.quaternion))


def test_sensors_that_name_each_other_as_parents_end() -> None:
    a = SensorPose(kind="camera_links", link="a", parent="b")
    b = SensorPose(kind="camera_links", link="b", parent="a")
    assert EditState(sensors=[a, b]).place_of(a)[0] in ("a", "b")


def test_pairs_are_in_alphabetical_order() -> None:
    assert pair("b", "a") == pair("a", "b") == ("a", "b")


@pytest.mark.parametrize(
    ("text", "spheres", "ignores"),
    [
        ("robot_cfg: {collision_spheres: {a: []}, self_collision_ignore: {a: [b]}}", 1, 1),
        ("robot_cfg: {kinematics: {collision_spheres: {a: []}}}", 1, 0),
        (
            "geometry: {g: {spheres: {a: []}}, h: {spheres: {b: []}}}\nself_collision: {ignore: {a: [b]}}",
            2,
            1,
        ),
        ("robot_cfg: {collision_spheres: file.yml}", 0, 0),
        ("[1, 2]", 0, 0),
        ("geometry: 3\nself_collision: 4\nrobot_cfg: 5", 0, 0),
    ],
)
def test_tables_are_found_in_every_layout_of_planner_files(text: str, spheres: int, ignores: int) -> None:
    data = yaml.safe_load(text)
    assert (len(sphere_tables(data)), len(ignore_tables(data))) == (spheres, ignores)


def test_planner_files_read_back_with_the_edited_spheres_and_keep_reserved_ones(tmp_path: Path) -> None:
    file = tmp_path / "p.yaml"
    file.write_text(
        "robot_cfg:\n  collision_spheres:\n"
        "    hand: [{center: [0, 0, 0], radius: 0.1}, {center: [0, 0, 0], radius: -10}]\n"
        "    arm: [{center: [1, 2, 3], radius: 0.2}]  # by hand\n"
    )
    found = {
        name: [
            EditedSphere(center=tuple(c), radius=r)
            for c, r in zip(s.centers.tolist(), s.radii.tolist(), strict=True)
        ]
        for name, s in read_spheres(file).items()
    }
    before = EditState(spheres=found)
    after = before.copy()
    after.spheres["hand"][0].radius = 0.15
    assert write_planner_files(tmp_path, after, before) == [file]
    again = read_spheres(file)
    assert again["hand"].radii.tolist() == [0.15]
    assert again["arm"].centers.tolist() == [[1, 2, 3]]
    assert yaml.safe_load(file.read_text())["robot_cfg"]["collision_spheres"]["hand"][1]["radius"] == -10
    assert "# by hand" in file.read_text()
    assert write_planner_files(tmp_path, after, after) == []


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("robot_cfg: {}", "has no collision_spheres by link"),
        ("[1", "cannot be read"),
        ("collision_spheres: {a: [{center: [0, 0], radius: 1}]}", "a center of three numbers and a radius"),
        ("collision_spheres: {a: [{center: [0, 0, 0]}]}", "got {'center': \\[0, 0, 0\\]}"),
        ("collision_spheres: {a: [{center: [0, 0, .nan], radius: 1}]}", "is not finite"),
    ],
)
def test_planner_files_that_hold_no_spheres_are_refused(text: str, message: str, tmp_path: Path) -> None:
    file = tmp_path / "p.yaml"
    file.write_text(text)
    with pytest.raises(ConfigError, match=message):
        read_spheres(file)


# ----------------------------------------------------------------------------------------------- snapshots

PENDULUM = """<robot name="p/q"><link name="base"/><link name="a/b"><inertial><origin xyz="0.3 0 0"/>
<mass value="1"/><inertia ixx=".1" iyy=".1" izz=".1" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="j" type="continuous"><parent link="base"/><child link="a/b"/><origin xyz="0 0 1"/>
<axis xyz="0 1 0"/></joint></robot>"""


def test_a_snapshot_does_not_change_when_the_world_moves_on(tmp_path: Path) -> None:
    file = tmp_path / "p.urdf"
    file.write_text(PENDULUM)
    world = World()
    body = world.add_urdf(file, fixed_base=True)
    body.joint("j").position = 0.5
    moment = take(world, world.model, gather_links(world))
    before = moment.qpos.copy()
    for _ in range(20):
        world.step()
    assert np.array_equal(moment.qpos, before)
    assert moment.time == 0.0 < world.data.time
    assert np.array_equal(moment.now().qpos, world.data.qpos)
    assert moment.now().qpos is not world.data.qpos
    positions, quaternions = PoseSender().poses(moment.model, moment.qpos)
    row = moment.links.by_owner[body.id, body.link("a/b").index]
    assert positions[row] == pytest.approx([0, 0, 1])
    assert quaternions[row] == pytest.approx([np.cos(0.25), 0, np.sin(0.25), 0])


def test_poses_are_worked_out_beside_the_worlds_own_data(tmp_path: Path) -> None:
    file = tmp_path / "p.urdf"
    file.write_text(PENDULUM)
    world = World()
    world.add_urdf(file, fixed_base=True)
    own = world.data.xquat.copy()
    sender = PoseSender()
    for angle in (0.3, -1.2):
        qpos = world.data.qpos.copy()
        qpos[-1] = angle
        data = mujoco.MjData(world.model)
        data.qpos[:] = qpos
        mujoco.mj_kinematics(world.model, data)
        positions, quaternions = sender.poses(world.model, qpos)
        assert positions == pytest.approx(data.xpos)
        assert quaternions == pytest.approx(data.xquat)
    assert np.array_equal(world.data.xquat, own)


def test_links_have_paths_of_their_own_even_where_names_repeat(tmp_path: Path) -> None:
    file = tmp_path / "p.urdf"
    file.write_text(PENDULUM)
    world = World()
    first, second = (world.add_urdf(file, fixed_base=True) for _ in range(2))
    links = gather_links(world)
    assert len(set(links.paths.values())) == len(links.paths) == 4
    assert all(path.count("/") == 2 for path in links.paths.values())  # a slash in a name makes no level
    assert {links.rows[path] for path in links.paths.values()} == {
        int(row) for body in (first, second) for row in body.mujoco_ids
    }
    moving = {owner for owner in links.paths if owner not in links.fixed}
    assert moving == {(body.id, body.link("a/b").index) for body in (first, second)}
    assert (node_name("a/b"), node_name("")) == ("a∕b", "unnamed")


# --------------------------------------------------------------------------------------- texts and shapes


@pytest.fixture
def sent(monkeypatch: pytest.MonkeyPatch) -> list[Any]:
    """Collect what texts send to pages."""
    messages: list[Any] = []

    class Script:
        def __init__(self, *arguments: Any) -> None:
            pass

        def send(self, value: Any) -> None:
            messages.append(value)

    monkeypatch.setattr(texts, "PageScript", Script)
    return messages


def test_texts_are_sent_once_with_their_colour_and_axes(sent: list[Any]) -> None:
    quarter = tuple(quaternion_from_axis_angle((0, 0, 1), np.pi / 2).tolist())
    written = [
        SceneText("flat", (0, 0, 0), (1.0, 0.5, 0.0), 2.0, quarter),
        SceneText("facing", (0, 0, 0), (-1.0, 2.0, 0.0)),
    ]
    turn = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])  # y up to z
    places = np.array([[1.0, 2.0, 3.0000000001], [0, 0, 0]])
    shown = Texts(None)
    for _ in range(2):
        shown.show(written, places, np.stack([turn, np.eye(3)]))
    ((flat, facing),) = sent
    assert flat[:6] == ["flat", 1.0, 2.0, 3.0, "#ff8000", 2.0]
    # along x of the text: y of its frame, which the link turns to z; its y axis is -x
    assert flat[6] == pytest.approx([0, 0, 1, -1, 0, 0])
    assert facing == ["facing", 0.0, 0.0, 0.0, "#00ff00", 1.0, None]
    shown.show([], np.zeros((0, 3)), np.zeros((0, 3, 3)))
    assert sent[-1] == []


def shape(**fields: Any) -> RenderShape:
    return RenderShape(position=np.zeros(3), rotation=np.eye(3), frame=0, owner=(0, 0), **fields)


def test_a_binary_gltf_has_the_chunks_that_the_format_prescribes() -> None:
    data = glb(shape(mesh=primitives.cylinder(0.2, 0.5)))
    magic, version, total = struct.unpack_from("<4sII", data)
    assert (magic, version, total) == (b"glTF", 2, len(data))
    length, kind = struct.unpack_from("<I4s", data, 12)
    assert (kind, length % 4) == (b"JSON", 0)
    binary, kind = struct.unpack_from("<I4s", data, 20 + length)
    assert (kind, binary % 4) == (b"BIN\0", 0)
    assert 28 + length + binary == total


@pytest.mark.parametrize("scale", [(1.0, 1.0, 1.0), (2.0, 0.5, 3.0), (-1.0, 1.0, 1.0)])
def test_a_scaled_sphere_reads_back_closed_with_its_volume(scale) -> None:
    import trimesh

    written = shape(mesh=primitives.sphere(0.4, 64), scale=scale)
    (mesh,) = trimesh.load(io.BytesIO(glb(written)), file_type="glb", process=False).geometry.values()
    mesh.merge_vertices(merge_norm=True)
    assert mesh.is_watertight
    assert mesh.volume == pytest.approx(4 / 3 * np.pi * 0.4**3 * abs(np.prod(scale)), rel=0.01)
    vertices, faces = triangles(written)
    assert vertices.min(axis=0) == pytest.approx(mesh.bounds[0], rel=1e-5)
    assert len(faces) == len(mesh.faces)


def test_display_colours_become_linear_light_by_the_standard() -> None:
    """IEC 61966-2-1: the two pieces meet, and middle grey 0.5 is 0.214 of the light."""
    srgb = np.array([-1.0, 0.0, 0.04045, 0.5, 1.0, 2.0])
    assert linear_rgb(srgb) == pytest.approx([0, 0, 0.0031308, 0.2140411, 1, 1], abs=1e-6)
