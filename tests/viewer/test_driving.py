"""Driving from a page: keys, joysticks, handles and buttons move the robot."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from roboyard.errors import ConfigError
from roboyard.recording import load_log
from roboyard.sensors import Lidar
from roboyard.viewer.driving import DrivingPage
from roboyard.viewer.driving.video import free_file

pytest.importorskip("viser")


@pytest.fixture(scope="module")
def served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[DrivingPage]:
    page = DrivingPage(
        {"scene": "empty", "robot": "r1"}, port=0, folder=tmp_path_factory.mktemp("videos"), quiet=True
    )
    yield page
    page.close()


@pytest.fixture
def page(served: DrivingPage) -> DrivingPage:
    """Return R1 on an empty floor in its initial state."""
    if served.scene_setup.setup["robot"] != "r1" or served.scene_setup.scene.name != "empty":
        served.set_up({"scene": "empty", "robot": "r1"})
    served.reset()
    served.play(True)
    return served


@pytest.fixture
def rover(served: DrivingPage) -> DrivingPage:
    """Return the rover on an empty floor."""
    served.set_up({"scene": "empty", "robot": "rover"})
    return served


def run(page: DrivingPage, seconds: float) -> None:
    for _ in range(round(seconds * 30)):
        page.tick(1 / 30)


def place(page: DrivingPage) -> np.ndarray:
    return page.robot.position.copy()


class Typist:
    """Presses keys on a page."""

    def __init__(self, page: DrivingPage, tab: Any) -> None:
        self._script, self._tab, self._count = page.keys._script, tab, 0

    def __call__(self, key: str, is_down: bool) -> None:
        self._count += 1
        text = json.dumps([f"{id(self)} {self._count}", [[key, is_down]]])
        self._tab.send(type="GuiUpdateMessage", uuid=self._script._uuid, updates={"value": text})


def pull(page: DrivingPage, tab: Any, wait: Callable, name: str, x: float, y: float) -> None:
    text = json.dumps([f"{name} {x} {y}", [name, x, y]])
    tab.send(type="GuiUpdateMessage", uuid=page.joysticks._script._uuid, updates={"value": text})
    wait(lambda: page.joysticks.values[name] == (x, y))


@pytest.mark.parametrize(("key", "axis", "sign"), [("i", 0, 1), ("k", 0, -1), (",", 1, 1), (".", 1, -1)])
def test_a_held_key_drives_the_base_until_it_is_released(page, browser, wait, key, axis, sign) -> None:
    tab = browser(page.viewer)
    press = Typist(page, tab)
    before = place(page)
    press(key, True)
    wait(lambda: key in page.keys.held)
    run(page, 1.0)
    moved = place(page) - before
    assert sign * moved[axis] > 0.2
    assert abs(moved[1 - axis]) < 0.02
    press(key, False)
    wait(lambda: not page.keys.held)
    run(page, 1.0)
    stopped = place(page)
    run(page, 0.5)
    assert np.abs(place(page) - stopped).max() < 0.005


def test_a_key_pressed_and_released_between_two_ticks_acts(page, browser, wait) -> None:
    press = Typist(page, browser(page.viewer))
    run(page, 0.1)
    press("2", True)
    press("2", False)
    press("i", True)
    press("i", False)
    wait(lambda: page._events.qsize() == 4)
    before = page.action_source.key_bindings.joint
    page.tick(1 / 30)
    assert page.action_source.key_bindings.joint == before + 1
    start = place(page)
    run(page, 0.2)
    assert place(page)[0] > start[0] - 1e-6


def test_joysticks_move_the_base_and_are_released_when_the_page_closes(page, browser, wait) -> None:
    assert page.action_source.joysticks == ("move", "turn")
    tab = browser(page.viewer)
    wait(lambda: page.viewer.watchers == 1)
    before = place(page)
    pull(page, tab, wait, "move", -1.0, 0.0)
    run(page, 1.0)
    assert place(page)[1] - before[1] > 0.2  # to the left
    pull(page, tab, wait, "move", 0.0, 0.0)
    pull(page, tab, wait, "turn", 0.5, 0.0)
    run(page, 1.0)
    x, y, z, w = page.robot.orientation
    assert np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z)) < -0.2  # to the right
    tab.close()
    wait(lambda: page.joysticks.values["turn"] == (0.0, 0.0))


def test_joysticks_ignore_invalid_values(page, browser, wait) -> None:
    tab = browser(page.viewer)
    for count, value in enumerate(
        (["move", 5, 0], ["move", float("nan"), 0], ["x", 0, 0], [["move"], 0, 0], 7)
    ):
        text = json.dumps([f"rubbish {count}", value])
        tab.send(type="GuiUpdateMessage", uuid=page.joysticks._script._uuid, updates={"value": text})
    pull(page, tab, wait, "move", 0.25, 0.5)
    assert page.joysticks.values == {"move": (0.25, 0.5), "turn": (0.0, 0.0)}


def test_the_end_effector_follows_a_dragged_handle(page, browser, wait) -> None:
    run(page, 0.5)
    group = "arm_left"
    handle = page.ik_handles.handles[group]
    np.testing.assert_allclose(handle.position, page.action_source.end_effector_pose(group)[:3, 3], atol=2e-3)
    goal = np.add(handle.position, (0.05, 0.03, 0.08))
    tab = browser(page.viewer)
    tab.send(type="TransformControlsDragStartMessage", name=handle.name)
    tab.send(
        type="TransformControlsUpdateMessage",
        name=handle.name,
        position=tuple(goal.tolist()),
        wxyz=tuple(float(v) for v in handle.wxyz),
    )
    tab.send(type="TransformControlsDragEndMessage", name=handle.name)
    wait(
        lambda: (
            group in page.action_source.targets
            and np.allclose(page.action_source.targets[group][:3, 3], goal)
        )
    )
    run(page, 2.0)
    np.testing.assert_allclose(page.action_source.end_effector_pose(group)[:3, 3], goal, atol=5e-3)
    np.testing.assert_allclose(handle.position, goal, atol=1e-6)  # the handle stays at its target
    before = page.robot.base_link.pose[0]
    page.joysticks._pulled["move"] = (0, 0.0, 1.0)
    run(page, 1.0)
    page.joysticks._pulled.clear()
    assert page.robot.base_link.pose[0][0] - before[0] > 0.2  # the end effector moves with the base
    np.testing.assert_allclose(page.action_source.end_effector_pose(group)[:3, 3], goal, atol=0.02)
    page.ik_handles.release()
    assert page.action_source.targets == {}


def test_a_key_for_an_end_effector_drops_its_handle_target(page) -> None:
    page.action_source.targets["arm_left"] = page.action_source.end_effector_pose("arm_left")
    page.action_source.targets["arm_right"] = page.action_source.end_effector_pose("arm_right")
    page.action_source.action({"ArrowUp"})
    assert set(page.action_source.targets) == {"arm_right"}


def test_gripper_buttons_open_and_close(page) -> None:
    index, name = next(
        (k, n) for k, (n, _) in enumerate(page.action_source.key_bindings.grippers) if "left" in n
    )
    places = page.robot.groups[name].indices
    page.action_source.key_bindings.set_gripper(index, is_open=False)
    run(page, 1.5)
    closed = page.robot.joint_arrays.q[places].copy()
    page.action_source.key_bindings.set_gripper(index, is_open=True)
    run(page, 1.5)
    assert (page.robot.joint_arrays.q[places] - closed > 0.02).all()


def test_controllers_change_without_moving_the_robot(page) -> None:
    run(page, 0.2)
    before, time = page.robot.joint_arrays.q.copy(), page.world.time
    page.set_speed(0.25)
    page.set_controllers({"arm_left": "JointController"})
    assert type(page.robot.controllers["arm_left"]).__name__ == "JointController"
    assert page.action_source.arms == ("arm_right",)
    assert set(page.ik_handles.handles) == {"arm_right"}
    assert page.world.time == time
    assert page.action_source.speed == 0.25
    run(page, 0.5)
    assert np.abs(page.robot.joint_arrays.q - before).max() < 0.05
    page.set_controllers({"arm_left": "InverseKinematicsController"})
    assert set(page.ik_handles.handles) == {"arm_left", "arm_right"}


def test_reset_and_moments_restore_the_state_bit_for_bit(page, tmp_path: Path) -> None:
    page.joysticks._pulled["move"] = (0, 0.0, 1.0)
    run(page, 0.7)
    name = page.save_moment()
    saved, time = page.world.data.qpos.copy(), page.world.time
    run(page, 0.7)
    page.joysticks._pulled.clear()
    page.load_moment(page.moments[name])
    np.testing.assert_array_equal(page.world.data.qpos, saved)
    assert page.world.time == time
    run(page, 0.5)  # the controllers hold the restored state
    assert np.abs(place(page)[:2] - saved[:2]).max() < 0.15
    file = page.moments[name].save(tmp_path / "moment.npz")
    page.reset()
    assert np.abs(place(page)[:2]).max() < 1e-6
    page.panel._load_upload(file.read_bytes())
    np.testing.assert_array_equal(page.world.data.qpos, saved)
    assert load_log(file).setup["robot"] == "r1"


def test_an_uploaded_file_loads_only_offered_scenes(page, tmp_path: Path) -> None:
    log = page.moments[page.save_moment()]
    log.setup["scene"] = str(tmp_path / "scene.xml")
    file = log.save(tmp_path / "evil.npz")
    log.setup["scene"] = "empty"
    with pytest.raises(ConfigError, match="no scene named"):
        page.panel._load_upload(file.read_bytes())
    with pytest.raises(ConfigError, match="is not a state log"):
        page.panel._load_upload(b"rubbish")
    page.panel.scene_choice.value = "../../etc/passwd"
    with pytest.raises(ConfigError, match="no scene named"):
        page.panel._set_up()


def test_another_scene_replaces_the_first(page) -> None:
    page.set_up({"scene": "tabletop", "robot": "r1"})
    assert page.viewer.world is page.world
    assert any("table" in path for path in page.viewer.nodes._frames)
    run(page, 0.3)
    assert page.world.time > 0.2
    assert set(page.ik_handles.handles) == {"arm_left", "arm_right"}


def test_the_scene_stays_when_another_one_fails_to_load(page) -> None:
    before = page.scene_setup
    page.requests.execute(lambda: page.set_up({"scene": "no_such_place", "robot": "r1"}))
    assert page.scene_setup is before
    assert "no scene named" in page.panel.status.content
    assert set(page.ik_handles.handles) == {"arm_left", "arm_right"}


def test_a_video_is_recorded_from_the_page_camera(page) -> None:
    path = page.start_video(ending="gif")
    assert path.name == "r1-empty-1.gif"
    page.joysticks._pulled["turn"] = (0, 1.0, 0.0)
    run(page, 1.0)
    page.joysticks._pulled.clear()
    assert page.stop_video() == path
    from PIL import Image

    with Image.open(path) as video:
        assert video.n_frames == pytest.approx(15, abs=1)  # type: ignore[attr-defined]
        assert video.size == (480, 360)
    assert free_file(page.folder, "r1-empty", "gif").name == "r1-empty-2.gif"


def test_a_rover_has_one_joystick_and_no_handles(rover, browser, wait) -> None:
    assert rover.action_source.joysticks == ("drive",)
    assert rover.ik_handles.handles == {}
    assert not rover.panel.handles_box.visible
    tab = browser(rover.viewer)
    before = place(rover)
    pull(rover, tab, wait, "drive", 0.0, 1.0)
    run(rover, 1.0)
    assert place(rover)[0] - before[0] > 0.05


def test_messages_kept_for_late_pages_do_not_accumulate(page, browser, wait) -> None:
    kept = page.viewer.server._websock_server._broadcast_buffer.message_from_id
    for stay in range(2):
        tab = browser(page.viewer)
        wait(lambda: page.viewer.watchers == 1)
        page.joysticks._pulled["turn"] = (99, 1.0, 0.0)
        before, sent = len(kept), page.viewer.frames_sent
        for _ in range(40):
            run(page, 0.1)
            page.viewer.sync(wait=True)
        assert page.viewer.frames_sent > sent + 30
        tab.close()
        wait(lambda: page.viewer.watchers == 0)
        if stay:
            assert len(kept) <= before + 2
    page.joysticks._pulled.clear()


def test_pausing_stops_the_world(page) -> None:
    page.play(False)
    time = page.world.time
    run(page, 0.3)
    assert page.world.time == time
    assert not page.viewer.bar.state["playing"]


def test_the_command_drives_in_the_browser(monkeypatch, capsys, tmp_path: Path) -> None:
    from roboyard.cli import main

    video, log = tmp_path / "drive.gif", tmp_path / "drive.npz"
    words = ["drive", "rover", "--scene", "empty", "--browser", "--port", "0", "--no-open", "--short-exec"]
    monkeypatch.setattr("roboyard.teleop.loop.SHORT", 12)
    assert main([*words, "--record", str(video), "--log", str(log)]) == 0
    output = capsys.readouterr().out
    assert "Roboyard: drive is at http://127.0.0.1:" in output
    assert f"wrote {video}" in output
    assert f"wrote {log}" in output
    assert len(load_log(log)) == 12
    assert main([*words, "--seed", "3"]) == 1
    assert "--browser cannot be combined with --control-mode random or --seed" in capsys.readouterr().err


def test_lidar_scans_are_shown_when_switched_on(page: DrivingPage) -> None:
    assert not page.panel.scans_box.visible  # R1 has none
    page.robot.sensors.add(Lidar(page.robot.body.link("base_link"), position=(0, 0, 0.6), rate=10))
    crate = page.world.add_box((1, 1, 2), (3, 0, 1))
    try:
        page.panel.show_robot()
        assert page.panel.scans_box.visible
        page.viewer.watchers += 1
        run(page, 0.3)
        assert not len(page.scans.points)
        page.panel.scans_box.value = True
        time.sleep(0.12)
        run(page, 0.1)
        assert len(page.scans.points) > 10
        assert page.scans.points[:, 0].min() == pytest.approx(2.5, abs=0.01)
        page.panel.scans_box.value = False
        time.sleep(0.12)
        run(page, 0.1)
        assert not len(page.scans.points)
    finally:
        page.viewer.watchers -= 1
        page.world.remove(crate)
        page.set_up({"scene": "empty", "robot": "r1"})
