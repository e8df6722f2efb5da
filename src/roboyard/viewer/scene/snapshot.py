"""One moment of a world, taken at the end of a step and safe to read from any thread."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from roboyard.rendering.scene import RenderShape

if TYPE_CHECKING:
    from roboyard.sim import World

Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Links:
    """Every link of a world: where it is in the page's scene, and its row in MuJoCo's arrays."""

    paths: Mapping[tuple[int, int], str]
    """Body id and link index to the path of the link's node."""
    rows: Mapping[str, int]
    by_owner: Mapping[tuple[int, int], int]
    """Body id and link index to the row."""
    fixed: frozenset[tuple[int, int]] = frozenset()
    """Body id and link index of what can never move."""


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Snapshot:
    """What a page needs to show one moment. Nothing in it changes afterwards, but for `data`."""

    model: Any
    data: Any
    """The world's own; only for `Snapshot.latest_qpos`."""
    qpos: Array
    shapes: tuple[RenderShape, ...]
    links: Links
    time: float

    def latest_qpos(self) -> Array:
        """A copy of where the world is now; taken during a step it may be half of this step."""
        return self.data.qpos.copy()


def take(world: World, model: Any, links: Links) -> Snapshot:
    """The world as it is, with the `world.model` that `links` are of; for the thread that steps the world."""
    shapes = tuple(world.render_scene().shapes)
    data = world.data
    return Snapshot(model=model, data=data, qpos=data.qpos.copy(), shapes=shapes, links=links, time=data.time)


def gather_links(world: World) -> Links:
    """All links with unique paths `/<body>/<link>`."""
    welded = world.model.body_weldid  # first: handing the model out may number the bodies anew
    paths: dict[tuple[int, int], str] = {}
    rows: dict[str, int] = {}
    for body in world.bodies:
        for link in body.links:
            path = wanted = f"/{node_name(body.name)}/{node_name(link.name)}"
            k = 1
            while path in rows:
                k += 1
                path = f"{wanted} ({k})"
            paths[(body.id, link.index)] = path
            rows[path] = int(body.mujoco_ids[link.index])
    by_owner = {owner: rows[path] for owner, path in paths.items()}
    fixed = frozenset(owner for owner, row in by_owner.items() if welded[row] == 0)
    return Links(paths=paths, rows=rows, by_owner=by_owner, fixed=fixed)


def node_name(name: str) -> str:
    """A name as one step of a path in the scene."""
    return name.replace("/", "∕") or "unnamed"


class PoseSender:
    """Works out link poses from joint positions with arrays of its own, so that it may run in any thread."""

    def __init__(self) -> None:
        self._model: Any = None
        self._data: Any = None

    def poses(self, model: Any, qpos: Array) -> tuple[Array, Array]:
        """(nbody, 3) positions (m) and (nbody, 4) quaternions (w, x, y, z) of all MuJoCo bodies."""
        import mujoco

        if model is not self._model:
            self._model, self._data = model, mujoco.MjData(model)
        self._data.qpos[:] = qpos
        mujoco.mj_kinematics(model, self._data)
        return self._data.xpos, self._data.xquat
