"""Light and backdrop of a picture."""

from __future__ import annotations

from dataclasses import dataclass

RGB = tuple[float, float, float]


@dataclass(frozen=True, kw_only=True, slots=True)
class Light:
    """One sun, a sky dome and an even ambient light; the defaults are made for pictures of robots.

    A surface of colour c facing n shows

    `c · (ambient + diffuse · color · ((1 - sky) · sun · max(n·l, 0) + sky · (1 + n_z) / 2)) + specular`,

    `sun` being `leak` in shadow and 1 in the light. With ambient 1, diffuse 0 and specular 0 a picture
    therefore shows every colour exactly as it was given.
    """

    direction: tuple[float, float, float] = (-0.35, -0.75, 1.1)
    """From the scene towards the sun; any length above zero."""
    color: RGB = (1.0, 1.0, 1.0)
    """Of the sun and the sky; 0 to 1"""
    ambient: float = 0.30
    diffuse: float = 0.85
    specular: float = 1.0
    """Multiplies each shape's own specular."""
    sky: float = 0.45
    """Share of the diffuse light that comes from the sky dome and knows no shadow."""
    leak: float = 0.0
    """Share of the sun that reaches what lies in its shadow; the software renderer's only, OpenGL's shadows
    are dark."""


UNLIT = Light(ambient=1.0, diffuse=0.0, specular=0.0)
"""Every colour as it was given."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Backdrop:
    """Vertical gradient behind the scene, into which endless floors fade."""

    top: RGB = (0.70, 0.74, 0.79)
    bottom: RGB = (0.93, 0.94, 0.95)
    fade: tuple[float, float] | None = (8.0, 40.0)
    """Depths (m) between which an endless plane dissolves into the backdrop; None: it never does."""


STUDIO = Backdrop()
"""Light grey, for pictures of robots."""
