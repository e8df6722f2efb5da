"""Camera sensors: viewing direction, depth against ray casts, segmentation against the robot's links."""

from __future__ import annotations

import math

import numpy as np
import pytest

from roboyard.errors import RoboyardError
from roboyard.scenes import tabletop
from roboyard.sensors import CameraSensor, link_names
from roboyard.sim import Body, World
from roboyard.transforms import quaternion_from_matrix, rotate

FORWARD = quaternion_from_matrix(np.array([[0, 0, -1], [-1, 0, 0], [0, 1, 0]]))
"""Return the orientation of a camera that looks along the link's +x with the link's +z up."""


def test_camera_looks_along_minus_z_with_y_up(world: World, mast: Body) -> None:
    ahead = world.add_box((0.2, 0.2, 0.2), (2, 0, 0.6), mass=0, name="ahead")
    above = world.add_box((0.2, 0.2, 0.2), (2, 0, 1.2), mass=0, name="above")
    left = world.add_box((0.2, 0.2, 0.2), (2, 0.6, 0.6), mass=0, name="left")
    assert np.allclose(rotate(FORWARD, (0, 0, -1)), (1, 0, 0))
    sensor = CameraSensor(mast.link("head"), position=(0.4, 0, 0), orientation=FORWARD, backend="software")
    seg = sensor.observe()["seg"][..., 0]
    rows, columns = (np.arange(128) + 0.5)[:, None], (np.arange(128) + 0.5)[None]

    def middle(body: Body) -> tuple[float, float]:
        mask = seg == body.id
        return float((mask * rows).sum() / mask.sum()), float((mask * columns).sum() / mask.sum())

    assert middle(ahead) == pytest.approx((64, 64), abs=0.6)
    assert middle(above)[0] < 40 and middle(above)[1] == pytest.approx(64, abs=1)
    assert middle(left)[1] < 40 and middle(left)[0] == pytest.approx(64, abs=1)


def test_default_field_of_view_matches_omnigibson() -> None:
    world = World()
    sensor = CameraSensor(world.add_box((1, 1, 1)).links[0], width=200, height=100)
    camera = sensor.camera()
    assert camera.intrinsics[0, 0] == pytest.approx(200 * 17.0 / 20.955)
    assert camera.intrinsics[1, 1] == pytest.approx(200 * 17.0 / 20.955)
    assert math.degrees(2 * math.atan(100 / camera.intrinsics[0, 0])) == pytest.approx(63.3, abs=0.05)


def test_depth_and_points_agree_with_rays() -> None:
    scene = tabletop()
    world = scene.world
    post = world.add_box((0.02, 0.02, 0.02), (0.0, 0, 1.3), mass=0)
    tilt = quaternion_from_matrix(
        np.array([[0, math.sin(0.6), -math.cos(0.6)], [-1, 0, 0], [0, math.cos(0.6), math.sin(0.6)]])
    )
    sensor = CameraSensor(
        post.links[0],
        orientation=tilt,
        width=48,
        height=48,
        near=0.05,
        outputs=("depth", "points"),
        backend="software",
    )
    seen = sensor.observe()
    assert set(seen) == {"depth", "points"}
    origins, directions = sensor.camera().rays()
    apart = []
    for row in range(2, 48, 5):
        for column in range(2, 48, 5):
            o, d = origins[row, column], directions[row, column]
            hit = world.ray(o + 0.05 * d, o + 20 * d, visual=True)
            assert hit is not None
            apart.append(np.linalg.norm(hit.position - seen["points"][row, column]))
    assert np.median(apart) < 1e-3
    assert np.mean(np.array(apart) < 0.01) > 0.97, "but for pixels on an edge"


def test_segmentation_gives_the_links(world: World, mast: Body) -> None:
    box = world.add_box((0.2, 0.2, 0.2), (2, 0, 0.6), mass=0, name="ahead")
    eye = world.add_box((0.01, 0.01, 0.01), (0, -2, 0.5), mass=0, name="eye")
    turn = quaternion_from_matrix(np.array([[1, 0, 0], [0, 0, -1], [0, 1, 0]]))
    sensor = CameraSensor(eye.links[0], orientation=turn, fovx=math.radians(100), backend="software")
    seg = sensor.observe()["seg"]
    names = link_names(world, seg)
    assert set(names.values()) == {"plane/base", "mast/foot", "mast/ear", "ahead/base"}
    camera = sensor.camera()
    for body, link in ((mast, "foot"), (mast, "ear"), (box, "base")):
        column, row, _ = camera.project(body.link(link).pose[0])
        assert names[tuple(seg[int(row), int(column)])] == f"{body.name}/{link}"


def test_unknown_outputs_and_invalid_angles_raise(world: World, mast: Body) -> None:
    with pytest.raises(RoboyardError, match="'normals' is none of rgb, depth, seg, points"):
        CameraSensor(mast.link("head"), outputs=("normals",))
    with pytest.raises(ValueError, match="fovx"):
        CameraSensor(mast.link("head"), fovx=4.0)
