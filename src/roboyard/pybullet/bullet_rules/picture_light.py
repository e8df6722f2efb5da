"""Lighting and colours of camera images, and shapes with alpha < 1 drawn opaque, as in PyBullet."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from roboyard._records import dataclass, replace
from roboyard.pybullet.face.arguments import number, vector3_or, whole

if TYPE_CHECKING:
    from roboyard.description.model import RGBA
    from roboyard.rendering import Light
    from roboyard.rendering.scene import RenderScene

Vector = Sequence[float]
_SHADOW_LIGHT = 0.8
"""Fraction of the light that PyBullet leaves in shadows."""


@dataclass(kw_only=True, slots=True)
class PictureLight:
    """The light arguments of getCameraImage; PyBullet keeps them from image to image."""

    direction: tuple[float, float, float] = (-50.0, 30.0, 100.0)
    """Direction from the scene towards the light."""
    color: tuple[float, float, float] = (1.0, 1.0, 1.0)
    ambient: float = 0.6
    diffuse: float = 0.35
    specular: float = 0.05
    shadow: bool = False

    def update(
        self,
        direction: Vector | None,
        color: Vector | None,
        shadow: int,
        coefficients: tuple[float, float, float],
    ) -> None:
        """Set the arguments that were given (neither None nor negative, nor of another length than three).

        Args:
            direction: from the scene towards the light.
            color: red, green, blue (0 to 1).
            shadow: 1 draws shadows, 0 does not, negative keeps the setting.
            coefficients: ambient, diffuse, specular (0 to 1).
        """
        if direction is not None:
            self.direction = vector3_or(direction, self.direction)
        if color is not None:
            self.color = vector3_or(color, self.color)
        if whole(shadow) >= 0:
            self.shadow = shadow > 0
        ambient, diffuse, specular = (number(value) for value in coefficients)
        self.ambient = ambient if ambient >= 0 else self.ambient
        self.diffuse = diffuse if diffuse >= 0 else self.diffuse
        self.specular = specular if specular >= 0 else self.specular

    def to_light(self) -> Light:
        """Return the light for `roboyard.rendering`.

        Source:
            Bullet, TinyRenderer.cpp, Shader::fragment; its specular term does not depend on the camera.
        """
        from roboyard.rendering import Light

        return Light(
            direction=self.direction,
            color=self.color,
            ambient=self.ambient,
            diffuse=self.diffuse,
            specular=0.0,
            sky=0.0,
            leak=_SHADOW_LIGHT,
            gloss=self.specular,
            rounds_down=True,
        )


class SolidScene:
    """A copy of a scene with the colours of TinyRenderer, cached until the scene changes."""

    def __init__(self) -> None:
        """Start without a cached scene."""
        self._made: tuple[RenderScene, int, RenderScene] | None = None

    def of(self, scene: RenderScene) -> RenderScene:
        """Return the scene with partly transparent shapes opaque, and colours cut to 8 bits."""
        made = self._made
        if made is not None and made[0] is scene and made[1] == scene.revision:
            return made[2]
        colors = [_solid(shape.rgba) for shape in scene.shapes]
        solid = scene
        if any(color != shape.rgba for color, shape in zip(colors, scene.shapes, strict=True)):
            pairs = zip(scene.shapes, colors, strict=True)
            shapes = tuple(replace(shape, rgba=color) for shape, color in pairs)
            solid = replace(scene, shapes=shapes, extra={})
        self._made = (scene, scene.revision, solid)
        return solid


def _solid(rgba: RGBA) -> RGBA:
    red, green, blue = (min(max(int(255.0 * part + 1e-9), 0), 255) / 255.0 for part in rgba[:3])
    return red, green, blue, 1.0 if rgba[3] > 0.0 else rgba[3]
