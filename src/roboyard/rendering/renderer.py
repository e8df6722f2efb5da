"""`render`: a picture of a scene by the software renderer or OpenGL."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Literal

import numpy as np

from roboyard._arrays import ArrayLike
from roboyard.rendering.camera import Camera
from roboyard.rendering.image import Image
from roboyard.rendering.light import RGB, Backdrop, Light
from roboyard.rendering.scene import DebugLines, RenderScene

if TYPE_CHECKING:
    from roboyard._mujoco import mujoco as mj

Background = RGB | tuple[float, float, float, float] | Backdrop
Backend = Literal["auto", "software", "gl"]

DEFAULT_LIGHT = Light()
_FRAMES_KEY = "frames"


def render(
    scene: RenderScene,
    positions: ArrayLike,
    rotations: ArrayLike,
    camera: Camera,
    *,
    shadow: bool = True,
    light: Light = DEFAULT_LIGHT,
    lines: DebugLines | None = None,
    background: Background | None = None,
    colors: ArrayLike | None = None,
    samples: Literal[1, 4] = 1,
    backend: Backend = "auto",
    mujoco: tuple[mj.MjModel, mj.MjData] | None = None,
) -> Image:
    """Return a picture of a scene: colour, depth (m) and owner ids in one pass.

    Depth and ids are those of the nearest surface, transparent ones included; shapes with alpha 0 are
    skipped. Lines are drawn into the colours only.

    Args:
        scene: shapes to draw. The software renderer caches its arrays in it until `scene.revision` changes.
        positions: (n, 3) origins of the frames in the world frame (m).
        rotations: (n, 3, 3) or (n, 9) rotation matrices of the frames in the world frame.
        camera: pose, projection and number of pixels.
        shadow: whether the sun casts shadows.
        light: sun, sky and ambient light; `UNLIT` renders colours unchanged.
        lines: line segments to draw in addition to those of the scene.
        background: colour (0 to 1, with alpha if given) or gradient; None: the scene's background colour.
        colors: (shapes, 3) RGB (0 to 1) in place of those of the scene's shapes, multiplied with textures as
            these; drawn by the software renderer only.
        samples: colour samples of a pixel; 4 smooths edges at about four times the cost. Depth and ids do
            not depend on it. "gl" uses the model's `offsamples` instead.
        backend: "software" needs no graphics library; "gl" is MuJoCo's own OpenGL renderer; "auto" uses "gl"
            where `mujoco` is given and a graphics card works, else "software".
        mujoco: (MjModel, MjData) for "gl"; its bodies must be the frames of the scene.

    Raises:
        ValueError: frames of the wrong shape or too few for the scene, an unknown backend, another number of
            samples, a light without direction, or colours of the wrong shape or with "gl".
        RoboyardError: "gl" was requested and OpenGL or the model is missing.
    """
    xpos, xmat = _frames(scene, positions, rotations)
    if backend not in ("auto", "software", "gl"):
        raise ValueError(f'backend must be "auto", "software" or "gl", got {backend!r}')
    if samples not in (1, 4):
        raise ValueError(f"samples must be 1 or 4, got {samples}")
    if not math.hypot(*light.direction) > 0:
        raise ValueError(f"light.direction is {light.direction}; point it from the scene towards the sun")
    rgb = None if colors is None else _colors(scene, colors, backend)
    all_lines = _joined_lines(scene.lines, lines)
    backdrop, fade = _backdrop(scene.background if background is None else background)
    if backend == "gl" or (backend == "auto" and mujoco is not None and rgb is None):
        from roboyard.rendering import opengl

        if backend == "gl" or opengl.has_hardware():
            return opengl.draw(
                mujoco, scene, camera, shadow=shadow, light=light, lines=all_lines, backdrop=backdrop
            )
    from roboyard.rendering import software

    return software.draw(
        scene, xpos, xmat, camera,
        shadow=shadow, light=light, lines=all_lines, backdrop=backdrop, fade=fade, samples=samples,
        colors=rgb,
    )  # fmt: skip


def _frames(scene: RenderScene, positions: ArrayLike, rotations: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
    xpos = np.ascontiguousarray(positions, dtype=float)
    xmat = np.ascontiguousarray(rotations, dtype=float)
    if xpos.ndim != 2 or xpos.shape[1] != 3 or xmat.size != 9 * len(xpos):
        raise ValueError(
            f"frames must have shapes (n, 3) and (n, 3, 3), got {xpos.shape} and {np.shape(rotations)}"
        )
    needed = _frame_count(scene)
    if needed > len(xpos):
        raise ValueError(f"the scene's shapes use {needed} frames, got {len(xpos)}")
    return xpos, xmat.reshape(-1, 3, 3)


def _frame_count(scene: RenderScene) -> int:
    known = scene.extra.get(_FRAMES_KEY)
    if not isinstance(known, tuple) or known[0] is not scene.shapes or known[1] != scene.revision:
        needed = max((shape.frame for shape in scene.shapes), default=-1) + 1
        known = scene.extra[_FRAMES_KEY] = scene.shapes, scene.revision, needed
    return known[2]


def _colors(scene: RenderScene, colors: ArrayLike, backend: str) -> np.ndarray:
    rgb = np.asarray(colors, dtype=float)
    if backend == "gl":
        raise ValueError('colours of shapes are drawn by the software renderer only, got backend="gl"')
    if rgb.shape != (len(scene.shapes), 3) or not ((rgb >= 0.0) & (rgb <= 1.0)).all():
        raise ValueError(
            f"colors must be 3 numbers from 0 to 1 for each of {len(scene.shapes)} shapes, got shape "
            f"{rgb.shape}"
        )
    return rgb


def _joined_lines(first: DebugLines | None, second: DebugLines | None) -> DebugLines | None:
    if first is None or second is None:
        return second if first is None else first
    names = ("start", "end", "rgb", "width")
    return DebugLines(
        **{name: np.concatenate([getattr(first, name), getattr(second, name)]) for name in names}
    )


def _backdrop(background: Background) -> tuple[np.ndarray, tuple[float, float] | None]:
    """Return (2, 4) RGBA at the top and the bottom, and the depths (m) where infinite planes fade."""
    if isinstance(background, Backdrop):
        return np.array([(*background.top, 1.0), (*background.bottom, 1.0)]), background.fade
    color = (*background, 1.0)[:4]
    if len(background) not in (3, 4):
        raise ValueError(f"background must be a colour of 3 or 4 numbers or a Backdrop, got {background!r}")
    return np.array([color, color], dtype=float), None
