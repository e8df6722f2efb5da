"""The HTML of a world in a notebook: a picture and a table of its bodies."""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Callable, Sequence
from html import escape

from roboyard.rendering import Camera, Image, png_bytes
from roboyard.sim.body import Body
from roboyard.sim.queries.default_view import FOVY, viewpoint

PICTURE = (480, 320)
"""Width and height of the picture (pixels)."""
MOST_BODIES = 20
"""Largest number of rows in the table."""


def world_html(time: float, bodies: Sequence[Body], render: Callable[[Camera], Image]) -> str:
    """Return HTML with a picture of a world and a table of its bodies; needs no server.

    Args:
        time: simulated time (s).
        bodies: all bodies of the world.
        render: renders the world with a camera.
    """
    eye, target = viewpoint(bodies, PICTURE[0] / PICTURE[1])
    camera = Camera.look_at(eye, target, width=PICTURE[0], height=PICTURE[1], fovy=FOVY)
    picture = b64encode(png_bytes(render(camera))).decode()
    rows = [
        f"<tr><td>{body.id}</td><td>{escape(body.name)}</td><td>{len(body.links)}</td>"
        f"<td>{len(body.joint_names)}</td><td>{body.mass:.4g}</td></tr>"
        for body in bodies[:MOST_BODIES]
    ]
    if len(bodies) > MOST_BODIES:
        rows.append(f'<tr><td colspan="5">... and {len(bodies) - MOST_BODIES} more</td></tr>')
    return (
        f'<p>World at {time:.3f} s</p><img alt="the world" width="{PICTURE[0]}" '
        f'src="data:image/png;base64,{picture}"><table><tr><th>id</th><th>body</th><th>links</th>'
        f"<th>joints</th><th>kg</th></tr>{''.join(rows)}</table>"
    )
