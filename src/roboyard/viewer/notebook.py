"""The HTML of a viewer in a notebook."""

from __future__ import annotations

from html import escape

HEIGHT = 480
"""pixels of an embedded page"""


def frame_html(url: str, height: int = HEIGHT) -> str:
    """HTML that embeds the page at `url`."""
    address = escape(url, quote=True)
    return (
        f'<iframe src="{address}" width="100%" height="{height}" frameborder="0" '
        f'title="Roboyard viewer"></iframe><p><a href="{address}" target="_blank">{address}</a></p>'
    )
