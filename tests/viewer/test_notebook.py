"""The HTML of a viewer in a notebook."""

from __future__ import annotations

from roboyard.viewer.notebook import frame_html


def test_the_address_is_escaped_in_html() -> None:
    assert '"><script>' not in frame_html('http://x"><script>')
