from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from roboyard.errors import ConfigError, RoboyardError
from roboyard.viewer.inspector import Inspector, RobotSource, find_robot
from roboyard.viewer.inspector.edits.planner_spheres import read_spheres
from roboyard.viewer.inspector.layers.overlays import FORCE_LENGTH, inertia_box
from roboyard.viewer.page.markdown import plain

pytest.importorskip("viser")

PLANNER = """
robot_cfg:
  kinematics:
    collision_spheres:
      palm:
      - {center: [0.0, 0.0, 0.01], radius: 0.06}
      - {center: [0.0, 0.0, -0.01], radius: 0.05}
      left: [{center: [0.1, 0, 0], radius: 0.02}]
      held: [{center: [0, 0, 0], radius: -10.0}]
"""


@pytest.fixture
def planner_file(tmp_path: Path) -> Path:
    file = tmp_path / "planner.yaml"
    file.write_text(PLANNER)
    return file


@pytest.fixture
def inspect(gripper: Path) -> Iterator[Callable[..., Inspector]]:
    opened: list[Inspector] = []

    def open_inspector(**options: Any) -> Inspector:
        source = RobotSource(name="gripper", urdf=gripper, planner_file=options.pop("planner_file", None))
        opened.append(Inspector(source, port=0, quiet=True, **options))
        return opened[-1]

    yield open_inspector
    for inspector in opened:
        inspector.close()


def press(inspector: Inspector, handle: Any, page: Any, **updates: Any) -> None:
    """Send the message of a user action on an element of the panel."""
    page.send(type="GuiUpdateMessage", uuid=handle._impl.uuid, updates=updates)


def test_the_newest_of_two_values_counts(inspect, browser, wait, monkeypatch: pytest.MonkeyPatch) -> None:
    """A busy process may take long for the first of two values of a slider that is dragged."""
    inspector = inspect()
    page = browser(inspector.viewer)
    wait(lambda: inspector.viewer.watchers == 1)
    put, second = inspector._requests.do, threading.Event()
    values: list[float] = []

    def slow(request: Callable[[], None]) -> None:
        values.append(float(slider.value))
        if len(values) == 1:
            second.wait(0.3)  # never comes where values are passed on one after the other
        put(request)
        second.set()

    monkeypatch.setattr(inspector._requests, "do", slow)
    slider = inspector.joints.sliders["grip"]
    for value in (0.2, 0.4):
        press(inspector, slider, page, value=value)
    wait(lambda: inspector._requests.qsize() == 2)
    inspector.tick(0.01)
    assert inspector.body.joint("grip").position == pytest.approx(0.4, abs=1e-3)


def test_the_robot_starts_paused_on_the_floor(inspect) -> None:
    inspector = inspect()
    assert inspector.body.bounds[0, 2] == pytest.approx(0.001, abs=1e-6)
    inspector.tick(0.5)
    assert inspector.world.time == 0.0


def test_playing_runs_in_real_time_and_pausing_stops_it(inspect) -> None:
    inspector = inspect()
    inspector.play(True)
    for _ in range(60):
        inspector.tick(1 / 60)
    assert inspector.world.time == pytest.approx(1.0, abs=0.02)
    inspector.tick(30.0)  # a long pause of the machine is not caught up
    assert inspector.world.time < 1.2
    inspector.play(False)
    before = inspector.world.time
    inspector.tick(1.0)
    assert inspector.world.time == before


def test_the_step_button_simulates_one_step(inspect) -> None:
    inspector = inspect()
    inspector.step_once()
    assert inspector.world.time == pytest.approx(inspector.world.timestep)
    assert not inspector.is_playing


def test_a_paused_slider_sets_the_joint_and_its_mimic_joint(inspect, browser, wait) -> None:
    inspector = inspect()
    page = browser(inspector.viewer)
    press(inspector, inspector.joints.sliders["grip"], page, value=0.5)
    wait(lambda: inspector.joints.sliders["grip"].value == 0.5)
    wait(lambda: inspector._requests.qsize() > 0)
    inspector.tick(0.01)
    assert inspector.body.joint("grip").position == pytest.approx(0.5)
    assert inspector.body.joint("follow").position == pytest.approx(-0.5)
    assert inspector.joints.sliders["follow"].value == pytest.approx(-0.5)
    node = inspector.viewer.nodes._frames["/gripper/left"]
    inspector.viewer.sync(wait=True)
    assert abs(node.wxyz[3]) == pytest.approx(np.sin(0.25), abs=1e-5)


def test_a_playing_slider_sets_the_target_of_the_drive(inspect) -> None:
    inspector = inspect()
    inspector.play(True)
    inspector.joints.move("grip", 0.4)
    inspector.joints.sliders["grip"].value = 0.4
    for _ in range(90):
        inspector.tick(1 / 60)
    assert inspector.body.joint("grip").position == pytest.approx(0.4, abs=0.02)
    assert inspector.body.joint("follow").position == pytest.approx(-0.4, abs=0.03)


def test_joints_are_free_with_drives_disabled(inspect) -> None:
    inspector = inspect()
    inspector.joints.hold(False)
    inspector.play(True)
    inspector.joints.move("grip", 0.5)
    for _ in range(30):
        inspector.tick(1 / 60)
    assert inspector.body.joint("grip").position == pytest.approx(0.0, abs=0.01)
    assert inspector.body.joint("grip").applied_effort == 0.0


def test_sliders_span_the_limits_and_mimic_joints_are_disabled(inspect) -> None:
    sliders = inspect().joints.sliders
    assert set(sliders) == {"grip", "follow"}
    assert (sliders["grip"].min, sliders["grip"].max) == (-0.2, 0.8)
    assert not sliders["grip"].disabled
    assert sliders["follow"].disabled
    assert "from -0.2 to 0.8 rad (-11° to 46°)" in sliders["grip"].hint
    assert [mark.label for mark in sliders["grip"]._impl.props._marks] == ["-11°", "46°"]
    assert "effort 20" in sliders["grip"].hint


def test_wiggling_reaches_both_limits_and_returns(inspect) -> None:
    inspector = inspect()
    inspector.joints.move("grip", 0.1)
    inspector.wiggle()
    seen = []
    for _ in range(500):
        inspector.tick(1 / 60)
        seen.append(inspector.body.joint("grip").position)
        if inspector._wiggle is None:
            break
    assert (min(seen), max(seen)) == pytest.approx((-0.2, 0.8), abs=0.01)
    assert inspector.body.joint("grip").position == pytest.approx(0.1)
    assert inspector.world.time == 0.0
    assert inspector.wiggle_button.label == "Wiggle every joint"


def test_reset_restores_the_initial_state(inspect) -> None:
    inspector = inspect(fixed_base=False)
    place = inspector.body.position
    inspector.play(True)
    for _ in range(30):
        inspector.tick(1 / 60)
    inspector.body.set_pose(position=(3, 3, 3))
    inspector.reset()
    np.testing.assert_allclose(inspector.body.position, place)
    assert not inspector.is_playing
    assert inspector.joints.sliders["grip"].value == 0.0


def test_gravity_can_be_switched_off(inspect) -> None:
    inspector = inspect(fixed_base=False)
    inspector.body.set_pose(position=(0, 0, 1))
    inspector.set_gravity(False)
    inspector.play(True)
    for _ in range(20):
        inspector.tick(1 / 60)
    assert inspector.body.position[2] == pytest.approx(1.0, abs=1e-3)
    inspector.set_gravity(True)
    for _ in range(20):
        inspector.tick(1 / 60)
    assert inspector.body.position[2] < 0.8


def test_understood_parts_take_the_place_of_the_visual_meshes_and_have_a_legend() -> None:
    inspector = Inspector(find_robot("rover"), port=0, quiet=True)
    try:
        panels, nodes = inspector.panels, inspector.viewer.nodes._shapes.values()
        panels.switch("understood parts", True)
        assert len(inspector.overlays.nodes("understood parts")) >= 5
        assert not any(node.visible for node, shape in nodes if not shape.infinite)
        assert panels.legend.visible
        assert "mobile base, base: differential" in panels.legend.content
        assert "wheels" in panels.legend.content and "left_wheel" in panels.legend.content
        panels.switch("understood parts", False)
        assert all(node.visible for node, _ in nodes)
        assert not panels.legend.visible
    finally:
        inspector.close()


def test_a_switch_on_the_page_shows_and_hides(inspect, browser, wait, planner_file: Path) -> None:
    inspector = inspect(planner_file=planner_file)
    page = browser(inspector.viewer)
    expected = {
        "collision shapes": 2,
        "inertia boxes": 3,
        "centres of mass": 4,
        "frames": 4,
        "joint axes": 2,
        "contacts": 2,
        "understood parts": 3,
        "planning spheres": 2,
        "sensors and tools": 0,
    }
    assert set(inspector.overlays.kinds) == set(expected)
    for kind, count in expected.items():
        assert inspector.overlays.nodes(kind) == []
        press(inspector, inspector.switches[kind], page, value=True)
        wait(lambda: inspector._requests.qsize() > 0)
        inspector.tick(0.01)
        nodes = inspector.overlays.nodes(kind)
        assert len(nodes) == count
        assert all(node.visible for node in nodes)
        inspector.overlays.switch(kind, False)
        assert not any(node.visible for node in nodes)
    inspector.viewer.show_visuals(False)
    shown = inspector.viewer.nodes._shapes.values()
    assert all(handle.visible == shape.infinite for handle, shape in shown)


def test_inertia_boxes_have_the_inertia_of_their_links(inspect) -> None:
    edges = np.array([0.3, 0.2, 0.1])
    moments = 4.0 / 12.0 * np.array([0.2**2 + 0.1**2, 0.3**2 + 0.1**2, 0.3**2 + 0.2**2])
    assert inertia_box(4.0, moments) == pytest.approx(edges)
    inspector = inspect()
    inspector.overlays.switch("inertia boxes", True)
    left = next(n for n in inspector.overlays.nodes("inertia boxes") if n.name == "/gripper/left/inertia")
    assert left.position == pytest.approx([0.1, 0, 0])


def test_contacts_and_the_centre_of_mass_follow_the_world(inspect) -> None:
    inspector = inspect(fixed_base=False)
    inspector.overlays.switch("contacts", True)
    inspector.overlays.switch("centres of mass", True)
    inspector.play(True)
    for _ in range(240):
        inspector.tick(1 / 60)
    points, forces = inspector.overlays.nodes("contacts")
    assert len(points.points) == len(inspector.world.contacts(inspector.body)) > 0
    assert np.abs(points.points[:, 2]).max() < 0.01
    push = (forces.points[:, 1] - forces.points[:, 0]).sum(axis=0)
    # at rest the arrows add up to the robot's weight, upwards
    assert push == pytest.approx([0, 0, FORCE_LENGTH * inspector.overlays.size], abs=0.003)
    total = inspector.overlays.nodes("centres of mass")[-1]
    assert total.position == pytest.approx(inspector.body.center_of_mass, abs=1e-3)


@pytest.mark.parametrize("shape", ["visual", "collision"])
def test_a_clicked_shape_selects_its_link(inspect, browser, wait, shape: str) -> None:
    inspector = inspect()
    page = browser(inspector.viewer)
    inspector.overlays.switch("collision shapes", True)
    nodes = inspector.viewer.server.scene._handle_from_node_name
    name = next(node for node in nodes if node.startswith(f"/gripper/left/{shape} "))
    page.send(
        type="SceneNodeClickMessage",
        name=name,
        instance_index=None,
        ray_origin=(0, 0, 0),
        ray_direction=(1, 0, 0),
        screen_pos=(0.5, 0.5),
        modifier=None,
    )
    wait(lambda: inspector._requests.qsize() > 0)
    inspector.tick(0.01)
    assert inspector.links.picked is not None and inspector.links.picked.name == "left"
    assert "0.5 kg at (0.1, 0, 0) m" in inspector.links.facts.content
    tinted = [s.owner for _, s in inspector.viewer.nodes._shapes.values() if s.rgba[:2] == (1.0, 0.45)]
    assert tinted == [(inspector.body.id, inspector.body.link("left").index)]
    inspector.links.pick(None)
    assert not any(s.rgba[:2] == (1.0, 0.45) for _, s in inspector.viewer.nodes._shapes.values())


def test_findings_are_listed_with_their_link(gripper: Path) -> None:
    text = gripper.read_text().replace('<mass value="0.5"/>', '<mass value="-0.5"/>', 1)
    bad = gripper.with_name("bad.urdf")
    bad.write_text(text)
    from roboyard.audit import audit_urdf
    from roboyard.viewer.inspector.panels.findings import about, findings_text

    result = audit_urdf(bad)
    found = [finding for finding in result.findings if about(finding, {'link "left"'})]
    assert found
    shown = findings_text(result)
    assert all(plain(finding.message) in shown for finding in found)


def test_names_from_a_file_are_escaped_on_the_page() -> None:
    assert "<" not in plain('<img src=x onerror="alert(1)">')
    assert plain("left finger") == "left finger"


def test_the_plot_reports_joints_at_rest(inspect) -> None:
    inspector = inspect()
    inspector.play(True)
    inspector.joints.move("grip", 0.6)
    for _ in range(6):
        inspector.tick(1 / 60)
    assert inspector.plot.text.content.startswith("moving")
    for _ in range(150):
        inspector.tick(1 / 60)
    assert "at rest" in inspector.plot.text.content
    time, grip, _ = inspector.plot.plot.data
    assert len(time) == len(grip) >= 20
    assert np.abs(grip).max() > 0.1
    assert (np.diff(time) > 0).all()


def test_the_camera_picture_is_rendered_from_the_world(inspect) -> None:
    from roboyard.viewer.inspector.panels.camera_panel import camera_of

    inspector = inspect()
    camera = camera_of((1.0, -0.6, 0.6), (0.0, 0.0, 0.1), (0.0, 0.0, 1.0), 0.8)
    inspector.camera.take(camera)
    np.testing.assert_array_equal(inspector.camera.picture.image, inspector.world.render(camera).rgb)
    inspector.camera.kind.value = "segmentation"
    inspector.camera.take(camera)
    assert len(np.unique(inspector.camera.picture.image.reshape(-1, 3), axis=0)) >= 3


def test_a_failing_request_is_reported_and_the_page_keeps_running(
    inspect, caplog: pytest.LogCaptureFixture
) -> None:
    inspector = inspect()

    def fail() -> None:
        raise ValueError("no")

    inspector.do(fail)
    inspector.do(lambda: inspector.play(True))
    inspector.tick(0.1)
    assert inspector.is_playing
    assert "a request of the page failed" in caplog.text


def test_a_diverged_simulation_pauses_and_is_reported(inspect) -> None:
    inspector = inspect(fixed_base=False)
    inspector.play(True)
    inspector.tick(0.05)
    inspector.body.set_velocity(angular=(1e12, 0, 1e12))
    inspector.tick(0.05)
    assert not inspector.is_playing
    assert "diverged" in inspector._status.content
    inspector.reset()
    inspector.play(True)
    inspector.tick(0.05)
    assert inspector.is_playing


def test_spheres_come_from_a_planners_file(planner_file: Path, tmp_path: Path) -> None:
    spheres = read_spheres(planner_file)
    assert set(spheres) == {"palm", "left"}
    assert spheres["palm"].radii == pytest.approx([0.06, 0.05])
    wrong = tmp_path / "wrong.yaml"
    wrong.write_text("robot_cfg: {collision_spheres: {palm: [{center: [0, 0], radius: 1}]}}")
    with pytest.raises(ConfigError, match=r"wrong\.yaml: collision_spheres of 'palm'"):
        read_spheres(wrong)
    wrong.write_text("a: [")
    with pytest.raises(ConfigError, match="cannot be read"):
        read_spheres(wrong)
    wrong.write_text("robot_cfg: {}")
    with pytest.raises(ConfigError, match="no collision_spheres"):
        read_spheres(wrong)


def test_robots_are_found_by_file_and_by_name(gripper: Path, monkeypatch, tmp_path: Path) -> None:
    monkeypatch.setenv("ROBOYARD_DATA", str(tmp_path))
    assert find_robot(str(gripper)).urdf == gripper
    assert find_robot("arm7").urdf.name == "arm7.urdf"
    with pytest.raises(RoboyardError, match="there is no file"):
        find_robot("nowhere/robot.urdf")
    with pytest.raises(RoboyardError, match="did you mean 'husky'"):
        find_robot("huskie")


def test_the_command_serves_until_interrupted(gripper: Path, monkeypatch, capsys) -> None:
    from roboyard.cli import main

    def interrupted(self: Inspector) -> None:
        self.tick(0.01)
        raise KeyboardInterrupt

    monkeypatch.setattr(Inspector, "run", interrupted)
    assert main(["view", str(gripper), "--port", "0", "--no-open"]) == 130
    assert "gripper is at http://127.0.0.1:" in capsys.readouterr().out


def test_the_command_names_what_is_missing(capsys) -> None:
    from roboyard.cli import main

    assert main(["view", "no_such_robot", "--no-open"]) == 1
    assert "no file or robot named 'no_such_robot'" in capsys.readouterr().err
