"""Debug drawings, sliders, camera images and logs: geometry of pictures, and the files that are written."""

from __future__ import annotations

import struct
from math import tan
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import roboyard.pybullet as p

SIZE = 64
UNLIT = {"shadow": 0, "lightAmbientCoeff": 1.0, "lightDiffuseCoeff": 0.0, "lightSpecularCoeff": 0.0}


def picture(eye: Any = (0, -3, 0), target: Any = (0, 0, 0), fov: float = 60.0, **options: Any) -> Any:
    view = p.computeViewMatrix(eye, target, [0, 0, 1])
    projection = p.computeProjectionMatrixFOV(fov, 1.0, 0.1, 10.0)
    return p.getCameraImage(SIZE, SIZE, view, projection, **(UNLIT | options))


def coloured_box(at: Any, rgba: Any, half: float = 0.5) -> int:
    visual = p.createVisualShape(p.GEOM_BOX, halfExtents=[half] * 3, rgbaColor=rgba)
    return p.createMultiBody(0, baseVisualShapeIndex=visual, basePosition=at)


def metres(depth: np.ndarray, near: float = 0.1, far: float = 10.0) -> np.ndarray:
    return far * near / (far - (far - near) * depth)


def test_a_box_fills_the_pixels_that_it_should(client: int) -> None:
    body = coloured_box([0, 0, 0], [1, 0, 0, 1])
    width, height, rgba, depth, ids = picture()
    assert (width, height) == (SIZE, SIZE)
    assert rgba.shape == (SIZE, SIZE, 4)
    share = 0.5 / 2.5 / tan(np.radians(30))
    assert (ids == body).mean() == pytest.approx(share**2, abs=0.03)
    assert rgba[SIZE // 2, SIZE // 2].tolist() == [255, 0, 0, 255]
    assert metres(depth)[SIZE // 2, SIZE // 2] == pytest.approx(2.5, abs=1e-3)
    assert depth[0, 0] == 1.0
    assert ids[0, 0] == -1


def test_nearer_bodies_hide_others(client: int) -> None:
    far, near = coloured_box([0, 1, 0], [0, 1, 0, 1]), coloured_box([0, -1, 0], [0, 0, 1, 1], 0.2)
    ids = picture()[4]
    assert ids[SIZE // 2, SIZE // 2] == near
    assert far in ids


@pytest.mark.parametrize(("side", "column"), [(-0.6, 1 / 4), (0.6, 3 / 4)])
def test_x_goes_to_the_right(client: int, side: float, column: float) -> None:
    body = coloured_box([side, 0, 0], [1, 1, 0, 1], 0.2)
    columns = np.flatnonzero((picture()[4] == body).any(axis=0))
    assert columns.mean() / SIZE == pytest.approx(0.5 + side / (2 * 3 * tan(np.radians(30))), abs=0.06)
    assert (columns.mean() / SIZE > 0.5) == (column > 0.5)


def test_segmentation_flags(client: int) -> None:
    body = coloured_box([0, 0, 0], [1, 0, 0, 1])
    middle = (SIZE // 2, SIZE // 2)
    assert picture(flags=p.ER_SEGMENTATION_MASK_OBJECT_AND_LINKINDEX)[4][middle] == body
    assert (picture(flags=p.ER_NO_SEGMENTATION_MASK)[4] == -1).all()


def test_matrices_have_sixteen_numbers(client: int) -> None:
    with pytest.raises(p.error, match="Error parsing view or projection matrix"):
        p.getCameraImage(8, 8, [1, 2, 3], p.computeProjectionMatrixFOV(60, 1, 0.1, 10))


def test_matrices_are_those_of_each_call(client: int) -> None:
    """A picture shows what its own matrices say, given as any sequence, whichever pictures came before."""
    coloured_box([0, 0, 0], [1, 0, 0, 1])
    views = [p.computeViewMatrix([0, -y, 0], [0, 0, 0], [0, 0, 1]) for y in (3, 4)]
    lens = p.computeProjectionMatrixFOV(60, 1, 0.1, 10)
    sizes = []
    for view in (*views, *views):
        pictures = [p.getCameraImage(16, 16, kind(view), kind(lens)) for kind in (tuple, list, np.array)]
        for picture in pictures[1:]:
            assert all(np.array_equal(one, other) for one, other in zip(picture, pictures[0], strict=True))
        sizes.append(int((pictures[0][4] >= 0).sum()))
    assert sizes[0] > sizes[1] and sizes[:2] == sizes[2:]
    assert p.getCameraImage(8, 8, views[0], lens)[2].shape == (8, 8, 4)
    for _ in range(2):
        with pytest.raises(p.error, match="Error parsing view or projection matrix"):
            p.getCameraImage(16, 16, [1.0] + [0.0] * 15, lens)


@pytest.mark.parametrize("count", [2, 4, 7, 8, 11])
def test_every_form_of_render_image(client: int, count: int) -> None:
    coloured_box([0, 0, 0], [1, 0, 0, 1])
    view = p.computeViewMatrix([0, -3, 0], [0, 0, 0], [0, 0, 1])
    forms = {
        2: (),
        4: (view, p.computeProjectionMatrixFOV(60, 1, 0.1, 10)),
        7: ([0, -3, 0], [0, 0, 0], [0, 0, 1], 0.1, 10.0),
        8: ([0, -3, 0], [0, 0, 0], [0, 0, 1], 0.1, 10.0, 60.0),
        11: ([0, 0, 0], 3.0, 0.0, 0.0, 0.0, 2, 0.1, 10.0, 60.0),
    }
    image = p.renderImage(16, 16, *forms[count])
    assert image[2].shape == (16, 16, 4)
    with pytest.raises(p.error, match="Invalid number of args"):
        p.renderImage(16, 16, 1)


def test_a_debug_line_is_drawn_in_its_colour(client: int) -> None:
    p.createMultiBody(0, p.createCollisionShape(p.GEOM_SPHERE, radius=0.01), basePosition=[5, 5, 5])
    item = p.addUserDebugLine([-1, 0, 0], [1, 0, 0], [0, 1, 0], lineWidth=3)
    rgba = picture()[2]
    green = (rgba[..., :3] == [0, 255, 0]).all(axis=-1)
    assert green.any()
    assert np.flatnonzero(green.any(axis=1)).mean() == pytest.approx(SIZE / 2, abs=2)
    p.removeUserDebugItem(item)
    assert not (picture()[2][..., :3] == [0, 255, 0]).all(axis=-1).any()


def test_sliders_are_read_and_removed(client: int) -> None:
    slider = p.addUserDebugParameter("speed", -1, 1, 0.25)
    assert p.readUserDebugParameter(slider) == 0.25
    p.removeAllUserParameters()
    with pytest.raises(p.error, match="Failed to read parameter"):
        p.readUserDebugParameter(slider)


@pytest.mark.parametrize(
    ("positions", "colours", "message"),
    [
        ([[0, 0, 0]] * 2, [[1, 0, 0]], "numColors must match numPositions"),
        ([[0, 0, 0]] * 131073, [[1, 0, 0]] * 131073, "Number of vertices exceeds"),
    ],
)
def test_points_need_their_colours(client: int, positions: Any, colours: Any, message: str) -> None:
    with pytest.raises(p.error, match=message):
        p.addUserDebugPoints(positions, colours)


def test_a_robot_log_holds_the_motion(client: int, tmp_path: Path) -> None:
    """Height of a falling body by its log: semi-implicit Euler."""
    body = p.createMultiBody(1, p.createCollisionShape(p.GEOM_SPHERE, radius=0.1), basePosition=[0, 0, 10])
    p.changeDynamics(body, -1, linearDamping=0, angularDamping=0)
    p.setGravity(0, 0, -10)
    file = tmp_path / "log.bin"
    log = p.startStateLogging(p.STATE_LOGGING_GENERIC_ROBOT, str(file), [body], maxLogDof=2)
    for _ in range(10):
        p.stepSimulation()
    p.stopStateLogging(log)
    names, types, records = file.read_bytes().split(b"\n", 2)
    fields = names.decode().split(",")
    size = struct.calcsize("<" + types.decode())
    rows = [
        struct.unpack("<" + types.decode(), records[start + 2 : start + 2 + size])
        for start in range(0, len(records), size + 2)
    ]
    assert len(rows) == 10
    height, speed = fields.index("posZ"), fields.index("velZ")
    dt = 1 / 240
    for n, row in enumerate(rows, start=1):
        assert row[height] == pytest.approx(10 - 10 * dt * dt * n * (n + 1) / 2, rel=1e-6)
        assert row[speed] == pytest.approx(-10 * dt * n, rel=1e-5)


def test_a_log_that_cannot_be_written_is_an_error(client: int, tmp_path: Path) -> None:
    for kind in (p.STATE_LOGGING_GENERIC_ROBOT, p.STATE_LOGGING_CONTACT_POINTS, p.STATE_LOGGING_ALL_COMMANDS):
        with pytest.raises(p.error, match="startStateLogging failed"):
            p.startStateLogging(kind, str(tmp_path / "no" / "folder"))
    assert p.startStateLogging(99, str(tmp_path / "x")) is None
    p.stopStateLogging(99)


def test_one_log_of_timings_at_a_time(client: int, tmp_path: Path) -> None:
    log = p.startStateLogging(p.STATE_LOGGING_PROFILE_TIMINGS, str(tmp_path / "a"))
    assert p.startStateLogging(p.STATE_LOGGING_PROFILE_TIMINGS, str(tmp_path / "b")) is None
    p.submitProfileTiming("span")
    p.stepSimulation()
    p.submitProfileTiming()
    p.stopStateLogging(log)
    text = (tmp_path / "a_0.json").read_text()
    assert '"span"' in text
    assert '"stepSimulation"' in text
    p.submitProfileTiming("after the log")
    assert p.startStateLogging(p.STATE_LOGGING_PROFILE_TIMINGS, str(tmp_path / "c")) == 1


def test_commands_are_replayed(client: int, tmp_path: Path) -> None:
    file = str(tmp_path / "commands")
    log = p.startStateLogging(p.STATE_LOGGING_ALL_COMMANDS, file)
    shape = p.createCollisionShape(p.GEOM_SPHERE, radius=0.3)
    p.createMultiBody(2.0, shape, basePosition=[1, 2, 3])
    p.setGravity(0, 0, -4)
    p.stopStateLogging(log)
    p.resetSimulation()
    p.startStateLogging(p.STATE_REPLAY_ALL_COMMANDS, file)
    assert p.getNumBodies() == 1
    assert p.getDynamicsInfo(0, -1)[0] == 2.0
    assert p.getPhysicsEngineParameters()["gravityAccelerationZ"] == -4.0
