"""Videos contain the pictures that were added, at the given rate."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image as Pillow

from roboyard.cli import main
from roboyard.errors import ConfigError, MissingExtraError
from roboyard.recording import Recorder, VideoWriter, set_up
from roboyard.recording.replay import frame_indices, replay_video


def _frames() -> list[np.ndarray]:
    frames = []
    for k in range(10):
        frame = np.full((48, 64, 3), 30, dtype=np.uint8)
        frame[:, 6 * k : 6 * k + 6] = (200, 60, 40)
        frames.append(frame)
    return frames


def test_a_gif_keeps_pictures_and_rate(tmp_path: Path) -> None:
    with VideoWriter(tmp_path / "a.gif", fps=10) as video:
        for frame in _frames():
            video.add(frame)
    with Pillow.open(tmp_path / "a.gif") as gif:
        assert gif.n_frames == 10
        for k in (0, 5, 9):
            gif.seek(k)
            assert gif.info["duration"] == 100
            seen = np.asarray(gif.convert("RGB"))
            assert abs(int(seen[20, 6 * k + 3, 0]) - 200) < 12


def test_an_mp4_keeps_pictures_and_rate(tmp_path: Path) -> None:
    ffmpeg = pytest.importorskip("imageio_ffmpeg")
    with VideoWriter(tmp_path / "a.mp4", fps=10) as video:
        for frame in _frames():
            video.add(frame)
    reader = ffmpeg.read_frames(str(tmp_path / "a.mp4"))
    about = next(reader)
    assert about["fps"] == pytest.approx(10)
    assert tuple(about["size"]) == (64, 48)
    seen = [np.frombuffer(raw, dtype=np.uint8).reshape(48, 64, 3) for raw in reader]
    assert len(seen) == 10
    for k in (1, 5, 8):
        assert int(seen[k][20, 6 * k + 3, 0]) > 120


def test_an_mp4_without_ffmpeg_names_the_extra_to_install(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    with pytest.raises(MissingExtraError, match='the extra "video": pip install "imageio-ffmpeg'):
        VideoWriter(tmp_path / "a.mp4")


def test_invalid_videos_are_errors(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"must end in .gif or .mp4, got .*a.avi"):
        VideoWriter(tmp_path / "a.avi")
    with pytest.raises(ConfigError, match="at most 50, got 60"):
        VideoWriter(tmp_path / "a.gif", fps=60)
    with pytest.raises(ConfigError, match=r"folder .* not found"):
        VideoWriter(tmp_path / "no" / "a.gif")
    with VideoWriter(tmp_path / "a.gif") as video:
        video.add(np.zeros((8, 8, 3), dtype=np.uint8))
        with pytest.raises(ValueError, match="one size"):
            video.add(np.zeros((9, 8, 3), dtype=np.uint8))
    assert VideoWriter(tmp_path / "b.gif").close() is None


def test_a_log_is_rendered_as_a_video(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    scene_setup = set_up({"scene": "tabletop"})
    world, can = scene_setup.scene.world, scene_setup.scene.body("can")
    recorder = Recorder(world, setup=scene_setup.setup)
    recorder.record()
    can.set_velocity(linear=(0, 0, 2.0))
    for _ in range(24):
        world.step(5)
        recorder.record()
    log = recorder.log()
    shown = list(frame_indices(log, 10))
    assert len(shown) == 6 and shown[0] == 0 and shown[-1] == 24
    assert np.allclose(log.time[shown], np.arange(6) / 10, atol=0.021)
    path = log.save(tmp_path / "hop.npz")
    assert replay_video(log, tmp_path / "direct.gif", fps=10, width=64, height=48) == 6
    code = main(["replay", str(path), "--record", str(tmp_path / "again.gif"), "--fps", "10",
                 "--width", "64", "--height", "48"])  # fmt: skip
    printed = capsys.readouterr().out
    assert code == 0
    assert "25 states in 0.50 s" in printed and "can/base.z" in printed and "6 pictures" in printed
    assert (tmp_path / "again.gif").read_bytes() == (tmp_path / "direct.gif").read_bytes()


def test_replay_of_a_missing_log_is_one_error_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["replay", str(tmp_path / "none.npz")]) == 1
    assert capsys.readouterr().err.startswith("roboyard: error: state log ")
