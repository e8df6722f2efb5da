"""Differences of what cameras see: colours of bodies, lights, and poses of the cameras.

Physics are the same; `info`, states and rewards do not depend on them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from roboyard.envs.env_arrays import EnvArrays
from roboyard.envs.random_rows import RandomRows, Rows
from roboyard.envs.randomization.declared import Draw, Randomization, Range, check_range
from roboyard.errors import ConfigError, unknown_name
from roboyard.rendering.light import Light
from roboyard.rendering.renderer import DEFAULT_LIGHT
from roboyard.transforms import quaternion_from_rpy

RGB = tuple[float, float, float]


@dataclass(frozen=True)
class Color(Randomization):
    """Colours of a body's shapes; textures and colours of meshes are tinted with them."""

    body: str | None = None
    """Body by the task's name: one colour for all its links. None: every body of the world, floors and tables
    included, each in a colour of its own."""
    low: RGB = (0.1, 0.1, 0.1)
    """Least red, green, blue (0 to 1)."""
    high: RGB = (0.95, 0.95, 0.95)
    """Largest red, green, blue (0 to 1)."""
    share: float = 1.0
    """Part of the drawn colour, the rest being the shape's own; 1 replaces it."""
    links: tuple[str, ...] = ()
    """Links of the body; all by default."""

    def bind(self, env: EnvArrays) -> Draw:
        """Return the function that draws colours."""
        for name, bounds in zip(("red", "green", "blue"), zip(self.low, self.high, strict=True), strict=True):
            check_range(f"Color ({name})", bounds, 0.0, 1.0)
        if not 0.0 <= self.share <= 1.0:
            raise ConfigError(f"Color.share must be from 0 to 1, got {self.share}")
        looks = env.appearance
        if self.body is None:
            if self.links:
                raise ConfigError(f"Color.links needs a body, got {self.links}")
            groups = [np.flatnonzero(looks.owners[:, 0] == body) for body in np.unique(looks.owners[:, 0])]
        else:
            body = env.body(self.body).body
            indices = [body.link(name).index for name in self.links] or [link.index for link in body.links]
            groups = [np.flatnonzero((looks.owners[:, 0] == body.id) & np.isin(looks.owners[:, 1], indices))]
        colors, own = looks.colors, looks.own_colors

        def draw(rows: Rows, random: RandomRows) -> None:
            drawn = random.uniform(np.tile(self.low, (len(groups), 1)), np.tile(self.high, (len(groups), 1)))
            for k, shapes in enumerate(groups):
                mixed = self.share * drawn[:, None, k] + (1.0 - self.share) * own[None, shapes]
                colors[rows[:, None], shapes] = mixed

        return draw


@dataclass(frozen=True)
class Lighting(Randomization):
    """Direction, strength and colour of the sun and the ambient light."""

    elevation: Range = (0.35, 1.4)
    """Angle of the sun above the horizon (rad)."""
    ambient: Range = (0.15, 0.45)
    """Intensity of the ambient light."""
    diffuse: Range = (0.55, 1.0)
    """Intensity of the sun and the sky together."""
    tint: float = 0.15
    """Largest part of a colour that the sun lacks."""

    def bind(self, env: EnvArrays) -> Draw:
        """Return the function that draws lights."""
        check_range("Lighting.elevation", self.elevation, 0.05, np.pi / 2)
        check_range("Lighting.ambient", self.ambient, 0.0)
        check_range("Lighting.diffuse", self.diffuse, 0.0)
        if not 0.0 <= self.tint <= 1.0:
            raise ConfigError(f"Lighting.tint must be from 0 to 1, got {self.tint}")
        looks = env.appearance
        lights = [DEFAULT_LIGHT] * env.n
        looks.lights = lights

        def draw(rows: Rows, random: RandomRows) -> None:
            azimuth, height = random.uniform(-np.pi, np.pi), random.uniform(*self.elevation)
            ambient, diffuse = random.uniform(*self.ambient), random.uniform(*self.diffuse)
            color = 1.0 - random.uniform(0.0, self.tint, size=3)
            for k, row in enumerate(rows):
                flat = np.cos(height[k])
                lights[row] = Light(
                    direction=(
                        float(flat * np.cos(azimuth[k])),
                        float(flat * np.sin(azimuth[k])),
                        float(np.sin(height[k])),
                    ),
                    color=(float(color[k, 0]), float(color[k, 1]), float(color[k, 2])),
                    ambient=float(ambient[k]),
                    diffuse=float(diffuse[k]),
                )

        return draw


@dataclass(frozen=True)
class CameraPose(Randomization):
    """Cameras a little away from where they are mounted."""

    camera: str | None = None
    """Link with the camera, or "view" for the task's view of a robot without cameras; None: each camera."""
    position: float = 0.02
    """Largest shift along each axis of the camera (m)."""
    angle: float = 0.05
    """Largest roll, pitch and yaw in the camera's own frame (rad)."""

    def bind(self, env: EnvArrays) -> Draw:
        """Return the function that draws poses of cameras."""
        if not (0.0 <= self.position < np.inf and 0.0 <= self.angle <= np.pi):
            raise ConfigError(
                f"CameraPose: position must be at least 0 m and angle from 0 to pi rad, got {self.position} "
                f"and {self.angle}"
            )
        looks = env.appearance
        known = looks.camera_names
        if self.camera is not None and self.camera not in known:
            raise ConfigError(f"CameraPose: {unknown_name('camera', self.camera, known)}")
        names = known if self.camera is None else (self.camera,)
        for name in names:
            looks.camera_shifts[name] = np.zeros((env.n, 3))
            looks.camera_turns[name] = np.tile([0.0, 0.0, 0.0, 1.0], (env.n, 1))

        def draw(rows: Rows, random: RandomRows) -> None:
            for name in names:
                looks.camera_shifts[name][rows] = random.uniform(-self.position, self.position, size=3)
                angles = random.uniform(-self.angle, self.angle, size=3)
                looks.camera_turns[name][rows] = quaternion_from_rpy(angles)

        return draw
