"""How getCameraImage lights its pictures, and what it makes of see-through shapes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import sqrt
from typing import TYPE_CHECKING

from roboyard.pybullet.face.arguments import number, vector3, whole

if TYPE_CHECKING:
    from roboyard.rendering import Light
    from roboyard.rendering.scene import RenderScene

Vector = Sequence[float]
_IN_SHADOW = 0.8
"""Share of PyBullet's light that reaches what lies in shadow."""


@dataclass(kw_only=True, slots=True)
class PictureLight:
    """What the arguments of getCameraImage said last; PyBullet keeps it from picture to picture."""

    direction: tuple[float, float, float] = (-50.0, 30.0, 100.0)
    """From the scene towards the light."""
    color: tuple[float, float, float] = (1.0, 1.0, 1.0)
    ambient: float = 0.6
    diffuse: float = 0.35
    specular: float = 0.05
    shadow: bool = False

    def take(
        self,
        direction: Vector | None,
        color: Vector | None,
        shadow: int,
        coefficients: tuple[float, float, float],
    ) -> None:
        """Take over the arguments that were given (not None, not negative)."""
        if direction is not None:
            self.direction = vector3(direction, "Error parsing lightDirection")
        if color is not None:
            self.color = vector3(color, "Error parsing lightColor")
        if whole(shadow) >= 0:
            self.shadow = shadow > 0
        ambient, diffuse, specular = (number(value) for value in coefficients)
        self.ambient = ambient if ambient >= 0 else self.ambient
        self.diffuse = diffuse if diffuse >= 0 else self.diffuse
        self.specular = specular if specular >= 0 else self.specular

    def as_sun(self) -> Light:
        """The light for `roboyard.rendering`.

        PyBullet's gloss does not depend on where the camera is: a surface of normal n in light from l shows
        specular · max(2 (n·l) n_z - l_z, 0)². On the level that is specular · l_z², on walls next to nothing:
        the share of the sky, which lights level surfaces most, stands for it.
        """
        from roboyard.rendering import Light

        x, y, z = self.direction
        length = sqrt(x * x + y * y + z * z)
        gloss = self.specular * (max(z, 0.0) / length) ** 2 if length > 0 else 0.0
        total = self.diffuse + gloss
        return Light(
            direction=self.direction,
            color=self.color,
            ambient=self.ambient,
            diffuse=total,
            specular=0.0,
            sky=gloss / total if total > 0 else 0.0,
            leak=_IN_SHADOW,
        )


class SolidScene:
    """A scene whose see-through shapes are solid, kept until the scene changes."""

    def __init__(self) -> None:
        self._made: tuple[RenderScene, int, RenderScene] | None = None

    def of(self, scene: RenderScene) -> RenderScene:
        """The scene itself where all its shapes are solid or not there at all."""
        made = self._made
        if made is not None and made[0] is scene and made[1] == scene.revision:
            return made[2]
        solid = scene
        if any(0.0 < shape.rgba[3] < 1.0 for shape in scene.shapes):
            shapes = tuple(
                replace(shape, rgba=(*shape.rgba[:3], 1.0)) if 0.0 < shape.rgba[3] < 1.0 else shape
                for shape in scene.shapes
            )
            solid = replace(scene, shapes=shapes, extra={})
        self._made = (scene, scene.revision, solid)
        return solid
