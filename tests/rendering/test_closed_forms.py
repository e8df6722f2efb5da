"""Colours, projections and files against closed forms and other readers."""

from __future__ import annotations

import io
import math
from dataclasses import replace

import numpy as np
import pytest
from PIL import Image as Pillow
from PIL import ImageSequence

from roboyard.rendering import (
    UNLIT,
    Backdrop,
    Camera,
    DebugLines,
    Light,
    RenderScene,
    contact_sheet,
    depth_to_rgb,
    png_bytes,
    render,
    save_gif,
    save_png,
)
from roboyard.rendering.matrices import look_at_view, orbit_view, perspective
from roboyard.shapes import primitives
from roboyard.shapes.mesh import TriangleMesh

DOWN = Camera.look_at((0, 0, 3.0), (0, 0, 0), width=41, height=41)


# ------------------------------------------------------------------------------------------------- cameras


def cloud(seed: int) -> np.ndarray:
    return np.random.default_rng(seed).normal(size=(200, 3)) * (1.0, 0.4, 0.2) + (3.0, -1.0, 0.5)


@pytest.mark.parametrize("direction", [(1, 1, 1), (0, -1, 0.2), (-2, 0.5, -1), (0, 0, 1), (0, 0, -3)])
@pytest.mark.parametrize(("width", "height"), [(100, 100), (300, 100), (60, 200)])
def test_a_fitted_camera_is_the_nearest_that_shows_all_points(direction, width: int, height: int) -> None:
    """Every point is inside the share of the picture, and one is on its rim; straight down and up too."""
    points = cloud(1)
    camera = Camera.fitted(points, direction, width=width, height=height, fill=0.8)
    column, row, depth = camera.project(points).T
    across, down = np.abs(2 * column / width - 1), np.abs(2 * row / height - 1)
    assert max(across.max(), down.max()) == pytest.approx(0.8, abs=1e-9)
    assert (camera.near < depth).all() and (depth < camera.far).all()
    towards = camera.T_world_camera[:3, 2]
    assert towards == pytest.approx(np.array(direction) / np.linalg.norm(direction))


def test_a_fitted_camera_needs_a_direction() -> None:
    with pytest.raises(ValueError, match=r"direction .*\(0, 0, 0\)"):
        Camera.fitted(cloud(0), (0, 0, 0))


def test_a_perspective_matrix_maps_the_corners_of_its_frustum_to_the_unit_cube() -> None:
    fovy, aspect, near, far = 0.9, 1.6, 0.3, 7.0
    matrix = perspective(fovy, aspect, near, far)
    for depth, clip_z in ((near, -1.0), (far, 1.0)):
        half = depth * math.tan(fovy / 2)
        for x in (-1, 1):
            for y in (-1, 1):
                clip = matrix @ (x * half * aspect, y * half, -depth, 1.0)
                assert clip[:3] / clip[3] == pytest.approx([x, y, clip_z])


def test_roll_turns_the_picture_about_the_axis_of_the_camera() -> None:
    straight, rolled = (orbit_view((1, 2, 3), 2.0, 0.4, -0.3, roll) for roll in (0.0, 0.25))
    between = rolled @ np.linalg.inv(straight)
    assert between[:3, 3] == pytest.approx([0, 0, 0], abs=1e-12)
    assert between[2, :3] == pytest.approx([0, 0, 1])
    assert abs(math.atan2(between[1, 0], between[0, 0])) == pytest.approx(0.25)
    with pytest.raises(ValueError, match="distance must be positive, got 0"):
        orbit_view((0, 0, 0), 0, 0, 0)


def test_a_view_is_a_rotation_that_puts_the_eye_at_the_origin() -> None:
    view = look_at_view((1, 2, 3), (-2, 0.5, 1), (0.3, 0.1, 1))
    assert view[:3, :3] @ view[:3, :3].T == pytest.approx(np.eye(3))
    assert view @ (1, 2, 3, 1) == pytest.approx([0, 0, 0, 1])
    x, y, z, _ = view @ (-2, 0.5, 1, 1)
    assert (x, y) == pytest.approx((0, 0))
    assert z == pytest.approx(-math.dist((1, 2, 3), (-2, 0.5, 1)))
    assert (view[:3, :3] @ (0.3, 0.1, 1))[1] > 0


def test_resizing_keeps_the_part_of_the_world_that_is_seen() -> None:
    camera = Camera.look_at((2, 1, 1), (0, 0, 0), width=80, height=60)
    small = camera.resized(40, 30)
    points = cloud(2) * 0.2
    assert small.project(points)[:, :2] == pytest.approx(camera.project(points)[:, :2] / 2)
    assert small.project(points)[:, 2] == pytest.approx(camera.project(points)[:, 2])


def test_an_orthographic_camera_measures_in_metres_per_pixel() -> None:
    camera = Camera.orthographic((0, -5, 0), (0, 0, 0), width=200, height=100, extent=4.0)
    points = np.array([(0.0, 0, 0), (1.0, 0, 0), (0, 3.0, 1.0), (-4.0, 1.0, -2.0)])
    expected = [(100, 50, 5), (125, 50, 5), (100, 25, 8), (0, 100, 6)]
    assert camera.project(points) == pytest.approx(np.array(expected, dtype=float))


# ------------------------------------------------------------------------------------- light and background


@pytest.mark.parametrize("sky", [0.0, 0.5, 1.0])
@pytest.mark.parametrize("tilt", [0.0, 0.6, 1.2])
def test_a_tilted_plate_has_the_documented_colour(sky: float, tilt: float, shape, picture) -> None:
    """c (ambient + diffuse color ((1 - sky) n.l + sky (1 + n_z) / 2)), per channel."""
    turn = np.array([[math.cos(tilt), 0, math.sin(tilt)], [0, 1, 0], [-math.sin(tilt), 0, math.cos(tilt)]])
    normal, sun = turn[:, 2], np.array([0.6, 0.0, 0.8])
    light = Light(
        direction=(6, 0, 8), color=(1.0, 0.5, 0.25), ambient=0.1, diffuse=0.8, specular=0.0, sky=sky
    )
    rgba = (0.9, 0.6, 0.3, 1.0)
    image = picture([shape(primitives.plane(1.0, 1.0), rotation=turn, rgba=rgba)], DOWN, light=light)
    amount = (1 - sky) * max(normal @ sun, 0.0) + sky * (1 + normal[2]) / 2
    expected = [255 * c * (0.1 + 0.8 * tint * amount) for c, tint in zip(rgba[:3], light.color, strict=True)]
    assert image.rgba[20, 20, :3] == pytest.approx(expected, abs=0.51)


def test_the_highlight_of_a_plate_is_blinns_with_exponent_32(shape, picture) -> None:
    """White plate, no other light: (n.h)^32 times the specular of the shape and of the light."""
    light = Light(direction=(0, 1, 1.2), ambient=0.0, diffuse=0.0, specular=0.8, sky=0.0)
    plate = shape(primitives.plane(2.0, 2.0), rgba=(0, 0, 0, 1), specular=0.9)
    image = picture([plate], DOWN, light=light, shadow=False)
    sun = np.array(light.direction) / np.linalg.norm(light.direction)
    to_camera = np.array([0, 0, 3.0]) - image.points()
    to_camera /= np.linalg.norm(to_camera, axis=-1, keepdims=True)
    half = sun + to_camera
    cosine = half[..., 2] / np.linalg.norm(half, axis=-1)
    expected = 255 * 0.8 * 0.9 * cosine**32
    assert image.rgba[..., 0].astype(float) == pytest.approx(expected, abs=0.6)
    assert np.ptp(expected) > 20


def test_the_back_of_an_open_plate_is_lit_as_its_own_side(shape, picture) -> None:
    light = Light(direction=(0, 0, -1), ambient=0.2, diffuse=0.6, specular=0.0, sky=0.0)
    below = Camera.look_at((0, 0, -3), (0, 0, 0), width=9, height=9)
    plate = shape(primitives.plane(1.0, 1.0), rgba=(1, 1, 1, 1))
    assert picture([plate], below, light=light).rgba[4, 4, 0] == round(255 * 0.8)
    assert picture([plate], DOWN, light=light).rgba[20, 20, 0] == round(255 * 0.2)


def test_a_backdrop_is_linear_from_the_top_edge_to_the_bottom_edge(picture) -> None:
    top, bottom = np.array([0.2, 0.4, 1.0]), np.array([1.0, 0.9, 0.0])
    image = picture([], DOWN, background=Backdrop(top=tuple(top), bottom=tuple(bottom)))
    share = (np.arange(41)[:, None] + 0.5) / 41
    expected = 255 * (top * (1 - share) + bottom * share)
    assert image.rgb[:, 7].astype(float) == pytest.approx(expected, abs=0.501)
    assert np.array_equal(image.rgb, np.repeat(image.rgb[:, :1], 41, axis=1))


def test_an_infinite_floor_fades_by_a_smooth_step_of_its_depth(picture, floor) -> None:
    backdrop = Backdrop(top=(0.0, 0.0, 0.0), bottom=(0.0, 0.0, 0.0), fade=(2.0, 6.0))
    camera = Camera.look_at((0, 0, 1.0), (5, 0, 0.0), width=11, height=120, far=200.0)
    image = picture([floor], camera, background=backdrop, light=UNLIT)
    depth = image.depth.astype(float)
    there = np.isfinite(depth)
    t = np.clip((depth[there] - 2) / 4, 0, 1)
    expected = 255 * 0.8 * (1 - t * t * (3 - 2 * t))
    assert image.rgba[..., 0][there].astype(float) == pytest.approx(expected, abs=0.6)
    assert 0 < (t > 0).mean() < 1 and (t == 1).any()


def test_a_checkerboard_alternates_at_its_square_size(shape, picture) -> None:
    """Squares of 0.25 m, counted from the origin; pixels away from their borders."""
    camera = Camera.orthographic((0, 0, 3), (0, 0, 0), width=160, height=160, extent=2.0)
    plate = shape(primitives.plane(1.0, 1.0), rgba=(1, 0, 0, 1), checker=((0.0, 0.0, 1.0), 0.25))
    image = picture([plate], camera, light=UNLIT)
    x, y = image.points()[..., 0] / 0.25, image.points()[..., 1] / 0.25
    odd = (np.floor(x) + np.floor(y)) % 2 == 1
    inside = np.minimum(np.abs(x - np.round(x)), np.abs(y - np.round(y))) > 0.11
    assert inside.mean() > 0.5
    assert (image.rgb[inside & ~odd] == (255, 0, 0)).all()
    assert (image.rgb[inside & odd] == (0, 0, 255)).all()


def test_texels_are_where_their_coordinates_say(shape, picture) -> None:
    """A 4 by 2 picture on a plate, one texel per quarter and half; v runs up."""
    texture = np.random.default_rng(8).integers(0, 256, (2, 4, 4)).astype(np.uint8)
    texture[..., 3] = 255
    corners = np.array([(-1.0, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)])
    mesh = TriangleMesh(
        vertices=corners,
        faces=np.array([(0, 1, 2), (0, 2, 3)], dtype=np.int32),
        uv=(corners[:, :2] + 1) / 2,
        texture=texture,
    )
    camera = Camera.orthographic((0, 0, 3), (0, 0, 0), width=80, height=80, extent=2.0)
    image = picture([shape(mesh, rgba=(1, 1, 1, 1))], camera, light=UNLIT)
    for row in range(2):
        for column in range(4):
            # the centre of a texel is between four pixels: interpolation has no share of its neighbours
            drawn = image.rgb[40 * row + 20, 20 * column + 10].astype(int)
            assert np.abs(drawn - texture[row, column, :3]).max() <= 12


def test_a_shadow_has_the_ellipse_that_a_low_sun_stretches(shape, picture, floor) -> None:
    """A sphere's shadow on the floor: half axes r across and r / sin(elevation) along the light."""
    elevation, radius = math.radians(35), 0.2
    light = Light(
        direction=(math.cos(elevation), 0, math.sin(elevation)),
        ambient=0.1, diffuse=0.9, specular=0.0, sky=0.0,
    )  # fmt: skip
    sphere = shape(primitives.sphere(radius, 96), (1.4, 0.0, 1.0))
    camera = Camera.orthographic((0, 0, 5), (0, 0, 0), width=200, height=200, extent=1.4)
    image = picture([floor, sphere], camera, light=light)
    dark = (image.rgba[..., 0] < 60) & (image.segmentation[..., 0] == 9)
    x, y = (image.points()[..., k][dark] for k in (0, 1))
    middle = 1.4 - 1.0 / math.tan(elevation)
    pixel = 1.4 / 200
    assert (x.mean(), y.mean()) == (pytest.approx(middle, abs=3 * pixel), pytest.approx(0, abs=pixel))
    area = dark.sum() * pixel**2
    assert area == pytest.approx(math.pi * radius**2 / math.sin(elevation), rel=0.05)
    assert np.ptp(x) / np.ptp(y) == pytest.approx(1 / math.sin(elevation), rel=0.05)


# --------------------------------------------------------------------------------------------- scenes


def test_lines_and_frames_that_do_not_fit_are_refused(shape) -> None:
    scene = RenderScene(shapes=[shape(primitives.box(), frame=2)])
    with pytest.raises(ValueError, match="use 3 frames, got 1"):
        render(scene, np.zeros((1, 3)), np.eye(3)[None], DOWN)
    with pytest.raises(ValueError, match=r"got \(1, 2\)"):
        render(RenderScene(), np.zeros((1, 2)), np.eye(3)[None], DOWN)
    with pytest.raises(ValueError, match="samples must be 1 or 4, got 2"):
        render(RenderScene(), np.zeros((1, 3)), np.eye(3)[None], DOWN, samples=2)  # type: ignore[arg-type]
    lines = DebugLines(start=np.zeros((2, 3)), end=np.zeros((2, 3)), rgb=np.zeros((1, 3)), width=np.ones(2))
    with pytest.raises(ValueError, match=r"colours \(1\)"):
        render(RenderScene(), np.zeros((1, 3)), np.eye(3)[None], DOWN, lines=lines)


def test_a_changed_revision_draws_the_new_shapes_and_an_equal_one_the_cached_ones(shape) -> None:
    frames = np.zeros((1, 3)), np.eye(3)[None]
    scene = RenderScene(shapes=[shape(primitives.box(0.2, 0.2, 0.2), owner=(1, 0))])
    first = render(scene, *frames, DOWN, backend="software")
    scene.shapes = [shape(primitives.box(0.2, 0.2, 0.2), owner=(2, 0))]
    scene.revision += 1
    second = render(scene, *frames, DOWN, backend="software")
    assert (first.segmentation[20, 20, 0], second.segmentation[20, 20, 0]) == (1, 2)
    assert np.array_equal(first.depth, second.depth)


def test_points_of_an_image_are_on_the_surface(shape, picture) -> None:
    camera = Camera.look_at((1.5, -1, 0.8), (0, 0, 0), width=64, height=48)
    image = picture([shape(primitives.cylinder(0.4, 0.6, 256))], camera)
    points = image.points()[np.isfinite(image.depth)]
    radius, height = np.hypot(points[:, 0], points[:, 1]), np.abs(points[:, 2])
    side, top = np.abs(radius - 0.4) < 2e-3, np.abs(height - 0.3) < 2e-3
    assert (side | top).all()
    assert side.any() and top.any()
    assert (radius < 0.402).all() and (height < 0.302).all()


# --------------------------------------------------------------------------------------------------- files


@pytest.mark.parametrize("shape_of", [(5, 7), (5, 7, 3), (5, 7, 4)])
def test_every_layout_of_pixels_reads_back(shape_of, tmp_path) -> None:
    pixels = np.random.default_rng(0).integers(0, 256, shape_of).astype(np.uint8)
    back = np.asarray(Pillow.open(save_png(tmp_path / "a.png", pixels)))
    expected = np.repeat(pixels[..., None], 3, axis=2) if pixels.ndim == 2 else pixels
    assert np.array_equal(back, expected)


def test_a_palette_shrinks_a_picture_and_keeps_its_few_colours() -> None:
    pixels = np.zeros((64, 64, 3), dtype=np.uint8)
    pixels[:, 32:] = (200, 40, 90)
    pixels[20:30] = (10, 220, 30)
    data = png_bytes(pixels, colors=16)
    image = Pillow.open(io.BytesIO(data))
    assert image.mode == "P"
    assert np.abs(np.asarray(image.convert("RGB")).astype(int) - pixels).max() <= 8
    noise = np.random.default_rng(1).integers(0, 256, (64, 64, 3)).astype(np.uint8)
    assert len(png_bytes(noise, colors=16)) < len(png_bytes(noise)) / 3


@pytest.mark.parametrize(
    "bad", [np.zeros((3, 3, 2), np.uint8), np.zeros(9, np.uint8), np.zeros((3, 3), float)]
)
def test_arrays_that_are_no_picture_are_refused(bad) -> None:
    with pytest.raises(ValueError, match="a picture must"):
        png_bytes(bad)


@pytest.mark.parametrize("fps", [30.0, 24.0, 7.0])
def test_an_animation_lasts_as_long_as_its_frames_at_the_rate(fps: float, tmp_path) -> None:
    """GIF counts hundredths of a second: each end is the nearest one to its true time."""
    frames = [255 * np.eye(20, dtype=np.uint8)[[k] * 8, :, None].repeat(3, axis=2) for k in range(20)]
    with Pillow.open(save_gif(tmp_path / "a.gif", frames, fps=fps, loop=False)) as gif:
        durations = [frame.info["duration"] for frame in ImageSequence.Iterator(gif)]
        assert "loop" not in gif.info
    ends = np.cumsum(durations) / 1000
    assert ends == pytest.approx(np.arange(1, 21) / fps, abs=0.00501)


def test_a_sheet_is_about_as_wide_as_high_and_pads_smaller_tiles() -> None:
    tiles = [np.full((4 + k % 2, 6, 3), 10 * k, dtype=np.uint8) for k in range(5)]
    sheet = contact_sheet(tiles, gap=2)
    assert sheet.shape == (2 * 7 - 2, 3 * 8 - 2, 3)
    for k, tile in enumerate(tiles):
        top, left = 7 * (k // 3), 8 * (k % 3)
        assert np.array_equal(sheet[top : top + len(tile), left : left + 6], tile)
    assert (sheet[4, :6] == 255).all()  # below the lower first tile
    for options in ({"columns": -1}, {"gap": -1}):
        with pytest.raises(ValueError, match="columns must be at least 1"):
            contact_sheet(tiles, **options)


def test_depth_colours_are_even_in_inverse_depth() -> None:
    """The middle of 1 m and 3 m is 1.5 m: the middle stop of five colours."""
    rgb = depth_to_rgb(np.array([[1.0, 1.5, 3.0, 99.0, np.inf]]), near=1.0, far=3.0)[0]
    assert rgb.tolist() == [
        [253, 231, 76], [190, 55, 100], [24, 22, 72], [24, 22, 72], [255, 255, 255]
    ]  # fmt: skip
    assert (depth_to_rgb(np.full((2, 2), np.nan)) == 255).all()


@pytest.mark.parametrize("tilt", [-1.2, -0.5, 0.0, 0.3, 0.7, 1.2])
def test_a_tilted_plate_mirrors_the_sun_upwards(tilt: float, shape, picture) -> None:
    """c (ambient + color (diffuse max(n.l, 0) + gloss max(2 n.l n_z - l_z, 0)^2)), per channel."""
    turn = np.array([[math.cos(tilt), 0, math.sin(tilt)], [0, 1, 0], [-math.sin(tilt), 0, math.cos(tilt)]])
    normal, sun = turn[:, 2], np.array([0.6, 0.0, 0.8])
    light = Light(
        direction=(6, 0, 8),
        color=(1.0, 0.5, 0.25),
        ambient=0.1,
        diffuse=0.3,
        specular=0.0,
        sky=0.0,
        gloss=0.5,
    )
    rgba = (0.9, 0.6, 0.3, 1.0)
    image = picture([shape(primitives.plane(1.0, 1.0), rotation=turn, rgba=rgba)], DOWN, light=light)
    slope = float(normal @ sun)
    amount = 0.3 * max(slope, 0.0) + 0.5 * max(2 * slope * normal[2] - sun[2], 0.0) ** 2
    expected = [255 * c * (0.1 + tint * amount) for c, tint in zip(rgba[:3], light.color, strict=True)]
    assert image.rgba[20, 20, :3] == pytest.approx(expected, abs=0.51)
    cut = picture(
        [shape(primitives.plane(1.0, 1.0), rotation=turn, rgba=rgba)],
        DOWN,
        light=replace(light, rounds_down=True),
    )
    assert cut.rgba[20, 20, :3].tolist() == [int(level + 1e-3) for level in expected]
