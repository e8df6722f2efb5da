"""`Snapshot`: the state of a world at the end of a step, readable from any thread."""

from __future__ import annotations

import itertools
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from roboyard._arrays import NDArray
from roboyard.rendering.scene import RenderShape
from roboyard.transforms import matrix_from_quaternion

if TYPE_CHECKING:
    from roboyard.sim import World
    from roboyard.sim.body import Body

Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Links:
    """Every link of a world: its node in the page's scene and its row in MuJoCo's arrays."""

    paths: Mapping[tuple[int, int], str]
    """Body id and link index to the path of the link's node."""
    rows: Mapping[str, int]
    """Path of the node to the row."""
    by_owner: Mapping[tuple[int, int], int]
    """Body id and link index to the row."""
    fixed: frozenset[tuple[int, int]] = frozenset()
    """Body id and link index of links that are fixed to the world."""


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Snapshot:
    """The state that a page shows; immutable except for `data`."""

    model: Any
    """The compiled `mujoco.MjModel`."""
    data: Any
    """The world's own `mujoco.MjData`; only for `Snapshot.now`."""
    qpos: Array
    """(nq,) joint positions (rad or m; free joints: position and quaternion w, x, y, z)."""
    shapes: tuple[RenderShape, ...]
    """All shapes of the world."""
    links: Links
    """All links of the world."""
    time: float
    """Simulated time (s)."""
    forces: Array | None = None
    """(k, 2, 3) start and end of the arrows of contact forces, world frame (m); None: they are not shown."""
    pull: Array | None = None
    """(1, 2, 3) the grabbed point of a body and the mouse, world frame (m); None: nothing is grabbed."""
    poses: tuple[Array, Array] | None = None
    """(nbody, 3) positions (m) and (nbody, 4) quaternions w, x, y, z of all links, where there are links that
    the model does not have; None: as `qpos` says."""

    def now(self) -> Snapshot:
        """Return the snapshot with the present joint positions; during a step they may be partly updated."""
        return self if self.poses is not None else replace(self, qpos=self.data.qpos.copy())


def take(
    world: World, model: Any, links: Links, *, forces: Array | None = None, pull: Array | None = None
) -> Snapshot:
    """Return the current state of a world; call it from the simulation thread.

    `model` is `world.model` and `links` were collected from it; `forces` (k, 2, 3) and `pull`
    (1, 2, 3) are arrows to draw (m).
    """
    shapes = tuple(world.render_scene().shapes)
    data = world.data
    return Snapshot(
        model=model,
        data=data,
        qpos=data.qpos.copy(),
        shapes=shapes,
        links=links,
        time=data.time,
        forces=forces,
        pull=pull,
    )


def corners_of(snapshot: Snapshot, positions: Array, quaternions: Array) -> Array:
    """Return (n, 3) corners of boxes around all finite shapes, in the world frame (m).

    Args:
        snapshot: the shapes.
        positions: (nbody, 3) positions of all bodies (m).
        quaternions: (nbody, 4) their orientations w, x, y, z.
    """
    found = []
    for shape in snapshot.shapes:
        row = snapshot.links.by_owner.get(shape.owner)
        if row is None or shape.infinite or not len(shape.mesh.vertices):
            continue
        scaled = shape.mesh.vertices * np.asarray(shape.scale)
        box = np.stack([scaled.min(axis=0), scaled.max(axis=0)])
        corners = np.array(list(itertools.product(*box.T)))
        local = corners @ np.asarray(shape.rotation, dtype=float).T + np.asarray(shape.position, dtype=float)
        w, x, y, z = quaternions[row].tolist()
        found.append(local @ matrix_from_quaternion((x, y, z, w)).T + positions[row])
    return np.concatenate(found) if found else np.zeros((0, 3))


def gather_links(world: World) -> Links:
    """Return all links with unique paths `/<body>/<link>`."""
    welded = world.model.body_weldid  # first: reading the model may renumber the bodies
    paths = unique_paths(world.bodies)
    by_owner = {(b.id, link.index): int(b.mujoco_ids[link.index]) for b in world.bodies for link in b.links}
    rows = {path: by_owner[owner] for owner, path in paths.items()}
    fixed = frozenset(owner for owner, row in by_owner.items() if welded[row] == 0)
    return Links(paths=paths, rows=rows, by_owner=by_owner, fixed=fixed)


def unique_paths(bodies: Iterable[Body], taken: Collection[str] = ()) -> dict[tuple[int, int], str]:
    """Return body id and link index to the path of each link's node, `/<body>/<link>`, none of them taken."""
    paths: dict[tuple[int, int], str] = {}
    used = set(taken)
    for body in bodies:
        for link in body.links:
            path = base = f"/{node_name(body.name)}/{node_name(link.name)}"
            k = 1
            while path in used:
                k += 1
                path = f"{base} ({k})"
            paths[(body.id, link.index)] = path
            used.add(path)
    return paths


def node_name(name: str) -> str:
    """Return a name as one element of a path in the scene."""
    return name.replace("/", "∕") or "unnamed"


class PoseSender:
    """Computes link poses from joint positions in its own `MjData`, in any thread."""

    def __init__(self) -> None:
        self._model: Any = None
        self._data: Any = None

    def poses(self, model: Any, qpos: Array) -> tuple[Array, Array]:
        """Return (nbody, 3) positions (m) and (nbody, 4) quaternions w, x, y, z of all bodies."""
        from roboyard._mujoco import mujoco

        if model is not self._model:
            self._model, self._data = model, mujoco.MjData(model)
        self._data.qpos[:] = qpos
        mujoco.mj_kinematics(model, self._data)
        return self._data.xpos, self._data.xquat
