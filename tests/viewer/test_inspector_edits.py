"""Edits on the inspector's page: sensors, spheres, pairs; checks; saving; importing again."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from roboyard.errors import ConfigError
from roboyard.transforms import matrix_from_quaternion
from roboyard.viewer.inspector import Inspector, RobotSource, find_robot
from roboyard.viewer.inspector.checks.shapes import out_of_round
from roboyard.viewer.inspector.edits.edit_state import EditedSphere, EditState, SensorPose, read_edit_state
from roboyard.viewer.inspector.edits.save_edits import write_definition, write_planner_files

pytest.importorskip("viser")

CONFIG = """\
# Import configuration of the gripper.
urdf_path: gripper.urdf   # beside this file
name: gripper
overwrite: true
canonical_frame: false
collision:
  decompose_method: convex
camera_links:
  # between the fingers
  - link: eye
    parent_link: palm
    offset: {position: [0.05, 0, 0.1], orientation: [0, 0, 0, 2]}
lidar_links:
  - {link: eye, parent_link: null, offset: {position: [0, 0, 0.02]}}   # on the same link
curobo:
  collision_spheres:
    palm:
      - {center: [0.0, 0.0, 0.0], radius: 0.06}  # the middle
    left: [{center: [0.1, 0, 0], radius: 0.02}]
  self_collision_ignore:
    palm: [left, right]
"""


@pytest.fixture
def config(gripper: Path) -> Path:
    file = gripper.with_name("gripper_config.yaml")
    file.write_text(CONFIG)
    return file


@pytest.fixture
def inspect(gripper: Path) -> Iterator[Callable[..., Inspector]]:
    opened: list[Inspector] = []

    def open_inspector(source: RobotSource | None = None, **beside: Any) -> Inspector:
        opened.append(
            Inspector(source or RobotSource(name="gripper", urdf=gripper, **beside), port=0, quiet=True)
        )
        return opened[-1]

    yield open_inspector
    for inspector in opened:
        inspector.close()


def typed(inspector: Inspector, page: Any, wait: Any, element: Any, value: Any) -> None:
    """Set the value of an element of the panel as a user of a page does."""
    page.send(type="GuiUpdateMessage", uuid=element._impl.uuid, updates={"value": value})
    wait(lambda: inspector._requests.qsize() > 0)
    inspector.tick(0.01)


def test_edits_start_with_the_configuration(config: Path, gripper: Path) -> None:
    edits = read_edit_state(RobotSource(name="gripper", urdf=gripper, config=config))
    first, second = edits.sensors
    assert (first.kind, first.link, first.parent) == ("camera_links", "eye", "palm")
    assert edits.place_of(first)[0] == "palm"
    link, pose = edits.place_of(second)  # on a link that the first one makes
    assert link == "palm"
    np.testing.assert_allclose(pose[:3, 3], [0.05, 0, 0.12])
    assert edits.spheres["palm"] == [EditedSphere(center=(0.0, 0.0, 0.0), radius=0.06)]
    assert edits.planner_pairs == {("left", "palm"), ("palm", "right")}


def test_a_live_picture_is_rendered_at_the_camera_pose(inspect, config: Path, browser, wait) -> None:
    from roboyard.sensors import CameraSensor

    inspector = inspect(config=config)
    panel = inspector.panels.sensors
    blank = panel.picture.image.copy()
    inspector.tick(0.01)
    np.testing.assert_array_equal(panel.picture.image, blank)  # no page is open
    page = browser(inspector.viewer)
    wait(lambda: inspector.viewer.watchers == 1)
    typed(inspector, page, wait, panel.position, (0.0, -0.9, 0.5))
    typed(inspector, page, wait, panel.turn, (70.0, 0.0, 0.0))
    sensor = inspector.panels.edits.sensors[0]
    assert sensor.position == (0.0, -0.9, 0.5)
    inspector.tick(0.01)
    link = inspector.body.link("palm")
    sensor = CameraSensor(
        link, position=sensor.position, orientation=sensor.quaternion, width=320, height=240
    )
    np.testing.assert_array_equal(panel.picture.image, sensor.image().rgb)
    assert len(np.unique(panel.picture.image.reshape(-1, 3), axis=0)) > 3


def test_a_frustum_is_at_the_pose_of_its_camera(inspect, config: Path) -> None:
    inspector = inspect(config=config)
    inspector.overlays.switch("sensors and tools", True)
    first, second = inspector.overlays.nodes("sensors and tools")
    assert first.name.startswith("/gripper/palm/")
    np.testing.assert_allclose(first.position, [0.05, 0, 0.1])
    np.testing.assert_allclose(second.position, [0.05, 0, 0.12])
    np.testing.assert_allclose(
        np.abs(first.wxyz), [0, 1, 0, 0]
    )  # viser's frustum: viewing direction +z, y down
    inspector.panels.sensors.move(inspector.panels.edits.sensors[0], (0.0, 0.0, 0.3), (0, 0, 0, 1))
    np.testing.assert_allclose(inspector.overlays.nodes("sensors and tools")[1].position, [0, 0, 0.32])


def test_a_dragged_handle_moves_the_sensor(inspect, config: Path, browser, wait) -> None:
    inspector = inspect(config=config)
    page = browser(inspector.viewer)
    panel = inspector.panels.sensors
    typed(inspector, page, wait, panel.handle_box, True)
    handle = panel._gizmo.handle
    np.testing.assert_allclose(handle.position, [0.05, 0, 0.1])
    page.send(type="TransformControlsDragStartMessage", name=handle.name)
    page.send(
        type="TransformControlsUpdateMessage",
        name=handle.name,
        position=(0.1, 0.2, 0.3),
        wxyz=(1.0, 0.0, 0.0, 0.0),
    )
    wait(lambda: handle.position[0] == 0.1 and inspector._requests.qsize() > 1)
    inspector.tick(0.01)
    assert inspector.panels.edits.sensors[0].position == (0.1, 0.2, 0.3)
    assert tuple(panel.position.value) == (0.1, 0.2, 0.3)


def test_a_saved_edit_changes_only_its_lines_of_the_file(inspect, config: Path, browser, wait) -> None:
    inspector = inspect(config=config)
    page = browser(inspector.viewer)
    typed(inspector, page, wait, inspector.panels.sensors.position, (0.06, 0.0, 0.1))
    inspector.panels.spheres.pick("palm", 0)
    typed(inspector, page, wait, inspector.panels.spheres.radius, 0.055)
    assert config.read_text() == CONFIG  # the button was not pressed
    assert inspector.panels.save.is_changed
    page.send(
        type="GuiUpdateMessage", uuid=inspector.panels.save.write_button._impl.uuid, updates={"value": True}
    )
    wait(lambda: inspector.tick(0.01) or not inspector.panels.save.is_changed)
    new = config.read_text().splitlines()
    old = CONFIG.splitlines()
    assert [line for line in old if line not in new] == [
        "    offset: {position: [0.05, 0, 0.1], orientation: [0, 0, 0, 2]}",
        "      - {center: [0.0, 0.0, 0.0], radius: 0.06}  # the middle",
    ]
    assert [line for line in new if line not in old] == [
        "    offset: {position: [0.06, 0, 0.1], orientation: [0, 0, 0, 2]}",
        "      - {center: [0.0, 0.0, 0.0], radius: 0.055}  # the middle",
    ]
    assert config.with_name("gripper_config.yaml.bak").read_text() == CONFIG
    assert inspector.panels.save.write() == []


def test_spheres_are_added_and_deleted(inspect, config: Path) -> None:
    inspector = inspect(config=config)
    panel, edits = inspector.panels.spheres, inspector.panels.edits
    panel.pick("left", 0)
    assert inspector.overlays.is_on("planning spheres")
    panel.add()
    assert edits.spheres["left"] == [
        EditedSphere(center=(0.1, 0.0, 0.0), radius=0.02),
        EditedSphere(center=(0.1, 0.0, 0.02), radius=0.02),
    ]
    node = inspector.overlays.spheres.nodes["left"]
    np.testing.assert_allclose(node.batched_positions[1], [0.1, 0, 0.02])
    panel.delete()
    panel.delete()
    assert "left" not in edits.spheres
    assert "left" not in inspector.overlays.spheres.nodes
    panel.pick("right", None)
    panel.add()
    assert edits.spheres["right"][0].center == (0.1, 0.0, 0.0)  # at its centre of mass
    inspector.panels.save.write()
    written = yaml.safe_load(config.read_text())["curobo"]["collision_spheres"]
    assert set(written) == {"palm", "right"}
    assert "# the middle" in config.read_text()


def test_pairs_are_added_and_removed(inspect, config: Path) -> None:
    inspector = inspect(config=config)
    panel, edits = inspector.panels.pairs, inspector.panels.edits
    panel.add([("left", "right")])
    assert ("left", "right") in edits.physics_pairs & edits.planner_pairs
    panel.pick(("left", "palm"))
    assert panel.planner_box.value
    assert not panel.physics_box.value
    panel.planner_box.value = False
    panel._ticked()
    assert ("left", "palm") not in edits.planner_pairs
    with pytest.raises(ConfigError, match="two links"):
        panel.add([("left", "left")])
    inspector.panels.save.write()
    ignored = yaml.safe_load(config.read_text())["curobo"]["self_collision_ignore"]
    assert {tuple(sorted((a, b))) for a, others in ignored.items() for b in others} == {
        ("palm", "right"),
        ("left", "right"),
    }
    assert "go into the definition that an import makes" in inspector.panels.save.message.content


def test_a_bare_urdf_gets_a_new_configuration_and_never_overwrites_another(inspect, gripper: Path) -> None:
    inspector = inspect()
    save = inspector.panels.save
    assert save.write() == []
    panel = inspector.panels.sensors
    panel.new_link.value, panel.new_parent.value = "eye", "palm"
    panel._add()
    with pytest.raises(ConfigError, match="there is a link 'eye' already"):
        panel._add()
    target = gripper.with_name("new.yaml")
    target.write_text("precious: true\n")
    save.target.value = str(target)
    with pytest.raises(ConfigError, match="exists already"):
        save.write()
    assert target.read_text() == "precious: true\n"
    save.target.value = str(gripper.with_name("other.yaml"))
    assert save.write() == [gripper.with_name("other.yaml")]
    data = yaml.safe_load(gripper.with_name("other.yaml").read_text())
    assert data["urdf_path"] == "gripper.urdf"
    assert data["camera_links"][0]["parent_link"] == "palm"


def test_planner_files_and_definitions_are_edited_in_place(tmp_path: Path) -> None:
    arm, held = "[{center: [0, 0, 0], radius: 0.1}]", "[{center: [0, 0, 0], radius: -1}]"
    sphere = f"collision_spheres: {{arm: {arm}, held: {held}}}"
    ignore = "self_collision_ignore: {arm: [hand], hand: [tip]}"
    flat, nested, xrdf = tmp_path / "a.yaml", tmp_path / "nested" / "a.yaml", tmp_path / "a.xrdf"
    nested.parent.mkdir()
    flat.write_text(f"# flat\nrobot_cfg:\n  {sphere}  # by hand\n  {ignore}\n")
    nested.write_text(f"robot_cfg:\n  kinematics:\n    {sphere}\n    {ignore}\n")
    xrdf.write_text(
        f"geometry: {{g: {{spheres: {{arm: {arm}}}}}}}\nself_collision: {{ignore: {{arm: [hand]}}}}\n"
    )
    before = EditState(
        spheres={"arm": [EditedSphere(center=(0.0, 0.0, 0.0), radius=0.1)]},
        planner_pairs={("arm", "hand"), ("hand", "tip")},
    )
    after = before.copy()
    after.spheres["arm"][0].radius = 0.2
    after.planner_pairs = {("arm", "hand"), ("arm", "tip")}
    assert set(write_planner_files(tmp_path, after, before)) == {flat, nested, xrdf}
    assert flat.read_text().startswith("# flat\n")
    assert "# by hand" in flat.read_text()
    block = yaml.safe_load(nested.read_text())["robot_cfg"]["kinematics"]
    assert block["collision_spheres"]["arm"] == [{"center": [0.0, 0.0, 0.0], "radius": 0.2}]
    assert block["collision_spheres"]["held"] == [{"center": [0, 0, 0], "radius": -1}]
    assert block["self_collision_ignore"] == {"arm": ["hand", "tip"]}
    assert yaml.safe_load(xrdf.read_text())["self_collision"] == {"ignore": {"arm": ["hand", "tip"]}}
    definition = tmp_path / "arm.yaml"
    definition.write_text('# hands off\ndisabled_collision_pairs:\n  - ["hand", "arm"]  # they touch\n')
    old = EditState(physics_pairs={("arm", "hand")})
    assert write_definition(definition, old, old) is None
    assert (
        write_definition(definition, EditState(physics_pairs={("arm", "hand"), ("arm", "tip")}), old)
        == definition
    )
    assert definition.read_text() == (
        '# hands off\ndisabled_collision_pairs:\n  - ["hand", "arm"]  # they touch\n  - [arm, tip]\n'
    )


def test_the_import_button_imports_the_edits_and_shows_the_robot(
    inspect, config: Path, tmp_path: Path, monkeypatch, wait
) -> None:
    monkeypatch.setenv("ROBOYARD_DATA", str(tmp_path / "data"))
    inspector = inspect(config=config)
    inspector.panels.sensors.move(inspector.panels.edits.sensors[0], (0.05, 0.0, 0.25), (0, 0, 0, 1))
    inspector.panels.pairs.add([("left", "right")])
    inspector.panels.save.import_again()
    before = inspector.panels
    wait(lambda: inspector.tick(0.01) or inspector.panels is not before, 60)
    assert inspector.body.link("eye").parent.name == "palm"
    palm, eye = (inspector.body.link(name).pose[0] for name in ("palm", "eye"))
    np.testing.assert_allclose(eye - palm, [0.05, 0, 0.25], atol=1e-9)
    assert "Imported into" in inspector.panels.save.message.content
    assert find_robot("gripper").config is None  # the package stores the name of the file alone
    monkeypatch.chdir(config.parent)
    found = find_robot("gripper")
    assert found.config == Path(config.name)
    assert ("left", "right") in read_edit_state(found).physics_pairs
    assert [body.name for body in inspector.world.bodies].count("gripper") == 1
    inspector.play(True)
    inspector.tick(0.1)
    assert inspector.world.time > 0.05
    # and again from the package, in place
    inspector.panels.sensors.move(inspector.panels.edits.sensors[0], (0.05, 0.0, 0.2), (0, 0, 0, 1))
    before = inspector.panels
    before.save.import_again()
    wait(lambda: inspector.tick(0.01) or inspector.panels is not before, 60)
    palm, eye = (inspector.body.link(name).pose[0] for name in ("palm", "eye"))
    np.testing.assert_allclose(eye - palm, [0.05, 0, 0.2], atol=1e-9)


def test_a_failed_import_keeps_the_robot_and_reports_the_error(
    inspect, config: Path, tmp_path, monkeypatch, wait
) -> None:
    monkeypatch.setenv("ROBOYARD_DATA", str(tmp_path / "data"))
    inspector = inspect(config=config)
    panels = inspector.panels
    panels.edits.sensors.append(SensorPose(kind="camera_links", link="x", parent="nowhere"))
    panels.save.import_again()
    wait(lambda: inspector.tick(0.01) or not panels.save.import_button.disabled, 30)
    assert "nowhere" in panels.save.message.content
    assert inspector.panels is panels
    assert not (tmp_path / "data" / "omnigibson-robot-assets" / "models").exists()


def test_a_robot_that_cannot_be_loaded_keeps_the_old_one(inspect, tmp_path: Path) -> None:
    inspector = inspect()
    bad = tmp_path / "bad.urdf"
    bad.write_text("<robot")
    inspector.do(lambda: inspector.load(RobotSource(name="bad", urdf=bad)))
    inspector.tick(0.01)
    assert "bad.urdf" in inspector._status.content
    assert inspector.body.name == "gripper"
    assert not inspector.body.is_removed


def test_checks_list_violations_and_show_their_links(inspect, gripper: Path, browser, wait) -> None:
    text = gripper.read_text()
    text = text.replace(
        '<collision><origin xyz="0.1 0 0"/><geometry><box size="0.2 0.02 0.02"/>',
        '<collision><geometry><box size="0.5 0.02 0.02"/>',
    )
    text = text.replace('<origin xyz="0.05 -0.03 0.2"/>', '<origin xyz="0.05 -0.03 0.03"/>')
    gripper.write_text(text)
    inspector = inspect()
    page = browser(inspector.viewer)
    wait(lambda: len(inspector.viewer.server.get_clients()) == 1)
    page.listen(lambda m: m["type"] == "SetCameraLookAtMessage" and not m["initial"])  # the first picture
    checks = inspector.panels.checks
    checks.run_all()
    fits = checks.results["collision shapes fit"]
    assert {violation.link for violation in fits.violations} == {"left", "right"}
    assert any("stands out" in violation.text for violation in fits.violations)
    assert any("no collision shape" in violation.text for violation in fits.violations)
    assert checks.results["the base frame is at the bottom"].violations
    assert checks.results["wheels are round and on the floor"].is_open
    assert checks.results["the drives hold the posture"].passed
    assert checks.buttons["collision shapes fit"].label.startswith("✗")
    assert "failed" in checks.summary.content
    page.send(
        type="GuiUpdateMessage",
        uuid=checks.buttons["collision shapes fit"]._impl.uuid,
        updates={"value": True},
    )
    wait(lambda: inspector.tick(0.01) or inspector.links.picked is not None)
    assert inspector.links.picked.name == fits.violations[0].link
    moved = page.listen(lambda m: m["type"] == "SetCameraLookAtMessage" and not m["initial"])
    left = inspector.world.bounds_of(np.array([inspector.body.link(fits.violations[0].link).mujoco_id]))
    np.testing.assert_allclose(moved["look_at"], left.mean(axis=0), atol=1e-6)


def test_overlapping_links_are_reported_until_their_collision_is_disabled(inspect, gripper: Path) -> None:
    text = gripper.read_text().replace('<origin xyz="0.05 0.03 0.2"/>', '<origin xyz="0.05 0.03 0.0"/>')
    text = text.replace(
        '<joint name="grip" type="revolute"><parent link="palm"/>',
        '<link name="hub"/><joint name="hub_joint" type="revolute"><parent link="palm"/><child link="hub"/>'
        '<axis xyz="0 0 1"/><limit lower="-1" upper="1" effort="1" velocity="1"/></joint>'
        '<joint name="grip" type="revolute"><parent link="hub"/>',
    )
    gripper.write_text(text.replace('xyz="0.05 0.03 0.0"', 'xyz="-0.05 0 0"'))
    inspector = inspect()
    checks = inspector.panels.checks
    checks.run("no unexpected self-collision")
    result = checks.results["no unexpected self-collision"]
    assert [violation.text.split(" overlap")[0] for violation in result.violations] == ["left and palm"]
    inspector.panels.pairs.add_touching()
    checks.run("no unexpected self-collision")
    assert checks.results["no unexpected self-collision"].passed


def test_out_of_round_measures_the_variation_of_the_diameter() -> None:
    turn = np.linspace(0, 2 * np.pi, 96, endpoint=False)
    disc = np.stack([np.cos(turn), np.sin(turn), np.zeros(96)], axis=1)
    wheel = 0.1 * np.concatenate([disc, np.add(disc, (0, 0, 0.5))]) + (0.3, 0.2, 0.1)
    assert out_of_round(wheel, [np.array([0.0, 0.0, 1.0])]) < 0.01
    assert out_of_round(wheel * [1.0, 1.2, 1.0], [np.array([0.0, 0.0, 1.0])]) == pytest.approx(
        1 - 1 / 1.2, abs=0.01
    )
    assert out_of_round(wheel, list(np.eye(3))) < 0.01  # about the roundest axis


def test_a_live_scan_shows_the_points_hit_by_the_rays(
    inspect: Callable[..., Inspector], config: Path
) -> None:
    inspector = inspect(config=config)
    panel, scans = inspector.panels.sensors, inspector.overlays.sensors.scans
    lidar = next(sensor for sensor in panel._edits.sensors if sensor.kind == "lidar_links")
    panel.update(watched=True)
    assert not panel.scan_box.visible
    panel.pick(lidar)
    assert panel.scan_box.visible
    panel.update(watched=True)
    assert not len(scans.points)  # the box is not ticked

    panel.scan_box.value = True
    panel.update(watched=False)
    assert not len(scans.points)  # no page is open
    panel.update(watched=True)
    name, pose = panel._edits.place_of(lidar)
    position, quaternion = inspector.body.link(name).pose
    origin = np.array(position) + matrix_from_quaternion(quaternion) @ pose[:3, 3]
    floor = scans.points[np.abs(scans.points[:, 2]) < 1e-5]
    assert len(floor) > 100
    # rows are 4 degrees apart, the lowest 14 degrees down
    away = np.hypot(*(floor[:, :2] - origin[:2]).T)
    assert away.min() == pytest.approx(origin[2] / np.tan(np.radians(14.0)), rel=1e-4)

    panel.scan_box.value = False
    panel.update(watched=True)
    assert not len(scans.points)
