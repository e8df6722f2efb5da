"""The HTML of a viewer in a notebook."""

from __future__ import annotations

from roboyard.viewer.notebook import frame_html


def test_an_address_cannot_break_out_of_its_frame() -> None:
    assert '"><script>' not in frame_html('http://x"><script>')
