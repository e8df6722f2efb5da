"""How viewers and worlds show themselves in a notebook."""

from __future__ import annotations

from base64 import b64encode
from html import escape
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from roboyard.sim import World

HEIGHT = 480
"""pixels of an embedded page"""
PICTURE = (480, 320)
"""Width and height of a world's picture; pixels"""
MOST_BODIES = 20


def frame_html(url: str, height: int = HEIGHT) -> str:
    """HTML that embeds the page at `url`."""
    address = escape(url, quote=True)
    return (
        f'<iframe src="{address}" width="100%" height="{height}" frameborder="0" '
        f'title="Roboyard viewer"></iframe><p><a href="{address}" target="_blank">{address}</a></p>'
    )


def world_html(world: World) -> str:
    """HTML with a picture of a world and a table of its bodies; needs no server and no extra."""
    from roboyard.rendering import Camera, png_bytes
    from roboyard.viewer.page.light import FOVY, viewpoint

    eye, target = viewpoint(world)
    camera = Camera.look_at(eye, target, width=PICTURE[0], height=PICTURE[1], fovy=FOVY)
    picture = b64encode(png_bytes(world.render(camera))).decode()
    bodies = world.bodies
    rows = [
        f"<tr><td>{body.id}</td><td>{escape(body.name)}</td><td>{len(body.links)}</td>"
        f"<td>{len(body.joint_names)}</td><td>{body.mass:.4g}</td></tr>"
        for body in bodies[:MOST_BODIES]
    ]
    if len(bodies) > MOST_BODIES:
        rows.append(f'<tr><td colspan="5">... and {len(bodies) - MOST_BODIES} more</td></tr>')
    return (
        f'<p>World at {world.time:.3f} s</p><img alt="the world" width="{PICTURE[0]}" '
        f'src="data:image/png;base64,{picture}"><table><tr><th>id</th><th>body</th><th>links</th>'
        f"<th>joints</th><th>kg</th></tr>{''.join(rows)}</table>"
    )
