"""The state that a client keeps, without a world: ids, user data, logs, debug items, input, files."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from roboyard.pybullet.face import constants as c
from roboyard.pybullet.logs.log_set import LogSet
from roboyard.pybullet.state import debug_items, input_events
from roboyard.pybullet.state.engine_parameters import EngineParameters
from roboyard.pybullet.state.file_search import find_file, not_found_remedy
from roboyard.pybullet.state.frames import inertial_pose
from roboyard.pybullet.state.ids import Counter, IdPool, drop_from_order
from roboyard.pybullet.state.user_data import UserData, UserDataKey


def test_the_id_freed_last_is_reused_first() -> None:
    pool = IdPool()
    assert [pool.take() for _ in range(4)] == [0, 1, 2, 3]
    pool.free(1)
    pool.free(2)
    assert [pool.take() for _ in range(3)] == [2, 1, 4]


def test_a_counter_only_counts_up() -> None:
    counter = Counter(1)
    assert [counter.take() for _ in range(3)] == [1, 2, 3]


@pytest.mark.parametrize(
    ("removed", "left"), [(0, [3, 1, 2]), (1, [0, 3, 2]), (2, [0, 1, 3]), (3, [0, 1, 2])]
)
def test_the_last_takes_the_place_of_a_removed_id(removed: int, left: list[int]) -> None:
    order = [0, 1, 2, 3]
    drop_from_order(order, removed)
    assert order == left


class TestUserData:
    def test_an_entry_keeps_its_id_when_its_text_changes(self) -> None:
        data, key = UserData(), UserDataKey(0, -1, -1, "name")
        assert data.put(key, "a") == data.put(key, "b") == 0
        assert data.value(0) == b"b"
        assert data.find(key) == 0

    def test_removed_ids_are_reused(self) -> None:
        data = UserData()
        keys = [UserDataKey(0, link, -1, "k") for link in range(3)]
        assert [data.put(key, "") for key in keys] == [0, 1, 2]
        assert data.remove(1)
        assert not data.remove(1)
        assert data.find(keys[1]) == -1
        assert data.put(UserDataKey(5, 0, 0, "new"), "") == 1

    def test_bodies_are_removed_with_all_entries(self) -> None:
        data = UserData()
        for body in (0, 1, 2):
            for key in "xy":
                data.put(UserDataKey(body, -1, -1, key), key)
        data.remove_bodies([0, 2])
        assert data.of_body(0) == data.of_body(2) == []
        assert [key.key for _, key in data.of_body(1)] == ["x", "y"]


@pytest.mark.parametrize("seed", range(3))
def test_user_data_of_removed_bodies_end_whatever_came_before(seed: int) -> None:
    drawn, data, there = np.random.default_rng(seed), UserData(), dict[tuple[int, int, int, str], int]()
    for _ in range(1500):
        body, chance = int(drawn.integers(6)), drawn.random()
        if chance < 0.5:
            place = (body, -1, -1, str(drawn.integers(8)))
            there[place] = data.put(place, "text")
        elif chance < 0.8 and there:
            assert data.remove(there.pop(list(there)[int(drawn.integers(len(there)))]))
        else:
            data.remove_bodies([body])
            there = {place: number for place, number in there.items() if place[0] != body}
        assert all(data.find(place) == number for place, number in there.items())
        assert sum(len(data.of_body(k)) for k in range(6)) == len(there)


class Recorder:
    def __init__(self) -> None:
        self.steps, self.closed = 0, False

    def record(self) -> None:
        self.steps += 1

    def close(self) -> None:
        self.closed = True


def test_logs_record_until_they_are_stopped() -> None:
    logs, first, second = LogSet(), Recorder(), Recorder()
    assert not logs
    assert (logs.start(first), logs.start(second)) == (0, 1)
    logs.after_step()
    logs.stop(0)
    logs.stop(7)
    logs.after_step()
    assert (first.steps, second.steps) == (1, 2)
    assert first.closed
    assert logs.first_of(Recorder) is second
    assert logs.first_of(int) is None
    logs.stop_all()
    assert second.closed
    assert not logs


class TestDebugItems:
    line = debug_items.Line(start=(0, 0, 0), end=(1, 0, 0), rgb=(1, 0, 0), width=1)

    def test_items_and_parameters_share_one_count(self) -> None:
        items = debug_items.DebugItems()
        parameter = debug_items.Parameter(name="p", lower=0, upper=1, value=0.5)
        assert (items.add(self.line), items.add_parameter(parameter), items.add(self.line)) == (0, 1, 2)

    def test_a_replaced_item_keeps_its_id(self) -> None:
        items = debug_items.DebugItems()
        items.add(self.line)
        other = debug_items.Line(start=(5, 5, 5), end=(1, 0, 0), rgb=(1, 0, 0), width=1)
        assert items.add(other, replaces=0) == 0
        assert dict(items.drawings()) == {0: other}
        assert items.add(self.line, replaces=9) == 1

    def test_removals_change_the_revision(self) -> None:
        items = debug_items.DebugItems()
        items.add(self.line)
        seen = {items.revision}
        for change in (lambda: items.remove(0), items.remove_drawings, items.remove_parameters):
            change()
            assert items.revision not in seen
            seen.add(items.revision)
        assert list(items.drawings()) == []

    def test_items_expire(self, monkeypatch: pytest.MonkeyPatch) -> None:
        now = [0.0]
        monkeypatch.setattr("roboyard.pybullet.state.debug_items.monotonic", lambda: now[0])
        items = debug_items.DebugItems()
        items.add(debug_items.Line(start=(0, 0, 0), end=(1, 0, 0), rgb=(1, 0, 0), width=1, expires=2.0))
        assert items.has_expiring
        assert len(list(items.drawings())) == 1
        now[0] = 2.0
        assert list(items.drawings()) == []
        assert not items.has_expiring

    @pytest.mark.parametrize(("lower", "upper", "is_button"), [(0, 1, False), (1, 0, True), (2, 2, False)])
    def test_a_downward_range_is_a_button(self, lower: float, upper: float, is_button: bool) -> None:
        parameter = debug_items.Parameter(name="p", lower=lower, upper=upper, value=0)
        assert parameter.is_button is is_button


class TestKeyboard:
    @pytest.mark.parametrize(
        ("name", "code"),
        [
            ("a", 97), ("A", 97), ("1", 49), (" ", 32), ("ArrowUp", c.B3G_UP_ARROW), ("F1", c.B3G_F1),
            ("F15", c.B3G_F15), ("Enter", c.B3G_RETURN), ("Tab", 9), ("Dead", None),
        ],
    )  # fmt: skip
    def test_names_of_browsers_have_codes(self, name: str, code: int | None) -> None:
        assert input_events.key_code(name) == code

    def test_a_pressed_key_is_triggered_once(self) -> None:
        keyboard = input_events.Keyboard()
        keyboard.press(97)
        keyboard.press(97)
        assert keyboard.take() == {97: c.KEY_IS_DOWN | c.KEY_WAS_TRIGGERED}
        assert keyboard.take() == {97: c.KEY_IS_DOWN}
        keyboard.release(97)
        keyboard.release(98)
        assert keyboard.take() == {97: c.KEY_WAS_RELEASED}
        assert keyboard.take() == {}

    def test_a_key_pressed_and_released_between_two_reads(self) -> None:
        keyboard = input_events.Keyboard()
        keyboard.press(97)
        keyboard.release(97)
        assert keyboard.take() == {97: c.KEY_WAS_TRIGGERED | c.KEY_WAS_RELEASED}


def test_mouse_events_come_in_order_and_once() -> None:
    mouse = input_events.Mouse()
    mouse.move(1, 2)
    mouse.button(1, 2, 0, is_down=True)
    mouse.button(3, 4, 0, is_down=False)
    down = c.KEY_IS_DOWN | c.KEY_WAS_TRIGGERED
    assert mouse.take() == ((1, 1, 2, -1, 0), (2, 1, 2, 0, down), (2, 3, 4, 0, c.KEY_WAS_RELEASED))
    assert mouse.take() == ()
    for k in range(input_events.MAX_MOUSE_EVENTS + 10):
        mouse.move(k, 0)
    events = mouse.take()
    assert len(events) == input_events.MAX_MOUSE_EVENTS
    assert events[0][1] == 10, "the oldest are dropped"


def test_a_reset_keeps_the_time_step() -> None:
    parameters = EngineParameters(time_step=0.01, gravity=(1, 2, 3), iterations=7)
    parameters.reset()
    assert parameters.gravity == (0, 0, 0)
    assert parameters.iterations == 50
    assert parameters.time_step == 0.01
    assert parameters.revision == 1


class TestFileSearch:
    def test_the_working_folder_comes_before_the_search_path(
        self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        for folder in ("here", "there"):
            (tmp_path / folder).mkdir()
            (tmp_path / folder / "a.urdf").write_text(folder)
        monkeypatch.chdir(tmp_path / "here")
        assert find_file(tmp_path / "there", "a.urdf") == tmp_path / "here" / "a.urdf"
        (tmp_path / "here" / "a.urdf").unlink()
        assert find_file(tmp_path / "there", "a.urdf") == tmp_path / "there" / "a.urdf"
        assert find_file(None, "a.urdf") is None

    def test_data_folders_nearby_are_searched(self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        (tmp_path / "data").mkdir()
        (tmp_path / "data" / "b.urdf").write_text("")
        (tmp_path / "deep" / "er").mkdir(parents=True)
        for folder in (tmp_path, tmp_path / "deep", tmp_path / "deep" / "er"):
            monkeypatch.chdir(folder)
            found = find_file(None, "b.urdf")
            assert found is not None
            assert found.resolve() == tmp_path / "data" / "b.urdf"

    def test_absolute_names(self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        file = tmp_path / "c.urdf"
        file.write_text("")
        assert find_file(None, str(file)) == file
        monkeypatch.chdir(tmp_path)
        assert find_file(None, "/c.urdf") == file, "a leading slash is no obstacle, as in Bullet"

    def test_the_remedy_names_the_folders(self, tmp_path: Path) -> None:
        assert "setAdditionalSearchPath" in not_found_remedy(None, "x")
        text = not_found_remedy(tmp_path, "x")
        assert str(tmp_path) in text
        assert "'x'" in text


def test_an_inertial_pose_is_the_product_of_poses() -> None:
    from roboyard.description.model import Pose
    from roboyard.transforms import pose_matrix

    rng = np.random.default_rng(3)
    for _ in range(20):
        q, r = rng.normal(size=(2, 4))
        q, r = q / np.linalg.norm(q), r / np.linalg.norm(r)
        t, u = rng.normal(size=(2, 3))
        found = inertial_pose(t, q, Pose(position=tuple(u), quaternion=tuple(r)))
        assert pose_matrix(*found) == pytest.approx(pose_matrix(t, q) @ pose_matrix(u, r))
