"""The first picture of a page has the whole robot in its frame, lit from where the light says."""

from __future__ import annotations

import math
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from roboyard import Camera, World, add_robot
from roboyard.sim.queries.default_view import FILL, FOVY, fitted_points, viewpoint
from roboyard.viewer.driving.aim import clear_viewpoint
from roboyard.viewer.page.light import SUN_DISTANCE, _sun_position

sys.path.insert(0, str(Path(__file__).parent))
import chromium


def world_of(robot: str) -> World:
    world = World()
    world.add_plane()
    add_robot(world, robot)
    return world


def shares(world: World, camera: Camera) -> np.ndarray:
    """(n, 2) positions of all visible vertices in the picture, -1 to 1."""
    model, data = world.model, world.data
    points = []
    for geom in range(model.ngeom):
        mesh = model.geom_dataid[geom]
        if mesh >= 0:
            first, count = model.mesh_vertadr[mesh], model.mesh_vertnum[mesh]
            turn = data.geom_xmat[geom].reshape(3, 3)
            points.append(model.mesh_vert[first : first + count] @ turn.T + data.geom_xpos[geom])
    corners = np.concatenate(points or [fitted_points(world.bodies)])
    clip = np.c_[corners, np.ones(len(corners))] @ (camera.projection @ camera.view).T
    assert (clip[:, 3] > 0).all()
    return clip[:, :2] / clip[:, 3:]


@pytest.mark.parametrize("aspect", [0.45, 1.0, 1.5, 2.4])
@pytest.mark.parametrize("robot", ["rover", "r1"])
def test_the_robot_is_in_the_frame_with_a_margin(robot: str, aspect: float) -> None:
    world = world_of(robot)
    eye, target = viewpoint(world.bodies, aspect)
    camera = Camera.look_at(eye, target, width=round(600 * aspect), height=600, fovy=FOVY)
    found = np.abs(shares(world, camera))
    assert found.max() < FILL + 0.01
    assert found.max() > 0.5  # and not far away


def test_the_sun_of_a_page_is_where_its_direction_says() -> None:
    np.testing.assert_allclose(_sun_position((0, 3, 4)), (0, 0.6 * SUN_DISTANCE, 0.8 * SUN_DISTANCE))


@pytest.mark.slow
@pytest.mark.skipif(chromium.PROGRAM is None, reason="needs Chromium")
@pytest.mark.parametrize("size", [(1280, 800), (800, 1100)])
def test_the_page_opens_with_the_robot_in_its_frame(tmp_path: Path, size: tuple[int, int]) -> None:
    from roboyard.viewer import Viewer

    world = world_of("r1")
    with Viewer(world, port=0, quiet=True) as viewer:
        page = chromium.Page(viewer.url, tmp_path / "profile", size)
        try:
            end = time.monotonic() + 180
            while time.monotonic() < end and not page.evaluate("!!window.__viserMutable?.cameraControl"):
                time.sleep(0.2)
            clients = []
            while time.monotonic() < end and not clients:
                clients = list(viewer.server.get_clients().values())
                time.sleep(0.2)
            camera, found = clients[0].camera, np.array([9.0])
            while time.monotonic() < end and not 0.5 < found.max() < FILL + 0.03:
                time.sleep(0.3)
                seen = Camera.look_at(
                    camera.position,
                    camera.look_at,
                    width=camera.image_width,
                    height=camera.image_height,
                    fovy=camera.fov,
                )
                found = np.abs(shares(world, seen))
            assert math.isclose(camera.fov, FOVY, abs_tol=1e-3)
            assert 0.5 < found.max() < FILL + 0.03
        finally:
            page.close()


@pytest.mark.slow
@pytest.mark.skipif(chromium.PROGRAM is None, reason="needs Chromium")
def test_the_page_and_a_picture_agree_on_light(tmp_path: Path) -> None:
    """Shadow and shading fall on the same sides: the mean difference of the floor is below 20 of 255."""
    from roboyard.viewer import Viewer

    world = world_of("rover")
    with Viewer(world, port=0, quiet=True) as viewer:
        page = chromium.Page(viewer.url, tmp_path / "profile", (1200, 700))
        try:
            end, difference = time.monotonic() + 180, 255.0
            while time.monotonic() < end and difference > 20.0:
                time.sleep(1.0)
                clients = list(viewer.server.get_clients().values())
                if not clients:
                    continue
                page.choose_quality("normal")  # with shadows
                camera = clients[0].camera
                seen = Camera.look_at(
                    camera.position,
                    camera.look_at,
                    width=camera.image_width,
                    height=camera.image_height,
                    fovy=camera.fov,
                )
                picture = page.picture()[: seen.height, : seen.width]
                if picture.shape[:2] != (seen.height, seen.width):
                    continue
                lower = slice(seen.height // 2, None)  # below the note about software rendering
                reference = world.render(seen).rgb.astype(int)
                difference = float(np.abs(picture - reference)[lower].mean())
            assert difference < 20.0
        finally:
            page.close()


def test_no_wall_is_between_the_camera_of_a_drive_and_the_robot() -> None:
    """A wall right behind the robot moves the camera to another side; in the open it is straight behind."""
    world = World()
    world.add_plane()
    robot = add_robot(world, "r1")
    eye, target = clear_viewpoint(robot)
    assert eye[0] < target[0] - 1.0
    assert abs(eye[1] - target[1]) < 1e-6
    wall = world.add_box(size=(0.1, 8.0, 2.6), position=(-1.2, 0.0, 1.3), mass=0.0)
    moved, target = clear_viewpoint(robot)
    hit = world.ray(target, moved)
    while hit is not None and hit.link.body is robot.body:
        start = hit.position + 1e-3 * (moved - target) / np.linalg.norm(moved - target)
        hit = world.ray(start, moved)
    assert hit is None
    assert moved[0] > wall.bounds[1, 0]


def test_a_page_that_lost_its_view_while_it_opened_gets_it_again(browser: Any) -> None:
    """It begins with the view for any page, and reports that view again, for example once its panel docks."""
    pytest.importorskip("viser")
    from roboyard.viewer import Viewer

    with Viewer(world_of("rover"), port=0, quiet=True) as viewer:
        page = browser(viewer)
        is_view = lambda m: m["type"] == "SetCameraPositionMessage" and not m["initial"]  # noqa: E731
        first = page.listen(is_view)
        begin = viewer.server.initial_camera
        page.look_from(tuple(map(float, begin.position)), tuple(map(float, begin.look_at)))
        again = page.listen(is_view)
        np.testing.assert_allclose(again["position"], first["position"])
        page.look_from((9.0, 9.0, 9.0))  # moved by a person: stays
        page.look_from((9.0, 9.0, 8.0))
        with pytest.raises(pytest.fail.Exception):
            page.listen(is_view, 1.0)
