"""Depth and ids against closed forms: rays through the pixels' centres intersected with the shapes."""

from __future__ import annotations

import numpy as np
import pytest

from roboyard.rendering import Camera, RenderScene, render
from roboyard.shapes import primitives
from roboyard.transforms import matrix_from_quaternion, normalized


def cameras():
    yield Camera.look_at((1.7, -1.3, 1.1), (0.0, 0.1, 0.2), width=80, height=60)
    yield Camera.orthographic((1.7, -1.3, 1.1), (0.0, 0.1, 0.2), width=80, height=60, extent=1.8)
    yield Camera.pinhole(
        70,
        80,
        30,
        35,
        width=80,
        height=60,
        position=(0.1, -2.0, 0.3),
        orientation=(0.7071068, 0, 0, 0.7071068),
    )


@pytest.mark.parametrize("camera", list(cameras()))
def test_every_ray_hits_a_plane(camera, floor, picture):
    image = picture([floor], camera)
    origin, direction = camera.rays()
    with np.errstate(divide="ignore"):
        expected = -origin[..., 2] / direction[..., 2]
    seen = (expected > camera.near) & (expected < camera.far)
    assert np.array_equal(np.isfinite(image.depth), seen)
    assert image.depth[seen] == pytest.approx(expected[seen], rel=1e-5)
    assert (image.segmentation[seen] == (9, -1)).all()
    assert (image.segmentation[~seen] == -1).all()


@pytest.mark.parametrize("camera", list(cameras()))
def test_a_large_quad_around_the_camera_is_clipped_exactly(camera, shape, picture):
    """Corners behind the camera have no valid projection without clipping at the near plane."""
    image = picture([shape(primitives.plane(30.0, 30.0), owner=(3, 4))], camera)
    origin, direction = camera.rays()
    with np.errstate(divide="ignore"):
        t = -origin[..., 2] / direction[..., 2]
    hit = origin + t[..., None] * direction
    seen = (t > camera.near) & (t < camera.far) & (np.abs(hit[..., :2]) < 30.0).all(axis=-1)
    close = (np.abs(np.abs(hit[..., :2]) - 30.0) < 1.0).any(axis=-1)
    assert np.array_equal(np.isfinite(image.depth)[~close], seen[~close])
    both = seen & ~close
    assert both.sum() > 500
    assert image.depth[both] == pytest.approx(t[both], rel=1e-4)


def slabs(origin, direction, half):
    with np.errstate(divide="ignore", invalid="ignore"):
        a, b = (-half - origin) / direction, (half - origin) / direction
    enter, leave = np.fmin(a, b).max(axis=-1), np.fmax(a, b).min(axis=-1)
    return np.where(enter < leave, enter, np.inf), leave - enter


@pytest.mark.parametrize("camera", list(cameras()))
def test_a_rotated_and_scaled_box(camera, shape, picture):
    rotation = matrix_from_quaternion(normalized((0.2, -0.4, 0.3, 0.8)))
    position, half = np.array([0.1, 0.2, 0.3]), np.array([0.3, 0.2, 0.4])
    image = picture(
        [shape(primitives.box(), position, rotation, scale=tuple(2 * half), owner=(5, 2))], camera
    )
    origin, direction = camera.rays()
    expected, thickness = slabs((origin - position) @ rotation, direction @ rotation, half)
    clear = (thickness > 1e-3) | ~np.isfinite(expected)  # rays along an edge may hit or miss
    assert np.array_equal(np.isfinite(image.depth)[clear], np.isfinite(expected)[clear])
    both = np.isfinite(image.depth) & np.isfinite(expected)
    assert both.sum() > 100
    # corners are snapped to 1/1024 pixel, which matters on a side seen almost edge on
    assert image.depth[both] == pytest.approx(expected[both], abs=6e-4)
    assert (image.segmentation[both] == (5, 2)).all()


@pytest.mark.parametrize("camera", list(cameras()))
def test_a_sphere(camera, shape, picture):
    centre, radius = np.array([0.1, 0.1, 0.3]), 0.4
    image = picture([shape(primitives.sphere(radius, 256), centre)], camera)
    origin, direction = camera.rays()
    away = origin - centre
    a, b = (direction**2).sum(-1), (away * direction).sum(-1)
    inside = b * b - a * ((away**2).sum(-1) - radius**2)
    expected = (-b - np.sqrt(np.maximum(inside, 0))) / a
    rim = np.abs(inside) < 0.01
    assert np.array_equal(np.isfinite(image.depth)[~rim], inside[~rim] > 0)
    there = (inside > 0) & ~rim
    assert there.sum() > 200
    assert image.depth[there] == pytest.approx(expected[there], abs=1e-3)


def test_frames_move_their_shapes(shape):
    camera = Camera.look_at((0.0, -3.0, 0.0), (0.0, 0.0, 0.0), width=60, height=40)
    scene = RenderScene(
        shapes=[
            shape(primitives.box(0.1, 0.1, 0.1), frame=0, owner=(0, 0)),
            shape(primitives.box(0.1, 0.1, 0.1), position=(0.0, 0.0, 0.5), frame=1, owner=(1, 0)),
        ]
    )
    turn = np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])  # z to x
    image = render(scene, [(-0.5, 0.0, 0.0), (0.2, 1.0, 0.0)], [np.eye(3), turn], camera)
    left, right = image.depth[20, 30 - 7], camera.project((0.7, 1.0, 0.0))
    assert left == pytest.approx(2.9, abs=1e-5)
    assert image.depth[int(right[1]), int(right[0])] == pytest.approx(3.9, abs=1e-5)
    assert image.segmentation[int(right[1]), int(right[0])].tolist() == [1, 0]


def test_surfaces_outside_the_clipping_planes_are_skipped(shape, picture):
    camera = Camera.look_at((0.0, -3.0, 0.0), (0.0, 0.0, 0.0), width=30, height=30, near=1.0, far=4.0)
    box = primitives.box(0.2, 0.2, 0.2)
    image = picture([shape(box, (0, 0, 0), owner=(0, 0)), shape(box, (0, 2.0, 0.6), owner=(1, 0))], camera)
    assert set(image.segmentation[..., 0].ravel().tolist()) == {-1, 0}
    image = picture([shape(box, (0, -2.5, 0), owner=(0, 0))], camera)
    assert (image.segmentation == -1).all()
    assert np.isinf(image.depth).all()
    assert (image.depth_buffer() == 1.0).all()


def test_an_open_shell_is_seen_from_both_sides(shape, picture):
    for eye in ((0.0, 0.0, 2.0), (0.0, 0.0, -2.0)):
        camera = Camera.look_at(eye, (0, 0, 0), width=20, height=20)
        image = picture([shape(primitives.plane(0.3, 0.3), owner=(1, 1))], camera)
        assert image.depth[10, 10] == pytest.approx(2.0, abs=1e-5)


def test_a_mirrored_closed_mesh_keeps_its_outside(shape, picture):
    camera = Camera.look_at((0.0, -3.0, 0.0), (0.0, 0.0, 0.0), width=31, height=31)
    image = picture([shape(primitives.sphere(0.5, 64), scale=(-1.0, 1.0, 1.0))], camera)
    assert image.depth[15, 15] == pytest.approx(2.5, abs=2e-3)


def test_an_empty_scene_is_all_background(picture):
    camera = Camera.look_at((1, 1, 1), (0, 0, 0), width=8, height=6)
    image = picture([], camera, background=(0.2, 0.4, 0.6))
    assert (image.rgba == (51, 102, 153, 255)).all()
    assert image.points().shape == (6, 8, 3)
    assert np.isnan(image.points()).all()


def test_the_same_scene_gives_the_same_bytes(shape, floor, picture):
    camera = Camera.look_at((1.5, -1.0, 1.0), (0, 0, 0.2), width=64, height=48)
    ball = shape(primitives.sphere(0.3), (0, 0, 0.3))
    shapes = [floor, ball, shape(primitives.box(), (0.5, 0.5, 0.5), rgba=(1, 0, 0, 0.5))]
    first, second = (picture(shapes, camera, samples=4) for _ in range(2))
    assert first.rgba.tobytes() == second.rgba.tobytes()
    assert first.depth.tobytes() == second.depth.tobytes()
    assert first.segmentation.tobytes() == second.segmentation.tobytes()


def test_a_new_revision_draws_the_new_shapes(shape):
    camera = Camera.look_at((0.0, -3.0, 0.0), (0.0, 0.0, 0.0), width=9, height=9)
    scene = RenderScene(shapes=[shape(primitives.box(), owner=(1, 0))])
    frames = np.zeros((1, 3)), np.eye(3).reshape(1, 9)
    assert render(scene, *frames, camera).segmentation[4, 4, 0] == 1
    scene.shapes = [shape(primitives.sphere(), owner=(2, 0))]
    scene.revision += 1
    assert render(scene, *frames, camera).segmentation[4, 4, 0] == 2


def test_wrong_frames_raise(shape):
    camera = Camera.look_at((0.0, -3.0, 0.0), (0.0, 0.0, 0.0), width=9, height=9)
    scene = RenderScene(shapes=[shape(primitives.box(), frame=2)])
    with pytest.raises(ValueError, match="use 3 frames, got 1"):
        render(scene, np.zeros((1, 3)), np.eye(3)[None], camera)
    with pytest.raises(ValueError, match="shapes"):
        render(scene, np.zeros((3, 3)), np.eye(3), camera)
    with pytest.raises(ValueError, match="samples"):
        render(RenderScene(), np.zeros((1, 3)), np.eye(3)[None], camera, samples=2)  # type: ignore[arg-type]


@pytest.mark.parametrize("camera", list(cameras()))
@pytest.mark.parametrize(("flip", "step"), [((-1.0, 1.0), (1, -1)), ((1.0, -1.0), (-1, 1))])
def test_a_mirrored_projection_gives_the_mirrored_picture(camera, flip, step, shape, floor, picture):
    shapes = [shape(primitives.box(), position=(0.0, 0.1, 0.3), rgba=(1.0, 0.2, 0.1, 1.0)), floor]
    image = picture(shapes, camera)
    mirrored = Camera(
        camera.width, camera.height, camera.view, np.diag([*flip, 1.0, 1.0]) @ camera.projection
    )
    other = picture(shapes, mirrored)
    rows, columns = step
    assert (image.segmentation == (0, -1)).all(axis=-1).sum() > 50
    for name in ("segmentation", "depth", "rgba"):  # edges through centres of pixels fall to one side
        expected = getattr(image, name)[::rows, ::columns]
        assert np.isclose(getattr(other, name), expected, atol=1, rtol=1e-5).mean() > 0.99
    assert other.camera is mirrored
