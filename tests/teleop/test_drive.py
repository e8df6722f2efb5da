"""The command `roboyard drive`: options, questions, videos and logs, and a restored terminal."""

from __future__ import annotations

import os
import select
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from roboyard.cli import main
from roboyard.errors import ConfigError
from roboyard.recording import load_log, set_up
from roboyard.recording.replay import frame_indices
from roboyard.sensors import Lidar, Scan, ScanPattern
from roboyard.teleop import drive
from roboyard.teleop.choices import choose
from roboyard.teleop.terminal_image import as_text
from roboyard.teleop.views import from_above

# A shell starts jobs in the background with SIGINT ignored, and their programs inherit that.
START = (
    "import signal, sys; signal.signal(signal.SIGINT, signal.default_int_handler)\n"
    "from roboyard.cli import main; sys.exit(main(sys.argv[1:]))"
)
CRASH = (
    "import sys; from roboyard.teleop.key_bindings import KeyBindings\n"
    "def broken(self, key): raise RuntimeError('broken on purpose')\n"
    "KeyBindings.press = broken\n" + START
)


class Terminal:
    """A program on a pseudo-terminal."""

    def __init__(self, *words: str, code: str = START) -> None:
        import pty
        import termios

        self.master, self.slave = pty.openpty()
        self.before = termios.tcgetattr(self.slave)
        self.program = subprocess.Popen(
            [sys.executable, "-c", code, *words],
            stdin=self.slave, stdout=self.slave, stderr=self.slave, start_new_session=True,
        )  # fmt: skip
        self.text = ""

    def until(self, words: str, seconds: float = 60.0) -> None:
        """Read until the program prints this."""
        end = time.monotonic() + seconds
        while words not in self.text:
            assert time.monotonic() < end, f"waited for {words!r}, got: {self.text[-600:]}"
            if select.select([self.master], [], [], 0.1)[0]:
                self.text += os.read(self.master, 65536).decode(errors="replace")
            elif self.program.poll() is not None:
                raise AssertionError(f"ended before {words!r}: {self.text[-600:]}")

    def say(self, keys: bytes) -> None:
        os.write(self.master, keys)

    def settings(self) -> list:
        import termios

        return termios.tcgetattr(self.slave)

    def end(self, seconds: float = 30.0) -> int:
        """Exit code."""
        end = time.monotonic() + seconds
        while self.program.poll() is None:
            assert time.monotonic() < end, self.text[-600:]
            if select.select([self.master], [], [], 0.1)[0]:
                self.text += os.read(self.master, 65536).decode(errors="replace")
        while select.select([self.master], [], [], 0.1)[0]:
            self.text += os.read(self.master, 65536).decode(errors="replace")
        return self.program.returncode

    def close(self) -> None:
        if self.program.poll() is None:
            self.program.kill()
            self.program.wait()
        os.close(self.master)
        os.close(self.slave)


@pytest.fixture
def started():
    pytest.importorskip("pty")
    pytest.importorskip("termios")
    running: list[Terminal] = []

    def start(*words: str, code: str = START) -> Terminal:
        running.append(Terminal(*words, code=code))
        return running[-1]

    yield start
    for terminal in running:
        terminal.close()


def test_questions_keys_reset_and_quit_on_a_terminal(started, tmp_path: Path) -> None:
    log = tmp_path / "drive.npz"
    terminal = started("drive", "--log", str(log))
    terminal.until("Scene?")
    terminal.until("number or name: ")
    terminal.say(b"empty\n")
    terminal.until("Robot?")
    terminal.say(b"nonsense\n")
    terminal.until("'nonsense' is not one of them.")
    terminal.say(b"rover\n")
    terminal.until("Controller of base?")
    terminal.say(b"DifferentialDriveController\n")
    for _ in range(8):  # other groups keep their defaults
        time.sleep(0.3)
        terminal.until("?")
        if "Control mode?" in terminal.text:
            break
        terminal.say(b"\n")
    terminal.until("Control mode?")
    terminal.say(b"teleop\n")
    terminal.until("reset")
    terminal.until("wheels")
    assert terminal.settings() != terminal.before, "keys are raw while driving"
    for _ in range(25):
        terminal.say(b"i")
        time.sleep(0.03)
    terminal.say(b"m")
    terminal.until("▀")
    terminal.until("scene empty")
    terminal.say(b"r")
    time.sleep(0.3)
    terminal.say(b"\x1b")
    assert terminal.end() == 0, terminal.text[-600:]
    assert terminal.settings() == terminal.before
    found = load_log(log)
    assert found.setup["scene"] == "empty" and found.setup["robot"] == "rover"
    assert (np.diff(found.time) < 0).sum() == 1, "the reset"
    x = found.column(next(name for name in found.position_names if name.endswith("/base.x")))
    assert np.abs(x).max() > 0.02
    assert abs(x[-1]) < 0.5 * np.abs(x).max()
    assert len(list(frame_indices(found, 10))) >= 1


@pytest.mark.parametrize("way", ["Ctrl-C", "crash", "terminated"])
def test_the_terminal_is_restored_after(started, way: str) -> None:
    words = ("drive", "rover", "--scene", "empty", "--control-mode", "teleop")
    terminal = started(*words, code=CRASH if way == "crash" else START)
    terminal.until("Esc   quit")
    end = time.monotonic() + 60.0
    while terminal.settings() == terminal.before:
        assert time.monotonic() < end, "keys are raw while driving"
        time.sleep(0.05)
    if way == "Ctrl-C":
        terminal.program.send_signal(signal.SIGINT)
    elif way == "crash":
        terminal.say(b"i")
    else:
        terminal.program.terminate()
    code = terminal.end()
    assert code == {"Ctrl-C": 130, "crash": 1, "terminated": 143}[way], terminal.text[-600:]
    assert terminal.settings() == terminal.before
    if way == "crash":
        assert "broken on purpose" in terminal.text


def test_random_mode_is_short_repeatable_and_recorded(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    logs = []
    for k in range(2):
        path = tmp_path / f"{k}.npz"
        words = f"drive rover --scene empty --control-mode random --short-exec --seed 4 --log {path}"
        assert main([*words.split(), "--record", str(tmp_path / "video.gif")]) == 0
        logs.append(load_log(path))
    assert "rover in empty: 100 actions" in capsys.readouterr().out
    assert len(logs[0]) == 100
    assert np.array_equal(logs[0].positions, logs[1].positions)
    from PIL import Image

    with Image.open(tmp_path / "video.gif") as video:
        assert 45 <= video.n_frames <= 55, "100 actions at 30 Hz are 3.3 s at 15 pictures a second"
    assert main(["replay", str(tmp_path / "0.npz"), "--record", str(tmp_path / "again.gif")]) == 0


def test_random_commands_are_small_and_held_for_thirty_actions() -> None:
    scene_setup = set_up({"scene": "empty", "robot": "rover"})
    given = []
    robot = scene_setup.robot
    apply = robot.apply_action
    robot.apply_action = lambda action: (given.append(np.array(action)), apply(action))[1]
    assert drive(scene_setup, "random", short=True, seed=1) == 100
    actions = np.array(given)
    assert np.abs(actions).max() <= 0.05
    assert np.flatnonzero(np.abs(np.diff(actions, axis=0)).max(axis=1) > 0).tolist() == [29, 59, 89]


def test_teleop_without_a_terminal_is_an_error(capsys: pytest.CaptureFixture[str]) -> None:
    words = "drive rover --scene empty --control-mode teleop"
    assert main(words.split()) == 1
    assert "driving by keys needs a terminal" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ("drive rovr --scene empty --control-mode random", "did you mean 'rover'"),
        ("drive rover --scene hom --control-mode random", "no scene named 'hom'"),
        ("drive rover --scene empty --control-mode random --log x.txt", "must be a .npz file"),
        (
            "drive rover --scene empty --control-mode random --short-exec --record x.avi",
            "must end in .gif or .mp4",
        ),
    ],
)
def test_wrong_arguments_are_named(words: str, message: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(words.split()) == 1
    assert message in capsys.readouterr().err


def test_choices_accept_numbers_names_and_an_empty_answer(capsys: pytest.CaptureFixture[str]) -> None:
    answers = iter(["7", "b"])
    assert choose("Which?", ["a", "b", "c"], "a", lambda _: next(answers)) == "b"
    assert "'7' is not one of them." in capsys.readouterr().out
    assert choose("Which?", ["a", "b"], "b", lambda _: "") == "b"
    assert choose("Which?", ["a", "b"], "a", lambda _: "2") == "b"
    assert choose("Which?", ["only"], "only", lambda _: pytest.fail("asked")) == "only"

    def no_input(_: str) -> str:
        raise EOFError

    with pytest.raises(ConfigError, match="no answer to 'Which"):
        choose("Which?", ["a", "b"], "a", no_input)


def test_views_cycle_through_sensors_and_scene() -> None:
    from roboyard.teleop.views import Views

    scene_setup = set_up({"scene": "tabletop", "robot": "r1"})
    robot = scene_setup.robot
    name = robot.sensors.add(Lidar(robot.body.link("torso_link4")))
    views = Views(scene_setup)
    seen = [views.next_picture() for _ in range(6)]
    assert [view[0] for view in seen] == [*robot.sensors.names, "scene tabletop", robot.sensors.names[0]]
    assert len(robot.sensors.names) == 4 and robot.sensors.names[-1] == name
    assert np.array_equal(seen[0][1], robot.sensors[seen[0][0]].image().rgb)
    assert seen[0][1].shape == (128, 128, 3) and seen[4][1].shape == (54, 72, 3)


def test_a_scan_is_drawn_as_a_map() -> None:
    """A point 2 m ahead is at the top, a point 1 m to the left half way to the left edge."""
    pattern = ScanPattern(horizontal_fov_deg=270, horizontal_resolution_deg=90, yaw_offset_deg=0)
    ranges = np.array([[np.inf, 2.0, 1.0]])
    scan = Scan(
        ranges=ranges, owners=np.zeros((1, 3, 2), np.int32), position=np.zeros(3), rotation=np.eye(3),
        pattern=pattern,
    )  # fmt: skip
    picture = from_above(scan, 19)
    assert [tuple(p) for p in np.argwhere(picture.any(axis=2))] == [(1, 9), (9, 5), (9, 9)]


def test_pictures_are_drawn_with_half_blocks() -> None:
    wide = as_text(np.full((4, 4, 3), 7, dtype=np.uint8), 2)
    assert wide == "\x1b[38;2;7;7;7m\x1b[48;2;7;7;7m▀" * 2 + "\x1b[0m"
    text = as_text(np.array([[[1, 2, 3]], [[4, 5, 6]], [[7, 8, 9]]], dtype=np.uint8))
    assert text == "\x1b[38;2;1;2;3m\x1b[48;2;4;5;6m▀\x1b[0m"
