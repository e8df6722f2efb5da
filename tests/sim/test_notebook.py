"""The HTML of a world in a notebook."""

from __future__ import annotations

import base64
import io
import re

import numpy as np
from sim_robots import pendulum

from roboyard.sim import World


def picture_in(html: str) -> np.ndarray:
    from PIL import Image

    found = re.search(r"data:image/png;base64,([A-Za-z0-9+/=]+)", html)
    assert found is not None
    return np.asarray(Image.open(io.BytesIO(base64.b64decode(found.group(1)))).convert("RGB"))


def test_the_html_of_a_world_holds_a_picture_and_a_table_of_bodies() -> None:
    world = World()
    world.add_plane()
    world.add_urdf(pendulum(), fixed_base=True, position=(0, 0, 1), name="<b>swing</b>")
    box = world.add_box((0.5, 0.5, 0.5), position=(0, 0, 1), rgba=(1, 0, 0, 1))
    html = world._repr_html_()
    assert "World at 0.000 s" in html
    assert "&lt;b&gt;swing&lt;/b&gt;</td><td>2</td><td>1</td>" in html
    assert "<b>swing" not in html
    picture = picture_in(html).astype(int)
    red = (picture[..., 0] > picture[..., 1] + 80) & (picture[..., 0] > picture[..., 2] + 80)
    assert red.mean() > 0.02
    world.remove(box)
    after = picture_in(world._repr_html_()).astype(int)
    assert not ((after[..., 0] > after[..., 1] + 80) & (after[..., 0] > after[..., 2] + 80)).any()


def test_the_html_of_an_empty_and_of_a_crowded_world() -> None:
    world = World()
    assert picture_in(world._repr_html_()).shape == (320, 480, 3)
    for k in range(23):
        world.add_sphere(0.1, position=(k * 0.3, 0, 1))
    html = world._repr_html_()
    assert html.count("<tr>") == 1 + 20 + 1
    assert "and 3 more" in html
