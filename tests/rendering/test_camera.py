from __future__ import annotations

import math

import numpy as np
import pytest

from roboyard import transforms
from roboyard.rendering import Camera
from roboyard.rendering.matrices import inverse_3x3


def test_look_at_centres_the_target_with_up_upward():
    camera = Camera.look_at((2.0, -1.0, 1.5), (0.1, 0.2, 0.3), width=320, height=240)
    column, row, depth = camera.project((0.1, 0.2, 0.3))
    assert (column, row) == pytest.approx((160.0, 120.0))
    assert depth == pytest.approx(np.linalg.norm([1.9, -1.2, 1.2]))
    assert camera.project((0.1, 0.2, 0.4))[1] < row
    assert np.allclose(camera.position, (2.0, -1.0, 1.5))


def test_look_straight_down_works():
    camera = Camera.look_at((0.0, 0.0, 3.0), (0.0, 0.0, 0.0), width=100, height=100)
    assert np.allclose(camera.project((0.0, 0.0, 1.0)), (50.0, 50.0, 2.0))
    assert camera.project((0.0, 0.5, 0.0))[1] < 50.0  # world y replaces up


def test_vertical_field_of_view_spans_the_picture():
    camera = Camera.look_at((0.0, -2.0, 0.0), (0.0, 0.0, 0.0), width=200, height=100, fovy=math.radians(60))
    half = 2.0 * math.tan(math.radians(30))
    assert np.allclose(camera.project((0.0, 0.0, half)), (100.0, 0.0, 2.0))
    assert np.allclose(camera.project((2 * half, 0.0, 0.0)), (200.0, 50.0, 2.0))


@pytest.mark.parametrize(("near", "far"), [(0.01, 100.0), (0.5, 3.0)])
def test_near_and_far_are_computed_from_the_projection(near, far):
    for make in (Camera.look_at, Camera.orthographic):
        camera = make((1, 1, 1), (0, 0, 0), near=near, far=far)
        assert (camera.near, camera.far) == pytest.approx((near, far), rel=1e-9)


def test_a_projection_without_far_plane():
    camera = Camera.look_at((1, 1, 1), (0, 0, 0), near=0.1)
    projection = camera.projection.copy()
    projection[2, 2], projection[2, 3] = -1.0, -0.2
    camera = Camera(64, 48, camera.view, projection)
    assert camera.near == pytest.approx(0.1)
    assert camera.far == math.inf


def test_pinhole_intrinsics_round_trip_and_project_like_the_textbook():
    camera = Camera.pinhole(
        310.0, 290.0, 170.0, 110.0, width=320, height=240, position=(1, 2, 3), convention="optical"
    )
    k = camera.intrinsics
    assert np.allclose(k, [[310, 0, 170], [0, 290, 110], [0, 0, 1]])
    # identity orientation in the optical convention: x right, y down, z forward
    point = np.array([0.2, -0.1, 2.0])
    expected = k @ point / point[2]
    assert np.allclose(camera.project(point + np.array([1, 2, 3])), (*expected[:2], 2.0))


def test_pose_and_view_are_inverse():
    q = transforms.normalized((0.1, 0.5, -0.3, 0.8))
    camera = Camera.pinhole(
        300, 300, 160, 120, width=320, height=240, position=(0.3, -0.2, 0.9), orientation=q
    )
    assert np.allclose(camera.T_world_camera @ camera.view, np.eye(4))
    assert np.allclose(np.abs(camera.orientation @ q), 1.0)


def test_orbit_position_follows_the_angles():
    camera = Camera.from_yaw_pitch((1, 1, 0), 2.0, yaw=0.0, pitch=0.0)
    assert np.allclose(camera.position, (1, -1, 0))
    camera = Camera.from_yaw_pitch((0, 0, 0), 2.0, yaw=math.radians(90), pitch=math.radians(-30))
    assert np.allclose(camera.position, (2 * math.cos(math.radians(30)), 0, 1.0))
    above = Camera.from_yaw_pitch((0, 0, 0), 2.0, yaw=0.3, pitch=math.radians(-90))
    assert np.allclose(above.position, (0, 0, 2))


def test_orbit_equals_the_tutorials_view_matrix():
    """The view that the tutorial prints for distance 5, yaw 50 and pitch -35 degrees (column-major there)."""
    printed = [
        0.642787516117096, -0.4393851161003113, 0.6275069713592529, 0.0,
        0.766044557094574, 0.36868777871131897, -0.5265407562255859, 0.0,
        -0.0, 0.8191521167755127, 0.5735764503479004, 0.0,
        2.384185791015625e-07, 2.384185791015625e-07, -5.000000476837158, 1.0,
    ]  # fmt: skip
    camera = Camera.from_yaw_pitch((0, 0, 0), 5.0, math.radians(50), math.radians(-35))
    assert np.allclose(camera.view, np.reshape(printed, (4, 4)).T, atol=1e-6)


@pytest.mark.parametrize("make", [Camera.look_at, Camera.orthographic])
def test_deprojecting_undoes_projecting(make):
    camera = make((1.0, -2.0, 1.0), (0.0, 0.0, 0.3), width=40, height=30)
    depth = np.random.default_rng(0).uniform(0.5, 4.0, (30, 40))
    depth[3, 4] = np.inf
    points = camera.deproject(depth)
    back = camera.project(points)
    row, column = np.mgrid[0:30, 0:40] + 0.5
    there = np.isfinite(depth)
    assert np.isnan(points[3, 4]).all()
    assert np.allclose(back[there], np.stack([column, row, depth], axis=-1)[there])


def test_depth_buffer_follows_the_hyperbola():
    camera = Camera.look_at((1, 1, 1), (0, 0, 0), near=0.1, far=20.0)
    depth = np.array([0.1, 0.5, 4.0, 20.0, np.inf])
    buffer = camera.depth_to_buffer(depth)
    assert buffer[0] == pytest.approx(0.0, abs=1e-6)
    assert buffer[3:] == pytest.approx([1.0, 1.0], abs=1e-6)
    near, far = 0.1, 20.0
    metres = far * near / (far - (far - near) * buffer[:4].astype(float))
    assert metres == pytest.approx(depth[:4], rel=1e-4)


def test_orthographic_depth_buffer_is_linear():
    camera = Camera.orthographic((0, 0, 5), (0, 0, 0), near=1.0, far=9.0)
    assert camera.depth_to_buffer([1.0, 5.0, 9.0]) == pytest.approx([0.0, 0.5, 1.0])


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"width": 0}, "width is 0"),
        ({"height": 2.5}, "height is 2.5"),
        ({"view": np.eye(3)}, "view must be a finite"),
        ({"view": np.diag([2.0, 2.0, 2.0, 1.0])}, "rotation and a translation"),
        ({"projection": np.full((4, 4), np.nan)}, "projection must be a finite"),
        ({"projection": "transposed"}, "transposed"),
    ],
)
def test_invalid_cameras_name_the_fault(change, words):
    good = Camera.look_at((1, 1, 1), (0, 0, 0))
    values = {"width": 64, "height": 48, "view": good.view, "projection": good.projection, **change}
    if isinstance(values["projection"], str):
        values["projection"] = good.projection.T
    with pytest.raises(ValueError, match=words):
        Camera(**values)


def test_invalid_arguments_name_the_fault():
    with pytest.raises(ValueError, match="two different"):
        Camera.look_at((1, 1, 1), (1, 1, 1))
    with pytest.raises(ValueError, match="near"):
        Camera.look_at((1, 1, 1), (0, 0, 0), near=2.0, far=1.0)
    with pytest.raises(ValueError, match="fovy"):
        Camera.look_at((1, 1, 1), (0, 0, 0), fovy=60.0)
    with pytest.raises(ValueError, match="orthographic"):
        _ = Camera.orthographic((1, 1, 1), (0, 0, 0)).intrinsics
    with pytest.raises(ValueError, match="shape"):
        Camera.look_at((1, 1, 1), (0, 0, 0)).deproject(np.zeros((3, 3)))


def test_a_fitted_camera_needs_points() -> None:
    with pytest.raises(ValueError, match=r"got \(0, 3\)"):
        Camera.fitted(np.zeros((0, 3)), (1.0, 0.0, 0.0))


@pytest.mark.parametrize("seed", range(4))
def test_the_inverse_of_three_by_three_numbers(seed):
    matrix = np.random.default_rng(seed).normal(size=(3, 3))
    assert inverse_3x3(matrix) == pytest.approx(np.linalg.inv(matrix), rel=1e-9)
