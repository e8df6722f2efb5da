from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import roboyard.pybullet as p
from roboyard.pybullet.client import Client
from roboyard.pybullet.connections import CLIENTS

PRINTED_CAMERA = (
    1024,
    768,
    (
        *(0.642787516117096, -0.4393851161003113, 0.6275069713592529, 0.0),
        *(0.766044557094574, 0.36868777871131897, -0.5265407562255859, 0.0),
        *(-0.0, 0.8191521167755127, 0.5735764503479004, 0.0),
        *(2.384185791015625e-07, 2.384185791015625e-07, -5.000000476837158, 1.0),
    ),
    (
        *(0.7499999403953552, 0.0, 0.0, 0.0),
        *(0.0, 1.0, 0.0, 0.0),
        *(0.0, 0.0, -1.0000200271606445, -1.0),
        *(0.0, 0.0, -0.02000020071864128, 0.0),
    ),
    (0.0, 0.0, 1.0),
    (-0.6275069713592529, 0.5265407562255859, -0.5735764503479004),
    (17141.001953125, 20427.853515625, -0.0),
    (-8787.701171875, 7373.75537109375, 16383.041015625),
    50.0,
    -35.0,
    5.0,
    (0.0, 0.0, 0.0),
)


def flat(value: object) -> list[float]:
    return [x for part in value for x in flat(part)] if isinstance(value, tuple) else [value]


def items(client: int) -> dict[int, object]:
    found = CLIENTS[client]
    assert isinstance(found, Client)
    return dict(found.debug_items.drawings())


def test_the_camera_starts_where_pybullets_window_does(window: int) -> None:
    camera = p.getDebugVisualizerCamera()
    assert [type(part) for part in camera] == [type(part) for part in PRINTED_CAMERA]
    np.testing.assert_allclose(flat(camera), flat(PRINTED_CAMERA), rtol=1e-4, atol=1e-6)


def test_without_a_window_there_is_no_camera(client: int) -> None:
    """As PyBullet 3.2.7 prints it in DIRECT, also after the camera was moved."""
    none, matrix = (0.0, 0.0, 0.0), (0.0,) * 16
    recorded = (0, 0, matrix, matrix, none, none, none, none, 0.0, 0.0, 0.0, none)
    assert repr(p.getDebugVisualizerCamera()) == repr(recorded)
    p.resetDebugVisualizerCamera(3, 10, -20, [1, 2, 3])
    assert repr(p.getDebugVisualizerCamera()) == repr(recorded)


def test_the_camera_moves(window: int) -> None:
    p.resetDebugVisualizerCamera(4, 30, -20, [1, 2, 3])
    camera = p.getDebugVisualizerCamera()
    assert camera[2] == p.computeViewMatrixFromYawPitchRoll([1, 2, 3], 4, 30, -20, 0, 2)
    assert camera[8:] == (30.0, -20.0, 4.0, (1.0, 2.0, 3.0))
    p.configureDebugVisualizer(p.COV_ENABLE_Y_AXIS_UP, 1)
    assert p.getDebugVisualizerCamera()[4] == (0.0, 1.0, 0.0)


def test_drawings_share_one_count_and_are_replaced_in_place(client: int) -> None:
    line = p.addUserDebugLine([0, 0, 0], [1, 0, 0], [1, 0, 0], lineWidth=2.0)
    label = p.addUserDebugText("here", [0, 0, 1], parentObjectUniqueId=3, parentLinkIndex=1)
    cloud = p.addUserDebugPoints(np.zeros((5, 3)), np.ones((5, 3)), 3)
    assert [line, label, cloud] == [0, 1, 2]
    assert p.addUserDebugLine([0, 0, 0], [0, 1, 0], replaceItemUniqueId=line) == line
    assert p.addUserDebugLine([0, 0, 0], [0, 1, 0], replaceItemUniqueId=99) == 3
    found = items(client)
    assert found[line].end == (0.0, 1.0, 0.0)
    assert found[line].rgb == (1.0, 1.0, 1.0)
    assert found[label].parent == (3, 1)
    assert found[cloud].positions.shape == (5, 3)
    p.removeUserDebugItem(line)
    p.removeUserDebugItem(12345)
    assert sorted(items(client)) == [1, 2, 3]
    p.removeAllUserDebugItems()
    assert items(client) == {}


def test_drawings_end_their_lives(client: int, monkeypatch: pytest.MonkeyPatch) -> None:
    now = [100.0]
    monkeypatch.setattr("roboyard.pybullet.api.debug.monotonic", lambda: now[0])
    monkeypatch.setattr("roboyard.pybullet.state.debug_items.monotonic", lambda: now[0])
    p.addUserDebugLine([0, 0, 0], [1, 0, 0], lifeTime=2)
    p.addUserDebugLine([0, 0, 0], [1, 0, 0])
    now[0] = 101.0
    assert sorted(items(client)) == [0, 1]
    now[0] = 102.5
    assert sorted(items(client)) == [1]


def test_sliders_hold_their_start_value(client: int) -> None:
    slider = p.addUserDebugParameter("gain", 0, 10, 2.5)
    assert p.readUserDebugParameter(slider) == 2.5
    assert p.readUserDebugParameter(p.addUserDebugParameter("push", 1, 0, 0)) == 0.0
    p.removeAllUserDebugItems()
    assert p.readUserDebugParameter(slider) == 2.5
    p.removeAllUserParameters()
    with pytest.raises(p.error, match=r"(?m)^Failed to read parameter\.$"):
        p.readUserDebugParameter(slider)


def test_wrong_drawings_raise(client: int) -> None:
    with pytest.raises(p.error, match=r"(?m)^Error converting lineFrom\[3\]$"):
        p.addUserDebugLine([0, 0], [1, 0, 0])
    with pytest.raises(p.error, match=r"(?m)^Error converting textPositionObj\[3\]$"):
        p.addUserDebugText("a", [0, 0])
    with pytest.raises(p.error, match=r"(?m)^numColors must match numPositions\.$"):
        p.addUserDebugPoints([[0, 0, 0]], [[0, 0, 0], [1, 1, 1]])


def test_a_window_that_is_not_there_is_silent(client: int) -> None:
    assert (p.getKeyboardEvents(), p.getMouseEvents(), p.getVREvents()) == ({}, (), ())
    assert p.configureDebugVisualizer(p.COV_ENABLE_GUI, 0) is None
    assert p.setVRCameraState() is None


def test_timings_are_a_trace(client: int, tmp_path: Path) -> None:
    log = p.startStateLogging(p.STATE_LOGGING_PROFILE_TIMINGS, str(tmp_path / "trace"))
    assert log == 0
    assert p.startStateLogging(p.STATE_LOGGING_PROFILE_TIMINGS, str(tmp_path / "second")) is None
    p.submitProfileTiming("outer")
    p.submitProfileTiming("inner")
    p.submitProfileTiming()
    p.submitProfileTiming()
    p.stopStateLogging(log)
    events = json.loads((tmp_path / "trace_0.json").read_text())["traceEvents"]
    assert [event["name"] for event in events] == ["inner", "outer"]
    inner, outer = events
    assert outer["ts"] <= inner["ts"]
    assert outer["ts"] + outer["dur"] >= inner["ts"] + inner["dur"]
    p.stopStateLogging(66)
    assert p.startStateLogging(99, "x") is None, "as PyBullet answers"


def test_points_show_in_pictures(client: int) -> None:
    view = p.computeViewMatrix([4, 0, 0], [0, 0, 0], [0, 0, 1])
    projection = p.computeProjectionMatrixFOV(60, 1, 0.1, 50)
    p.addUserDebugPoints([[0, 0, 0], [0, 1, 0]], [[1, 0, 0], [0, 0, 1]], pointSize=6)
    picture = p.getCameraImage(100, 100, view, projection)[2][..., :3].astype(int)
    red = (picture[..., 0] > 200) & (picture[..., 1] < 60)
    blue = (picture[..., 2] > 200) & (picture[..., 1] < 60)
    assert 20 <= red.sum() <= 60
    assert 20 <= blue.sum() <= 60
    rows, columns = red.nonzero()
    assert abs(rows.mean() - 50) < 2
    assert abs(columns.mean() - 50) < 2
    assert blue.nonzero()[1].mean() > 65
