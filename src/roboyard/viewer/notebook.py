"""The HTML of a viewer in a notebook."""

from __future__ import annotations

from html import escape

HEIGHT = 480
"""Height of an embedded page (pixels)."""


def frame_html(url: str, height: int = HEIGHT) -> str:
    """Return HTML that embeds the page at `url`, `height` pixels high."""
    address = escape(url, quote=True)
    return (
        f'<iframe src="{address}" width="100%" height="{height}" frameborder="0" '
        f'title="Roboyard viewer"></iframe><p><a href="{address}" target="_blank">{address}</a></p>'
    )
