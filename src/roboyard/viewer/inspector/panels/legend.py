"""Legend of the parts that a robot was understood to have."""

from __future__ import annotations

from html import escape

from roboyard.description.semantic import SemanticDescription
from roboyard.morphology.part_colours import RGBA, parts_of


def legend(semantic: SemanticDescription | None) -> str:
    """Return HTML: kind and base, and each part with its colour; its joints are shown on hover."""
    if semantic is None:
        return "<p>The robot has no description.</p>"
    rows = [
        f'<div title="{escape(", ".join(part.joints), quote=True)}"><span style="display:inline-block;'
        f'width:0.8em;height:0.8em;margin-right:0.5em;background:{_css(part.rgba)}"></span>{escape(part.name)}</div>'
        for part in parts_of(semantic)
    ]
    kind = escape(f"{semantic.kind}, base: {semantic.base}".replace("_", " "))
    return f'<div style="padding:0 1em;font-size:0.85em"><b>{kind}</b>{"".join(rows)}</div>'


def _css(rgba: RGBA) -> str:
    red, green, blue = (round(255 * value) for value in rgba[:3])
    return f"rgb({red},{green},{blue})"
