"""Light and fog of a page, approximating `roboyard.rendering`."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from roboyard.rendering.light import Light
from roboyard.transforms import Array, quaternion_from_axis_angle, to_wxyz

SUN_GAIN, SKY_GAIN, GROUND_GAIN = 2.2, 0.66, 0.5
"""Factors on the light of `roboyard.rendering`, which adds display colours instead of linear light; chosen so
that matte spheres of four shades of grey and a floor differ least from its pictures."""
FILL_INTENSITY, FILL_DIRECTION = 0.25, (1.0, -0.6, 0.6)
"""Light without shadow from the side of the first camera, so that dark parts show highlights."""
SUN_DISTANCE = 100.0
"""Distance of the sun from the origin (m)."""
HAZE = (20.0, 60.0)
"""Distances at which the fog begins and at which it hides everything (m)."""


class PageLight:
    """Light and background of a server's pages."""

    def __init__(self, server: Any, sun: Any) -> None:
        """Control the light handle `sun` of a `viser.ViserServer`."""
        self._server, self._sun = server, sun

    def set_shadows(self, shadows: bool) -> None:
        """Switch the shadows of bodies on or off."""
        self._sun.cast_shadow = shadows

    def set_direction(self, direction: Sequence[float]) -> None:
        """Set the direction from the scene to the sun, (3,) in the world frame, of any length."""
        self._sun.position = _sun_position(direction)

    def set_background(self, rgb: Sequence[float]) -> None:
        """Set the colour of the background and the fog, (3,) RGB from 0 to 1."""
        color = np.round(255.0 * np.clip(rgb, 0.0, 1.0)).astype(np.uint8)
        r, g, b = color.tolist()
        self._server.scene.set_background_image(np.full((2, 2, 3), color, dtype=np.uint8), format="png")
        self._server.scene.configure_fog(*HAZE, color=(r, g, b))


def set_light(server: Any) -> PageLight:
    """Add a sun with shadows, a sky and fog to a `viser.ViserServer`; returns their controls."""
    light = Light()
    scene = server.scene
    scene.configure_default_lights(enabled=False)
    scene.configure_environment_map(None)
    # three.js computes albedo · intensity / π in linear light, where white surfaces need darker shading
    sun = SUN_GAIN * math.pi * light.diffuse * (1.0 - light.sky)
    above = SKY_GAIN * math.pi * (light.ambient + light.diffuse * light.sky)
    below = light.ambient / (light.ambient + light.diffuse * light.sky)
    handle = scene.add_light_directional(
        "/lights/sun", intensity=sun, cast_shadow=True, position=_sun_position(light.direction)
    )
    scene.add_light_directional(
        "/lights/fill", intensity=FILL_INTENSITY, position=_sun_position(FILL_DIRECTION)
    )
    ground = round(255 * GROUND_GAIN * below)
    scene.add_light_hemisphere(
        "/lights/sky",
        intensity=above,
        ground_color=(ground, ground, ground),
        wxyz=_turn_y_to((0.0, 0.0, 1.0)),
    )
    scene.configure_fog(*HAZE, color=(255, 255, 255))
    return PageLight(server, handle)


def _sun_position(direction: Sequence[float]) -> tuple[float, float, float]:
    """Return a far point (m) towards the sun: a page's light shines from its position to the origin."""
    x, y, z = (SUN_DISTANCE * np.asarray(direction, dtype=float) / np.linalg.norm(direction)).tolist()
    return x, y, z


def _turn_y_to(direction: Sequence[float]) -> Array:
    """Return the quaternion (w, x, y, z) from +y, the direction of lights in three.js, to `direction`."""
    target = np.asarray(direction, dtype=float) / np.linalg.norm(direction)
    axis = np.cross((0.0, 1.0, 0.0), target)
    sine = float(np.linalg.norm(axis))
    if sine < 1e-9:
        return to_wxyz(quaternion_from_axis_angle((1.0, 0.0, 0.0), 0.0 if target[1] > 0 else math.pi))
    return to_wxyz(quaternion_from_axis_angle(axis / sine, math.atan2(sine, float(target[1]))))
