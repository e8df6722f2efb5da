"""Pictures by MuJoCo's OpenGL renderer, for machines with a graphics card.

It draws the geoms of groups 0 to 2 of a compiled model. Cameras with skewed pixels are not supported; a
picture with pixels that are not square is rendered on square ones and resampled.
"""

from __future__ import annotations

import os
import subprocess
import sys
import threading
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from roboyard._arrays import NDArray
from roboyard.errors import RoboyardError
from roboyard.rendering.camera import Camera
from roboyard.rendering.image import Image
from roboyard.rendering.light import Light
from roboyard.rendering.scene import DebugLines, RenderScene, lines_as_arrays

if TYPE_CHECKING:
    import mujoco

SOFTWARE_NAMES = ("llvmpipe", "softpipe", "swrast", "software", "svga3d", "swiftshader")
FARTHEST = 1e5
"""Far clipping plane of a camera that has none (m)."""
_MOST_GEOMS = 20000

_PROBE = """
from roboyard.rendering.opengl import open_context
context = open_context(16, 16)
context.make_current()
from OpenGL import GL
print("renderer:", GL.glGetString(GL.GL_RENDERER).decode(errors="replace"))
"""

_local = threading.local()


@lru_cache(maxsize=1)
def has_hardware() -> bool:
    """Return whether OpenGL renders on a graphics card; probed once in a child process: drivers may crash."""
    if sys.platform == "linux" and not _device_files():
        return False
    environment = dict(os.environ)
    environment["PYTHONPATH"] = os.pathsep.join([str(Path(__file__).parents[2]), *sys.path])
    try:
        done = subprocess.run(  # noqa: S603 - our own interpreter and our own text
            [sys.executable, "-c", _PROBE], capture_output=True, text=True, timeout=20, env=environment
        )
    except (OSError, subprocess.TimeoutExpired):
        return False
    name = next((line for line in done.stdout.splitlines() if line.startswith("renderer:")), "")
    return done.returncode == 0 and bool(name) and not any(word in name.lower() for word in SOFTWARE_NAMES)


def _device_files() -> bool:
    return (
        any(Path("/dev/dri").glob("renderD*")) or Path("/dev/nvidia0").exists() or Path("/dev/dxg").exists()
    )


def open_context(width: int, height: int) -> Any:
    """Return an off-screen OpenGL context of `width` by `height` pixels.

    MUJOCO_GL selects the library, as in MuJoCo; without it, EGL is used on Linux, where it needs no display.
    Raises RoboyardError where no OpenGL library works.
    """
    choice = os.environ.get("MUJOCO_GL", "").lower().strip()
    try:
        if not choice and sys.platform == "linux":
            from mujoco.egl import GLContext
        else:
            from mujoco.gl_context import GLContext
        return GLContext(width, height)
    except Exception as error:  # the bindings raise errors of many types where their library is missing
        raise RoboyardError(
            f"no OpenGL library works ({type(error).__name__}: {error}); on Debian install libegl1 "
            "and libgl1-mesa-dri or the graphics card's driver, or use backend='software', which needs none"
        ) from error


class GlRenderer:
    """MuJoCo's OpenGL renderer of one model, for one thread; close it, or use it in a `with` statement."""

    def __init__(self, model: mujoco.MjModel) -> None:
        import mujoco

        self.model = model
        self._size = (max(model.vis.global_.offwidth, 64), max(model.vis.global_.offheight, 64))
        self._gl: Any = open_context(*self._size)
        try:
            self._gl.make_current()
            self._scene = mujoco.MjvScene(model, maxgeom=_MOST_GEOMS)
            self._context = mujoco.MjrContext(model, mujoco.mjtFontScale.mjFONTSCALE_100.value)
            mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN.value, self._context)
        except Exception as error:
            self._gl.free()
            raise RoboyardError(
                f"OpenGL works but MuJoCo cannot render with it: {error}; use backend='software'"
            ) from error
        self._context.readDepthMap = mujoco.mjtDepthMap.mjDEPTH_ZEROFAR.value
        self._option = mujoco.MjvOption()
        self._free = mujoco.MjvCamera()

    def __enter__(self) -> GlRenderer:
        return self

    def __exit__(self, *exception: object) -> None:
        self.close()

    def close(self) -> None:
        """Free the graphics memory."""
        if self._gl is not None:
            self._gl.make_current()
            self._context.free()
            self._gl.free()
            self._gl = None

    def render(
        self, data: mujoco.MjData, owners: NDArray[np.int32], camera: Camera, *, shadow: bool, light: Light,
        lines: DebugLines | None, backdrop: NDArray[np.float64],
    ) -> Image:  # fmt: skip
        """Return a picture of `data`; the other arguments are those of `roboyard.rendering.render`.

        Args:
            data: state to draw.
            owners: (nbody, 2) body id and link index of each MuJoCo body, written to the segmentation.
            camera: pose and projection.
            shadow: whether the sun casts shadows.
            light: sun, sky and ambient light.
            lines: segments over the picture.
            backdrop: (2, 4) RGBA at the top and at the bottom.

        Raises RoboyardError for scenes with too many geoms and for skewed cameras.
        """
        import mujoco

        self._gl.make_current()
        mujoco.mjv_updateScene(
            self.model, data, self._option, None, self._free, mujoco.mjtCatBit.mjCAT_ALL.value, self._scene
        )
        if self._scene.status:
            raise RoboyardError(f"the scene has more than {_MOST_GEOMS} geoms; use backend='software'")
        near, far, columns = _aim(self._scene, camera)
        rect = mujoco.MjrRect(0, 0, columns, camera.height)
        if columns > self._size[0] or camera.height > self._size[1]:
            self._size = max(columns, self._size[0]), max(camera.height, self._size[1])
            mujoco.mjr_resizeOffscreen(*self._size, self._context)
        flags = self._scene.flags
        flags[:] = 0
        flags[mujoco.mjtRndFlag.mjRND_CULL_FACE] = 1
        flags[mujoco.mjtRndFlag.mjRND_SEGMENT] = 1
        flags[mujoco.mjtRndFlag.mjRND_IDCOLOR] = 1
        codes = np.empty((camera.height, columns, 3), dtype=np.uint8)
        window = np.empty((camera.height, columns), dtype=np.float32)
        mujoco.mjr_render(rect, self._scene, self._context)
        mujoco.mjr_readPixels(codes, window, rect, self._context)
        depth, segmentation = _surfaces(self._scene, self.model, owners, codes, window, camera, near, far)

        flags[mujoco.mjtRndFlag.mjRND_SEGMENT] = 0
        flags[mujoco.mjtRndFlag.mjRND_IDCOLOR] = 0
        flags[mujoco.mjtRndFlag.mjRND_SHADOW] = int(shadow and light.diffuse > 0)
        _illuminate(self._scene, light)
        rgb = np.empty((camera.height, columns, 3), dtype=np.uint8)
        mujoco.mjr_render(rect, self._scene, self._context)
        mujoco.mjr_readPixels(rgb, None, rect, self._context)
        rgba = np.dstack([rgb, np.full(rgb.shape[:2], 255, dtype=np.uint8)])
        share = ((np.arange(camera.height)[::-1] + 0.5) / camera.height)[:, None]
        behind = np.round(255.0 * (backdrop[0] * (1.0 - share) + backdrop[1] * share)).astype(np.uint8)
        # MuJoCo clears to black and blends outlines with it; the backdrop replaces pixels without a surface
        empty = ~np.isfinite(depth)
        rgba[empty] = np.broadcast_to(behind[:, None], rgba.shape)[empty]
        pick = np.minimum(((np.arange(camera.width) + 0.5) * columns / camera.width).astype(int), columns - 1)
        image = Image(
            rgba=np.ascontiguousarray(rgba[::-1, pick]),
            depth=np.ascontiguousarray(depth[::-1, pick]),
            segmentation=np.ascontiguousarray(segmentation[::-1, pick]),
            camera=camera,
        )
        if lines is not None and len(lines.start):
            _draw_lines(camera, lines, image.depth, image.rgba)
        return image


def draw(
    source: tuple[mujoco.MjModel, mujoco.MjData] | None, scene: RenderScene, camera: Camera, *, shadow: bool,
    light: Light, lines: DebugLines | None, backdrop: NDArray[np.float64],
) -> Image:  # fmt: skip
    """Return a picture of (MjModel, MjData), with the owners of the frames of `scene`.

    `backdrop` is the (2, 4) RGBA at the top and at the bottom. Raises RoboyardError without a model.
    """
    if source is None:
        raise RoboyardError(f"backend='gl' draws a MuJoCo model, got {source}; pass mujoco=(model, data)")
    model, data = source
    cached: GlRenderer | None = getattr(_local, "renderer", None)
    if cached is None or cached.model is not model:
        if cached is not None:
            cached.close()
            _local.renderer = None
        cached = _local.renderer = GlRenderer(model)
    owners = np.full((model.nbody, 2), -1, dtype=np.int32)
    for shape in scene.shapes:
        owners[shape.frame] = shape.owner
    return cached.render(data, owners, camera, shadow=shadow, light=light, lines=lines, backdrop=backdrop)


def _aim(scene: mujoco.MjvScene, camera: Camera) -> tuple[float, float, int]:
    """Set the cameras of MuJoCo's scene; returns near and far (m) and the width in square pixels."""
    p = camera.projection
    if abs(p[0, 1]) > 1e-9 or abs(p[1, 0]) > 1e-9:
        raise RoboyardError(
            f"MuJoCo's OpenGL renderer has no skewed cameras, got skew {p[0, 1]:g} and {p[1, 0]:g}; "
            "use backend='software'"
        )
    near, far = camera.near, min(camera.far, FARTHEST)
    scale = near if camera.is_perspective else 1.0
    offset_x, offset_y = (p[0, 2], p[1, 2]) if camera.is_perspective else (-p[0, 3], -p[1, 3])
    bottom, top = scale * (offset_y - 1.0) / p[1, 1], scale * (offset_y + 1.0) / p[1, 1]
    columns = max(1, round(camera.height * p[1, 1] / p[0, 0]))
    pose = camera.T_world_camera
    for eye in scene.camera:
        eye.pos[:] = pose[:3, 3]
        eye.forward[:] = -pose[:3, 2]
        eye.up[:] = pose[:3, 1]
        eye.frustum_center = scale * offset_x / p[0, 0]
        eye.frustum_bottom, eye.frustum_top = bottom, top
        eye.frustum_near, eye.frustum_far = near, far
        eye.orthographic = int(not camera.is_perspective)
    return near, far, columns


def _surfaces(
    scene: mujoco.MjvScene, model: mujoco.MjModel, owners: NDArray[np.int32], codes: NDArray[np.uint8],
    window: NDArray[np.float32], camera: Camera, near: float, far: float,
) -> tuple[NDArray[np.float32], NDArray[np.int32]]:  # fmt: skip
    """Return depth (m; inf: no surface) and owners from MuJoCo's id picture and reversed depth buffer."""
    import mujoco

    number = codes.astype(np.int32) @ np.array([1, 256, 65536], dtype=np.int32)
    table = np.full((scene.ngeom + 1, 2), -1, dtype=np.int32)
    drawn = np.zeros(scene.ngeom + 1, dtype=bool)
    for geom in scene.geoms[: scene.ngeom]:
        if geom.segid >= 0:
            drawn[geom.segid + 1] = True
            if geom.objtype == mujoco.mjtObj.mjOBJ_GEOM:
                table[geom.segid + 1] = owners[model.geom_bodyid[geom.objid]]
    number = np.where(number <= scene.ngeom, number, 0)
    near_first = window.astype(float)
    if camera.is_perspective:
        depth = far * near / (near_first * (far - near) + near)
    else:
        depth = far - near_first * (far - near)
    return np.where(drawn[number], depth, np.inf).astype(np.float32), table[number]


def _illuminate(scene: mujoco.MjvScene, light: Light) -> None:
    """Replace the model's lights by one sun; the light of the sky becomes ambient light."""
    import mujoco

    direction = np.asarray(light.direction, dtype=float)
    color = np.asarray(light.color, dtype=float)
    scene.nlight = 2
    for lamp in scene.lights[:2]:
        lamp.type = mujoco.mjtLightType.mjLIGHT_DIRECTIONAL.value
        lamp.headlight, lamp.castshadow = 0, 0
        lamp.dir[:] = -direction / np.linalg.norm(direction)
        # shadows are cast from the position of the light: far enough away for the whole scene
        centre = np.asarray(scene.camera[0].pos) + 3.0 * np.asarray(scene.camera[0].forward)
        lamp.pos[:] = centre - 10.0 * np.asarray(lamp.dir)
        lamp.attenuation[:] = 1.0, 0.0, 0.0
        lamp.cutoff, lamp.exponent = 45.0, 0.0
        lamp.ambient[:] = lamp.diffuse[:] = lamp.specular[:] = 0.0
    # a light that casts shadows adds nothing inside them, so the ambient light is a separate one
    even, sun = scene.lights[0], scene.lights[1]
    even.ambient[:] = light.ambient + 0.5 * light.diffuse * light.sky * color
    sun.castshadow = 1
    sun.diffuse[:] = light.diffuse * (1.0 - light.sky) * color
    sun.specular[:] = light.specular * color


def _draw_lines(camera: Camera, lines: DebugLines, depth: NDArray, rgba: NDArray[np.uint8]) -> None:
    from roboyard.rendering.kernels.lines import draw_lines

    with np.errstate(divide="ignore"):
        nearness = 1.0 / depth if camera.is_perspective else -depth
    draw_lines(
        *lines_as_arrays(lines, 1.0), camera.pixel_matrix, camera.is_perspective, camera.near,
        camera.width, camera.height, nearness.astype(np.float32).ravel(), rgba.reshape(-1, 4),
        np.empty((2, 3)),
    )  # fmt: skip
