"""One call for a picture, whichever back end draws it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import ArrayLike

from roboyard.rendering.camera import Camera
from roboyard.rendering.image import Image
from roboyard.rendering.light import RGB, Backdrop, Light
from roboyard.rendering.scene import DebugLines, RenderScene

if TYPE_CHECKING:
    import mujoco as mj

Background = RGB | tuple[float, float, float, float] | Backdrop
Backend = Literal["auto", "software", "gl"]

DEFAULT_LIGHT = Light()


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
    samples: Literal[1, 4] = 1,
    backend: Backend = "auto",
    mujoco: tuple[mj.MjModel, mj.MjData] | None = None,
) -> Image:
    """Picture of a scene: colour, depth in metres and owner ids in one pass.

    Depth and ids are those of the nearest surface, see-through ones included; a shape with alpha 0 is not
    there at all. Lines take part in the colours only.

    Args:
        scene: what to draw. The software renderer keeps its arrays in it until `scene.revision` changes.
        positions: (n, 3) of the frames in the world; m.
        rotations: (n, 3, 3) or (n, 9) of the frames in the world.
        camera: from where, and on how many pixels.
        shadow: whether the sun throws shadows.
        light: sun, sky and ambient light; `UNLIT` shows plain colours.
        lines: drawn besides the scene's own.
        background: colour (0 to 1, with alpha if given) or gradient; None: the scene's background colour.
        samples: 4 smooths the edges of the colours (four times the work); depth and ids stay as with 1.
            "gl" smooths them as the model's `offsamples` says.
        backend: "software" needs no graphics library; "gl" is MuJoCo's own OpenGL renderer; "auto" takes "gl"
            where `mujoco` is given and a graphics card answers, else "software".
        mujoco: (MjModel, MjData) for "gl", whose bodies are the scene's frames.

    Raises:
        ValueError: frames of the wrong shape, or too few for the scene.
        RoboyardError: "gl" was asked for and cannot be had.
    """
    xpos, xmat = _frames(scene, positions, rotations)
    if backend not in ("auto", "software", "gl"):
        raise ValueError(f'backend must be "auto", "software" or "gl", got {backend!r}')
    if samples not in (1, 4):
        raise ValueError(f"samples must be 1 or 4, got {samples}")
    if not np.linalg.norm(light.direction) > 0:
        raise ValueError("light.direction is (0, 0, 0); point it from the scene towards the sun")
    all_lines = _joined_lines(scene.lines, lines)
    backdrop, fade = _backdrop(scene.background if background is None else background)
    if backend == "gl" or (backend == "auto" and mujoco is not None):
        from roboyard.rendering import opengl

        if backend == "gl" or opengl.has_hardware():
            return opengl.draw(
                mujoco, scene, camera, shadow=shadow, light=light, lines=all_lines, backdrop=backdrop
            )
    from roboyard.rendering import software

    return software.draw(
        scene, xpos, xmat, camera,
        shadow=shadow, light=light, lines=all_lines, backdrop=backdrop, fade=fade, samples=samples,
    )  # fmt: skip


def _frames(scene: RenderScene, positions: ArrayLike, rotations: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
    xpos = np.ascontiguousarray(positions, dtype=float)
    xmat = np.ascontiguousarray(rotations, dtype=float)
    if xpos.ndim != 2 or xpos.shape[1] != 3 or xmat.size != 9 * len(xpos):
        raise ValueError(
            f"frames must have shapes (n, 3) and (n, 3, 3), got {xpos.shape} and {np.shape(rotations)}"
        )
    needed = max((shape.frame for shape in scene.shapes), default=-1) + 1
    if needed > len(xpos):
        raise ValueError(f"the scene's shapes use {needed} frames, got {len(xpos)}")
    return xpos, xmat.reshape(-1, 3, 3)


def _joined_lines(first: DebugLines | None, second: DebugLines | None) -> DebugLines | None:
    if first is None or second is None:
        return second if first is None else first
    names = ("start", "end", "rgb", "width")
    return DebugLines(
        **{name: np.concatenate([getattr(first, name), getattr(second, name)]) for name in names}
    )


def _backdrop(background: Background) -> tuple[np.ndarray, tuple[float, float] | None]:
    """(2, 4) colours at the top and the bottom, and the depths where endless planes fade."""
    if isinstance(background, Backdrop):
        return np.array([(*background.top, 1.0), (*background.bottom, 1.0)]), background.fade
    color = (*background, 1.0)[:4]
    if len(background) not in (3, 4):
        raise ValueError(f"background must be a colour of 3 or 4 numbers or a Backdrop, got {background!r}")
    return np.array([color, color], dtype=float), None
