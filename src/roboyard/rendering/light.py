"""Light and backdrop of a picture."""

from __future__ import annotations

from roboyard._records import dataclass

RGB = tuple[float, float, float]


@dataclass(frozen=True, kw_only=True, slots=True)
class Light:
    """A sun, a sky dome and a uniform ambient light; the defaults suit pictures of robots.

    A surface of colour c and normal n has the colour

    `c · (ambient + diffuse · color · ((1 - sky) · sun · max(n·l, 0) + sky · (1 + n_z) / 2)) + specular`,

    where `sun` is `leak` in shadow and 1 elsewhere. With ambient 1, diffuse 0 and specular 0 every colour
    is therefore rendered unchanged. `gloss` adds `c · color · gloss · sun · max(2 n·l n_z - l_z, 0)²`.
    """

    direction: tuple[float, float, float] = (-0.35, -0.75, 1.1)
    """Direction from the scene to the sun in the world frame; any length above zero."""
    color: RGB = (1.0, 1.0, 1.0)
    """Colour of the sun and the sky, each channel 0 to 1."""
    ambient: float = 0.30
    """Intensity of the ambient light."""
    diffuse: float = 0.85
    """Intensity of the sun and the sky together."""
    specular: float = 1.0
    """Factor on each shape's own specular reflection."""
    sky: float = 0.45
    """Fraction of the diffuse light that comes from the sky dome, which casts no shadows."""
    leak: float = 0.0
    """Fraction of the sunlight that reaches shadowed surfaces; used by the software renderer only."""
    gloss: float = 0.0
    """Intensity of the sun mirrored upwards, seen from anywhere; used by the software renderer only."""
    rounds_down: bool = False
    """Whether levels of opaque colours are rounded down; used by the software renderer only."""


UNLIT = Light(ambient=1.0, diffuse=0.0, specular=0.0)
"""Light that renders every colour unchanged."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Backdrop:
    """Vertical gradient behind the scene, into which infinite floors fade."""

    top: RGB = (0.70, 0.74, 0.79)
    """Colour of the top row, each channel 0 to 1."""
    bottom: RGB = (0.93, 0.94, 0.95)
    """Colour of the bottom row, each channel 0 to 1."""
    fade: tuple[float, float] | None = (8.0, 40.0)
    """Depths (m) between which an infinite plane fades into the backdrop; None: it does not fade."""


STUDIO = Backdrop()
"""Light grey, for pictures of robots."""
