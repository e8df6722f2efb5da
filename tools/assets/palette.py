"""Colours shared by the bundled robots."""

from __future__ import annotations

from assets.files import Rgb

SHELL: Rgb = (0.93, 0.94, 0.95)
GRAPHITE: Rgb = (0.17, 0.18, 0.21)
RUBBER: Rgb = (0.08, 0.08, 0.09)
METAL: Rgb = (0.62, 0.65, 0.69)
TEAL: Rgb = (0.05, 0.55, 0.58)
AMBER: Rgb = (0.98, 0.62, 0.12)
GLASS: Rgb = (0.05, 0.06, 0.09)
GLOW: Rgb = (0.35, 0.9, 0.95)
RED: Rgb = (0.85, 0.22, 0.18)
WOOD: Rgb = (0.75, 0.56, 0.36)
BLUE: Rgb = (0.24, 0.46, 0.78)

COLORS: dict[str, Rgb] = {
    name.lower(): value
    for name, value in dict(globals()).items()
    if name.isupper() and isinstance(value, tuple)
}


def pick(*names: str) -> dict[str, Rgb]:
    """Return the named colours for the <material> list of a URDF."""
    return {name: COLORS[name] for name in names}
