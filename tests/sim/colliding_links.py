"""Which links of a world MuJoCo lets collide, from masks and exclusions in its arrays."""

from __future__ import annotations

from itertools import combinations, product
from typing import Any

LinkKey = tuple[int, int]
"""Id of a body and index of its link."""


def colliding_links(world: Any, model: Any) -> set[tuple[LinkKey, LinkKey]]:
    """Return the pairs of links whose shapes MuJoCo lets collide, by a model with the world's rows."""
    excluded = set(model.exclude_signature.tolist())
    links = [link for body in world.bodies for link in body.links]
    found: set[tuple[LinkKey, LinkKey]] = set()
    for a, b in combinations(links, 2):
        one, other = (int(link.body.mujoco_ids[link.index]) for link in (a, b))
        if (min(one, other) << 16) + max(one, other) in excluded:
            continue
        geoms = product(a.body.geom_rows[a.index], b.body.geom_rows[b.index])
        if any(_match(model.geom_contype, model.geom_conaffinity, *pair) for pair in geoms):
            assert _match(model.body_contype, model.body_conaffinity, one, other)
            found.add(((a.body.id, a.index), (b.body.id, b.index)))
    return found


def _match(contype: Any, conaffinity: Any, one: int, other: int) -> bool:
    return bool(contype[one] & conaffinity[other] or contype[other] & conaffinity[one])
