"""Camera images: getCameraImage."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from roboyard.pybullet.api.math.camera_matrices import (
    computeProjectionMatrixFOV,
    computeViewMatrixFromYawPitchRoll,
)
from roboyard.pybullet.face import constants as c
from roboyard.pybullet.face.arguments import floats, number, whole
from roboyard.pybullet.face.commands import command
from roboyard.pybullet.face.errors import failure
from roboyard.pybullet.state.debug_items import Line, Points
from roboyard.pybullet.state.visualizer_camera import WINDOW_METHODS
from roboyard.transforms import rotate

if TYPE_CHECKING:
    from roboyard.pybullet.client import Client
    from roboyard.pybullet.state.physics_scene import PhysicsScene
    from roboyard.rendering import Camera, DebugLines, Image

Vector = Sequence[float]
_BAD_MATRIX = "Error parsing view or projection matrix."
_DOT = np.array([0.0, 0.0, 1e-6])  # m: a point is drawn as a very short line, as wide as the point
_OWN_VIEW, _OWN_ANGLE, _OWN_ASPECT = ((0.0, 0.0, 0.0), 1.5, -80.0, -10.0, 0.0, 2), 90.0, 4.0 / 3.0
"""View, field of view (degrees) and aspect of the camera that Bullet's software renderer starts with."""


@command()
def getCameraImage(
    client: Client,
    width: int,
    height: int,
    viewMatrix: Vector | None = None,
    projectionMatrix: Vector | None = None,
    lightDirection: Vector | None = None,
    lightColor: Vector | None = None,
    lightDistance: float = -1.0,
    shadow: int = -1,
    lightAmbientCoeff: float = -1.0,
    lightDiffuseCoeff: float = -1.0,
    lightSpecularCoeff: float = -1.0,
    renderer: int = -1,
    flags: int = -1,
    projectiveTextureView: Vector | None = None,
    projectiveTextureProj: Vector | None = None,
) -> tuple[int, int, np.ndarray, np.ndarray, np.ndarray]:
    """Render a camera image. Light and shadow arguments stay in effect for later images that omit them.

    Args:
        width: width (pixels).
        height: height (pixels).
        viewMatrix: 16 numbers, column-major; see computeViewMatrix. None: a camera as PyBullet's.
        projectionMatrix: 16 numbers, column-major; see computeProjectionMatrixFOV. Neither is used alone.
        lightDirection: direction from the scene towards the light.
        lightColor: red, green, blue (0 to 1).
        lightDistance: ignored; the light is at infinity.
        shadow: 1 draws shadows.
        lightAmbientCoeff: ambient coefficient (0 to 1); 1 with the other two 0 gives unlit colours.
        lightDiffuseCoeff: diffuse coefficient (0 to 1).
        lightSpecularCoeff: specular coefficient (0 to 1).
        renderer: ER_TINY_RENDERER or ER_BULLET_HARDWARE_OPENGL; both give the same image.
        flags: ER_SEGMENTATION_MASK_OBJECT_AND_LINKINDEX, ER_NO_SEGMENTATION_MASK.
        projectiveTextureView: ignored; projective textures are not drawn.
        projectiveTextureProj: ignored.

    Returns:
        Width, height, (h, w, 4) uint8 rgba, (h, w) float32 depth buffer (non-linear, 0 near to 1 far and
        background) and (h, w) int32 ids: body, or body + ((link + 1) << 24), -1 for the background.

    Raises:
        error: a matrix does not have 16 numbers or cannot be inverted.
    """
    from roboyard.rendering import render
    from roboyard.rendering.camera import MAX_SIDE

    w, h = whole(width), whole(height)
    view, projection = _matrices(client, w, h, viewMatrix, projectionMatrix)
    if not (any(view) and any(projection)) and 0 <= min(w, h) <= max(w, h) <= MAX_SIDE:
        return _empty_picture(w, h, 1.0 if any(projection) else math.nan)
    camera = _camera(w, h, view, projection)
    light = client.light
    light.update(
        lightDirection, lightColor, shadow, (lightAmbientCoeff, lightDiffuseCoeff, lightSpecularCoeff)
    )
    number(lightDistance)
    scene = client.scene
    positions, rotations = scene.world.frames()
    drawn = scene.world.render_scene()
    if client.method not in WINDOW_METHODS or whole(renderer) == c.ER_TINY_RENDERER:
        drawn = scene.solid.of(drawn)
    image = render(
        drawn, positions, rotations, camera,
        shadow=light.shadow, light=light.to_light(), lines=debug_lines(client, scene), backend="software",
    )  # fmt: skip
    chosen = max(0, whole(flags))
    return w, h, image.rgba, _depth_buffer(image), _ids(scene, image.segmentation, chosen)


def _empty_picture(
    width: int, height: int, depth: float
) -> tuple[int, int, np.ndarray, np.ndarray, np.ndarray]:
    """Return what a camera of zeros sees, as those of getDebugVisualizerCamera without a window are."""
    return (
        width,
        height,
        np.full((height, width, 4), 255, np.uint8),
        np.full((height, width), depth, np.float32),
        np.full((height, width), -1, np.int32),
    )


def _depth_buffer(image: Image) -> np.ndarray:
    """Return the (h, w) float32 depth buffer, 1 for the background.

    Bullet's renderer converts depths along the camera's axis as if each projection were a perspective one.
    """
    (m10, m14), is_perspective = image.camera.projection[2, 2:], image.camera.projection[3, 3] == 0.0
    if is_perspective or abs(m10) == 1.0:
        return image.depth_buffer()
    near, far = m14 / (m10 - 1.0), m14 / (m10 + 1.0)
    buffer = far / (far - near) - far * near / (far - near) / image.depth
    return np.where(np.isfinite(image.depth), buffer, 1.0).astype(np.float32)


def _matrices(
    client: Client, width: int, height: int, view: Vector | None, projection: Vector | None
) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Return the 16 numbers of view and projection, or without both those of the default camera.

    That is the visualizer's; without a window, Bullet's software renderer has one of its own, whose aspect
    never changes, and whose near and far plane are those of the last picture.
    """
    is_given = view is not None and projection is not None
    if view is None or projection is None:
        if client.method in WINDOW_METHODS:
            v = client.visualizer
            view = computeViewMatrixFromYawPitchRoll(v.target, v.distance, v.yaw, v.pitch, 0.0, v.up_axis)
            projection = computeProjectionMatrixFOV(60.0, width / max(height, 1), 0.01, 1000.0)
        else:
            view = computeViewMatrixFromYawPitchRoll(*_OWN_VIEW)
            projection = computeProjectionMatrixFOV(_OWN_ANGLE, _OWN_ASPECT, *client.picture_planes)
    entries, numbers = floats(projection, 16, _BAD_MATRIX), floats(view, 16, _BAD_MATRIX)
    if is_given and entries[10] not in (1.0, -1.0):
        client.picture_planes = entries[14] / (entries[10] - 1.0), entries[14] / (entries[10] + 1.0)
    return numbers, entries


@lru_cache(16)
def _camera(width: int, height: int, view: tuple[float, ...], projection: tuple[float, ...]) -> Camera:
    """Return the camera of two column-major matrices; most scripts take many pictures with each.

    Raises:
        error: a matrix cannot be inverted.
    """
    from roboyard.rendering import Camera
    from roboyard.rendering.matrices import with_rigid_view

    to_camera, to_clip = (np.array(matrix).reshape(4, 4).T for matrix in (view, projection))
    # PyBullet samples a pixel at its lower left corner, half a pixel left of and below the centre.
    to_clip[:2] += np.array([[1.0 / max(width, 1)], [1.0 / max(height, 1)]]) * to_clip[3]
    to_camera, to_clip = with_rigid_view(to_camera, to_clip)
    try:
        return Camera(width, height, to_camera, to_clip)
    except ValueError as problem:
        raise failure(_BAD_MATRIX, str(problem)) from None


def _ids(scene: PhysicsScene, owners: np.ndarray, flags: int) -> np.ndarray:
    """Return (h, w) int32 ids as scripts know them, from the World's (h, w, 2) owners."""
    from roboyard.pybullet.bullet_rules.image_kernels import segmentation_ids
    from roboyard.rendering.buffers import result

    out = result("ids", owners.shape[:2], np.int32)
    if flags & c.ER_NO_SEGMENTATION_MASK:
        out.fill(-1)
        return out
    numbers = np.full(max((r.body.id for r in scene.bodies.values()), default=-1) + 1, -1, dtype=np.int32)
    for record in scene.bodies.values():
        numbers[record.body.id] = record.number
    with_links = bool(flags & c.ER_SEGMENTATION_MASK_OBJECT_AND_LINKINDEX)
    segmentation_ids(owners.reshape(-1, 2), numbers, with_links, out.reshape(-1))
    return out


def debug_lines(client: Client, scene: PhysicsScene) -> DebugLines | None:
    """Return the debug lines and points in the world frame, or None; texts are not drawn into images."""
    from roboyard.rendering import DebugLines

    starts, ends, colors, widths = [], [], [], []
    for _, item in client.debug_items.drawings():
        if isinstance(item, Line):
            points, rgb, width = np.array([item.start, item.end]), np.array([item.rgb]), item.width
        elif isinstance(item, Points) and len(item.positions):
            points, rgb, width = item.positions, item.rgb, item.size
        else:
            continue
        placed = points if item.parent is None else _in_world(scene, item.parent, points)
        if placed is None:
            continue
        first, second = (placed[:1], placed[1:]) if isinstance(item, Line) else (placed, placed + _DOT)
        starts.append(first)
        ends.append(second)
        colors.append(rgb)
        widths.append(np.full(len(first), float(width)))
    if not starts:
        return None
    return DebugLines(
        start=np.concatenate(starts),
        end=np.concatenate(ends),
        rgb=np.concatenate(colors),
        width=np.concatenate(widths),
    )


def _in_world(scene: PhysicsScene, parent: tuple[int, int], points: np.ndarray) -> np.ndarray | None:
    """Return (k, 3) points of a link's inertial frame in the world frame (m); None if the body is removed."""
    body, link = parent
    record = scene.bodies.get(body)
    if record is None or not -1 <= link < record.joint_count:
        return None
    position, quaternion = record.body.links[link + 1].pose
    position, quaternion = record.to_inertial(position, quaternion, link)
    return position + rotate(quaternion, points)
