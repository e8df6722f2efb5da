"""The software renderer: triangles, shadows and lines in compiled loops, without a graphics library."""

from __future__ import annotations

import itertools
import math
from functools import lru_cache, partial
from time import perf_counter

import numpy as np

from roboyard._arrays import NDArray
from roboyard._records import NamedTuple
from roboyard.rendering import shadows
from roboyard.rendering.buffers import buffer, result, scratch
from roboyard.rendering.camera import Camera
from roboyard.rendering.compile_notice import announce
from roboyard.rendering.image import Image
from roboyard.rendering.kernels import lines as line_kernels
from roboyard.rendering.kernels import raster, runs, shade, textures
from roboyard.rendering.kernels.arrays import Background, Instances, Meshes, Sunlight, View
from roboyard.rendering.light import Light
from roboyard.rendering.matrices import inverse_3x3
from roboyard.rendering.parts import Pace, even_bands, in_parts, part_count
from roboyard.rendering.scene import DebugLines, RenderScene, lines_as_arrays
from roboyard.rendering.scene_arrays import SceneArrays, recolored, scene_arrays

Array = NDArray[np.float64]

PACE_KEY = "software pace"
FACE_COST = 4
"""Time that a face takes to draw over that of a pixel."""
MOST_LAYERS = 6
"""Most transparent surfaces blended in a pixel; deeper ones are nearly hidden."""


_MIRROR = np.diag([-1.0, 1.0, 1.0, 1.0])
_EPSILON = float(np.finfo(np.float32).eps)


def _least_nearness(near: float, far: float, *, is_perspective: bool) -> float:
    """Return the nearness down to which surfaces are drawn: the far plane's, less the error of float32.

    Surfaces in the far plane are thereby drawn, as by renderers that compute clip depths in float32.
    """
    if not is_perspective:
        return -far - _EPSILON * max(abs(far), 0.25 * (far - near))
    if not math.isfinite(far):
        return 0.0
    return 1.0 / far - _EPSILON * max(1.0 / far, 0.25 * (1.0 / near - 1.0 / far))


def _depth_of(nearness: float) -> float:
    return 1.0 / nearness if nearness > 0.0 else math.inf


class _Optics(NamedTuple):
    """Numbers and matrices of a camera alone."""

    perspective: bool
    near: float
    far: float
    q_near: float
    """Nearness of the least depth."""
    q_far: float
    """Nearness of the largest depth."""
    pixels: Array
    """(3, 4) `Camera.pixel_matrix`."""
    origins: Array
    """(3, 3) origins of rays: that of pixel (0, 0), and its change a column and a row (m)."""
    directions: Array
    """(3, 3) directions of rays, likewise."""


@lru_cache(16)
def _optics(camera: Camera) -> _Optics:
    """Return the numbers and matrices of a camera, which many pictures are taken with."""
    perspective, near, far = camera.is_perspective, camera.near, camera.far
    pixels = camera.pixel_matrix
    inverse = inverse_3x3(pixels[:, :3])
    origins, directions = np.zeros((3, 3)), np.zeros((3, 3))
    origins[0] = -inverse @ pixels[:, 3]
    if perspective:
        directions[:] = inverse[:, 2], inverse[:, 0], inverse[:, 1]
    else:
        directions[0] = inverse[:, 2]
        origins[1:] = inverse[:, 0], inverse[:, 1]
    q_far = _least_nearness(near, far, is_perspective=perspective)
    return _Optics(
        perspective=perspective,
        near=near,
        far=_depth_of(q_far) if perspective else -q_far,
        q_near=1.0 / near if perspective else -near,
        q_far=q_far,
        pixels=pixels,
        origins=origins,
        directions=directions,
    )


def _lamp(light: Light) -> tuple[Array, Array]:
    """Return the (3,) unit vector to the sun and the (13,) numbers of `Sunlight`."""
    to_sun = np.asarray(light.direction, dtype=float)
    to_sun = to_sun / np.linalg.norm(to_sun)
    lamp = np.array(
        [
            *(*to_sun, *light.color, light.ambient, light.diffuse, light.specular, light.sky, light.leak),
            *(light.gloss, 1e-3 if light.rounds_down else 0.5),
        ]
    )
    return to_sun, lamp


_known_lamp = lru_cache(16)(_lamp)


class _Frame:
    """Matrices and buffers of one picture."""

    def __init__(self, arrays: SceneArrays, to_world: Array, camera: Camera, parts: int) -> None:
        self.arrays = arrays
        self.camera = camera
        self.to_world = to_world
        self.width, self.height = camera.width, camera.height
        optics = _optics(camera)
        self.perspective = optics.perspective
        self.near, self.far = optics.near, optics.far
        self.q_near, self.q_far = optics.q_near, optics.q_far
        self.pixels, self.origins, self.directions = optics.pixels, optics.origins, optics.directions
        self.screens = self.pixels[None, :, :3] @ to_world
        self.screens[:, :, 3] += self.pixels[:, 3]
        self.nothing = np.zeros(1, dtype=np.float32)
        self.parts = parts
        self.bands = self._bands() if parts > 1 else [(0, self.height)]

    def _bands(self) -> list[tuple[int, int]]:
        """Return ranges of rows that take about the same time to draw: they show as many faces and pixels."""
        draws = self.arrays.opaque
        places = np.einsum("nij,nj->in", self.screens[:, 1:, :3], self.arrays.middles)
        rows, depths = places + self.screens[:, 1:, 3].T
        rows = rows / np.where(depths > 0.0, depths, np.inf) if self.perspective else rows
        rows, faces = rows[draws[:, 0]], draws[:, 4] - draws[:, 3]
        steps = np.linspace(0.0, self.height, 33)
        cost = FACE_COST * ((rows[None, :] < steps[:, None]) @ faces) + self.width * steps
        ends = np.interp(np.linspace(cost[0], cost[-1], self.parts + 1), cost, steps).astype(int).tolist()
        return list(itertools.pairwise([0, *ends[1:-1], self.height]))

    def visibility(self, name: str) -> tuple[NDArray[np.int64], NDArray[np.float32]]:
        """Return code and nearness (pixels,) of the nearest opaque surface of each pixel."""
        count = self.width * self.height
        seen = buffer(name + "-seen", (count,), np.int64)
        nearness = buffer(name + "-nearness", (count,), np.float32)

        def draw(first: int, end: int) -> int:
            a, b = first * self.width, end * self.width
            seen[a:b] = -1
            nearness[a:b] = self.q_far
            meshes, planes = self.arrays.opaque, self.arrays.planes
            return self._draw(meshes, planes, raster.RECORD, self.nothing, nearness, seen, first, end)

        in_parts([partial(draw, *band) for band in self.bands])
        return seen, nearness

    def next_layer(
        self, limit: NDArray[np.float32], behind: NDArray[np.float32], name: str
    ) -> tuple[NDArray[np.int64], NDArray[np.float32], int]:
        """Return the nearest transparent surfaces between `limit` and `behind`, and their pixel count."""
        seen = buffer(f"{name}-seen", limit.shape, np.int64)
        nearness = buffer(f"{name}-nearness", limit.shape, np.float32)

        def draw(first: int, end: int) -> int:
            a, b = first * self.width, end * self.width
            seen[a:b] = -1
            nearness[a:b] = behind[a:b]
            meshes, planes = self.arrays.clear, self.arrays.clear_planes
            return self._draw(meshes, planes, raster.PEEL, limit, nearness, seen, first, end)

        return seen, nearness, sum(in_parts([partial(draw, *band) for band in self.bands]))

    def _draw(
        self,
        draws: NDArray,
        planes: NDArray,
        mode: int,
        limit: NDArray,
        nearness: NDArray,
        seen: NDArray,
        first: int,
        end: int,
    ) -> int:
        won = 0
        if len(draws):
            won += raster.draw_meshes(
                draws, self.screens, self.arrays.boxes, self.arrays.axes, self.arrays.faces,
                self.perspective, self.near, self.far, mode, limit, nearness, seen,
                self.width, first, end, *scratch(self.arrays.most_vertices),
            )  # fmt: skip
        for instance in planes:
            slopes = self._plane_slopes(int(instance))
            if slopes is not None:
                code = (int(instance) << 32) | raster.PLANE
                won += raster.draw_plane(
                    *slopes, self.q_near, code, mode, limit, nearness, seen, self.width, first, end
                )
        return won

    def _plane_slopes(self, instance: int) -> tuple[float, float, float] | None:
        """Return the nearness of an infinite plane: change per column and per row, value at pixel (0, 0)."""
        place = self.to_world[instance]
        normal = np.cross(place[:, 0], place[:, 1])
        normal = normal / np.linalg.norm(normal)
        along = self.directions @ normal
        offset = self.origins @ normal
        height = offset[0] - normal @ place[:, 3]
        if self.perspective:
            if abs(height) < 1e-9:
                return None
            q = -along / height
        else:
            if abs(along[0]) < 1e-12:
                return None
            q = np.array([height, offset[1], offset[2]]) / along[0]
        return float(q[1]), float(q[2]), float(q[0])


def draw(
    scene: RenderScene,
    positions: Array,
    rotations: Array,
    camera: Camera,
    *,
    shadow: bool,
    light: Light,
    lines: DebugLines | None,
    backdrop: Array,
    fade: tuple[float, float] | None,
    samples: int,
    colors: Array | None = None,
) -> Image:
    """Return a picture of `scene`; the arguments are those of `roboyard.rendering.render`, checked there.

    Args:
        scene: shapes to draw.
        positions: (n, 3) origins of the frames in the world frame (m).
        rotations: (n, 3, 3) rotation matrices of the frames in the world frame.
        camera: pose, projection and number of pixels.
        shadow: whether the sun casts shadows.
        light: sun, sky and ambient light.
        lines: line segments over the picture.
        backdrop: (2, 4) RGBA at the top and at the bottom.
        fade: depths (m) between which infinite planes fade into the backdrop.
        samples: colour samples of a pixel, 1 or 4.
        colors: (shapes, 3) RGB in place of those of the shapes.
    """
    if np.linalg.det(camera.projection[:2, :2]) < 0.0:  # the loops know outsides by the direction of corners
        mirrored = Camera(camera.width, camera.height, camera.view, _MIRROR @ camera.projection)
        image = draw(
            scene, positions, rotations, mirrored, shadow=shadow, light=light, lines=lines, backdrop=backdrop,
            fade=fade, samples=samples, colors=colors,
        )  # fmt: skip
        return Image(
            rgba=np.ascontiguousarray(image.rgba[:, ::-1]),
            depth=np.ascontiguousarray(image.depth[:, ::-1]),
            segmentation=np.ascontiguousarray(image.segmentation[:, ::-1]),
            camera=camera,
        )
    announce(raster.draw_meshes, shade.shade)
    arrays = scene_arrays(scene)
    if colors is not None:
        arrays = recolored(arrays, colors)
    turn = rotations[arrays.frame]
    to_world = np.empty((len(arrays.frame), 3, 4))
    to_world[:, :, :3] = turn @ arrays.shape
    to_world[:, :, 3] = np.einsum("nij,nj->ni", turn, arrays.position) + positions[arrays.frame]
    to_local = np.ascontiguousarray(arrays.shape_inverse @ np.swapaxes(turn, 1, 2))
    paces = scene.extra.setdefault(PACE_KEY, {})
    assert isinstance(paces, dict)
    if len(paces) > 100:
        paces.clear()
    pace: Pace = paces.setdefault((camera.width, camera.height, samples), Pace())
    parts = pace.parts(part_count(camera.width * camera.height * samples))
    start = perf_counter()
    frame = _Frame(arrays, to_world, camera, parts)
    depth = result("depth", (frame.width * frame.height,), np.float32)
    owners = result("segmentation", (frame.width * frame.height, 2), np.int32)
    if samples == 1:
        seen, nearness = frame.visibility("opaque")
        rgba = _color(
            frame, to_local, seen, nearness, shadow, light, lines, 1.0, backdrop, fade, (depth, owners)
        )
    else:
        fine = _Frame(arrays, to_world, camera.resized(2 * camera.width, 2 * camera.height), parts)
        seen, nearness = fine.visibility("opaque")
        rgba = _color(fine, to_local, seen, nearness, shadow, light, lines, 2.0, backdrop, fade, None)
        four = rgba.reshape(camera.height, 2, camera.width, 2, 4).astype(np.uint16)
        even = four[:, 0, :, 0] + four[:, 0, :, 1] + four[:, 1, :, 0] + four[:, 1, :, 1]
        rgba = ((even + 2) >> 2).astype(np.uint8)
        surface = _front(frame, *frame.visibility("opaque"))
        _describe(frame, *surface, depth, owners, 0, frame.height)
    pace.note(parts, perf_counter() - start)
    size = (camera.height, camera.width)
    return Image(
        rgba=rgba.reshape(*size, 4),
        depth=depth.reshape(size),
        segmentation=owners.reshape(*size, 2),
        camera=camera,
    )


def _describe(
    frame: _Frame,
    seen: NDArray[np.int64],
    nearness: NDArray[np.float32],
    depth: NDArray[np.float32],
    owners: NDArray[np.int32],
    first: int,
    end: int,
) -> None:
    """Write (pixels,) depth (m) and (pixels, 2) owners of the nearest surfaces in some rows."""
    rows = slice(first * frame.width, end * frame.width)
    links = frame.arrays.links
    shade.describe(seen[rows], nearness[rows], links, frame.perspective, depth[rows], owners[rows])


def _front(
    frame: _Frame, seen: NDArray[np.int64], nearness: NDArray[np.float32]
) -> tuple[NDArray[np.int64], NDArray[np.float32]]:
    """Return code and nearness of the nearest surfaces, transparent ones included."""
    if not len(frame.arrays.clear) and not len(frame.arrays.clear_planes):
        return seen, nearness
    limit = np.full(nearness.shape, np.inf, dtype=np.float32)
    over, over_nearness, won = frame.next_layer(limit, nearness, "front")
    return (np.where(over < 0, seen, over), over_nearness) if won else (seen, nearness)


def _color(
    frame: _Frame,
    to_local: Array,
    seen: NDArray[np.int64],
    nearness: NDArray[np.float32],
    shadow: bool,
    light: Light,
    lines: DebugLines | None,
    line_scale: float,
    backdrop: Array,
    fade: tuple[float, float] | None,
    described: tuple[NDArray[np.float32], NDArray[np.int32]] | None,
) -> NDArray[np.uint8]:
    """Return (pixels, 4) RGBA; writes depth and owners of the nearest surfaces to `described`."""
    arrays, width, height = frame.arrays, frame.width, frame.height
    surface = _front(frame, seen, nearness)
    try:
        to_sun, lamp = _known_lamp(light)
    except TypeError:  # its vectors are lists or arrays
        to_sun, lamp = _lamp(light)
    cast = shadows.NO_SHADOW
    if shadow and light.diffuse > 0.0:
        cast = shadows.cast(
            arrays, frame.to_world, to_sun, *surface, width, height, frame.perspective,
            (frame.origins, frame.directions), frame.parts,
        )  # fmt: skip
    sun = Sunlight(lamp, cast.nearness, cast.tiles, cast.size, cast.matrix, cast.texel, cast.shaded)
    view = View(width, height, frame.perspective, frame.origins, frame.directions)
    instances = Instances(frame.to_world, to_local, arrays.materials, arrays.links)
    meshes = Meshes(arrays.faces, arrays.vertices, arrays.normals, arrays.colors)
    behind = Background(backdrop, np.array(fade or (np.inf, np.inf)))
    rgba = result("rgba", (width * height,), np.uint32)
    layered = surface[0] is not seen
    front = np.zeros((width * height if layered else 1, 4), dtype=np.float32)

    textured = arrays.textured
    words = buffer("paint", (width * height if textured else 1,), np.uint32)

    if textured:
        announce(textures.sample_textures)

    def paint(codes: NDArray[np.int64], near: NDArray[np.float32], final: bool, first: int, end: int) -> None:
        if textured:
            textures.sample_textures(
                codes, near, first, end, width, frame.perspective, frame.origins, frame.directions,
                frame.to_world, to_local, arrays.links, arrays.faces, arrays.vertices, arrays.uv,
                arrays.texels, arrays.texture_table, buffer("laid", (3, 6), np.float64),
                buffer("texture-single", (textures.SINGLE,), np.float32),
                buffer("texture-whole", (textures.WHOLE,), np.int32),
                buffer("texture-colors", (textures.COLORS,), np.uint32), words,
            )  # fmt: skip
        shade.shade(
            codes, near, first, end, view, instances, meshes, words, sun, behind, front, layered, final,
            buffer("shades", (runs.WORK,), np.float32), rgba,
        )  # fmt: skip
        if final and described is not None:
            _describe(frame, *surface, *described, first, end)

    bands = even_bands(height, frame.parts)
    if layered:
        limit = np.full(nearness.shape, np.inf, dtype=np.float32)
        for k in range(MOST_LAYERS):
            layer, near, won = frame.next_layer(limit, nearness, f"layer{k % 2}")
            if not won:
                break
            in_parts([partial(paint, layer, near, False, *band) for band in bands])
            # pixels without such a layer have no more transparent surfaces in front of their opaque one
            limit = near
    in_parts([partial(paint, seen, nearness, True, *band) for band in bands])
    rgba = rgba.view(np.uint8).reshape(-1, 4)
    if lines is not None and len(lines.start):
        line_kernels.draw_lines(
            *lines_as_arrays(lines, line_scale), frame.pixels, frame.perspective, frame.near,
            width, height, nearness, rgba, np.empty((2, 3)),
        )  # fmt: skip
    return rgba
