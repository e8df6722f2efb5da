"""Pictures of shapes without a colour, compared with PyBullet 3.2.7: they are white."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

SHAPE = '<{0}><geometry><box size="1 1 1"/></geometry></{0}>'
SDF = """<sdf version="1.6"><model name="m"><link name="l"><collision name="c">
<geometry><box><size>1 1 1</size></box></geometry></collision></link></model></sdf>"""
MJCF = '<mujoco><worldbody><body><geom type="box" size=".5 .5 .5"/></body></worldbody></mujoco>'


def _pixel(p: Any) -> list[int]:
    """Return the colour in the middle of a picture from above."""
    view = p.computeViewMatrix([0, 0, 3], [0, 0, 0], [0, 1, 0])
    lens = p.computeProjectionMatrixFOV(40, 1, 0.1, 10)
    image = p.getCameraImage(32, 32, view, lens, renderer=p.ER_TINY_RENDERER)
    return np.reshape(image[2], (32, 32, 4))[16, 16].tolist()


def record_default_colours(p: Any, folder: Path) -> list[list[int]]:
    """Colours of a box that is made in several ways, none of which names one."""
    urdf = '<robot name="r"><link name="l">{}</link></robot>'
    texts = {
        "shape.urdf": urdf.format(SHAPE.format("collision")),
        "seen.urdf": urdf.format(SHAPE.format("visual") + SHAPE.format("collision")),
        "box.sdf": SDF,
        "box.xml": MJCF,
    }
    for name, text in texts.items():
        (folder / name).write_text(text)
    box = [0.5] * 3
    ways = (
        lambda: p.createMultiBody(1, p.createCollisionShape(p.GEOM_BOX, halfExtents=box)),
        lambda: p.createMultiBody(0, -1, p.createVisualShape(p.GEOM_BOX, halfExtents=box)),
        lambda: p.loadURDF(str(folder / "shape.urdf")),
        lambda: p.loadURDF(str(folder / "seen.urdf")),
        lambda: p.loadSDF(str(folder / "box.sdf")),
        lambda: p.loadMJCF(str(folder / "box.xml")),
    )
    found = []
    for way in ways:
        way()
        found.append(_pixel(p))
        p.resetSimulation()
    return found


def test_shapes_without_a_colour_are_white(agrees: Callable[..., None]) -> None:
    agrees(record_default_colours)
