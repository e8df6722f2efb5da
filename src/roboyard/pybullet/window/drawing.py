"""Conversion of debug lines, points and texts to a viewer's drawing."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import chain
from typing import TYPE_CHECKING

import numpy as np

from roboyard.pybullet.state.debug_items import Item, Line, Points, Text
from roboyard.transforms import multiply, rotate
from roboyard.viewer.scene.drawings import Drawing, SceneLines
from roboyard.viewer.scene.texts import SceneText

if TYPE_CHECKING:
    from roboyard.pybullet.state.bodies.body_records import BodyRecord
    from roboyard.pybullet.state.physics_scene import PhysicsScene

Parent = tuple[int, int] | None


def drawing_of(items: Iterable[Item], scene: PhysicsScene) -> Drawing:
    """Return the drawing of debug items; items whose parent was removed are skipped."""
    lines: dict[tuple[Parent, float], list[Line]] = {}
    drawn: list[SceneLines] = []
    texts: list[SceneText] = []
    for item in items:
        if isinstance(item, Line):
            key = (item.parent, item.width)
            group = lines.get(key)
            if group is None:
                lines[key] = [item]
            else:
                group.append(item)
        elif _is_removed(item.parent, scene):
            continue
        elif isinstance(item, Points):
            owner = _owner(item.parent, scene)
            drawn.append(
                SceneLines.dots(_placed(item.positions, item.parent, scene), item.rgb, item.size, owner)
            )
        elif isinstance(item, Text):
            texts.append(_text(item, scene))
    for (parent, width), group in lines.items():
        if not _is_removed(parent, scene):
            ends = _rows([end for line in group for end in (line.start, line.end)])
            placed = _placed(ends, parent, scene).reshape(-1, 2, 3)
            drawn.append(
                SceneLines(
                    start=placed[:, 0],
                    end=placed[:, 1],
                    rgb=_rows([line.rgb for line in group]),
                    width=width,
                    link=_owner(parent, scene),
                )
            )
    return Drawing(lines=drawn, texts=texts)


def _rows(triples: list[tuple[float, float, float]]) -> np.ndarray:
    """Return an (n, 3) array; several times faster than `np.array` for thousands of lines."""
    return np.fromiter(chain.from_iterable(triples), float, 3 * len(triples)).reshape(-1, 3)


def _text(item: Text, scene: PhysicsScene) -> SceneText:
    turn = item.orientation
    if item.parent is None:
        return SceneText(
            text=item.text, position=item.position, rgb=item.rgb, size=item.size, orientation=turn
        )
    if turn is not None:
        frame = _record(item.parent, scene).links[item.parent[1] + 1].frame
        x, y, z, w = (float(v) for v in multiply(frame.quaternion, turn))
        turn = (x, y, z, w)
    x, y, z = _placed(np.array([item.position]), item.parent, scene)[0].tolist()
    return SceneText(
        text=item.text,
        position=(x, y, z),
        rgb=item.rgb,
        size=item.size,
        orientation=turn,
        link=_owner(item.parent, scene),
    )


def _record(parent: tuple[int, int], scene: PhysicsScene) -> BodyRecord:
    return scene.bodies[parent[0]]


def _is_removed(parent: Parent, scene: PhysicsScene) -> bool:
    return parent is not None and scene.link(*parent) is None


def _owner(parent: Parent, scene: PhysicsScene) -> Parent:
    """Return the World's body id and link index for those of the script."""
    if parent is None:
        return None
    link = scene.link(*parent)
    assert link is not None
    return (link.body.id, link.index)


def _placed(points: np.ndarray, parent: Parent, scene: PhysicsScene) -> np.ndarray:
    """Return (k, 3) points of a link's inertial frame in its link frame (m)."""
    if parent is None:
        return points
    frame = _record(parent, scene).links[parent[1] + 1].frame
    return np.asarray(frame.position) + rotate(frame.quaternion, points)
