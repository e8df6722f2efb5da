"""The rows of bodies of one simple shape at the centre of mass, whose numbers are written all at once."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from roboyard._mujoco import mujoco
from roboyard._records import dataclass
from roboyard.sim.pool.analytic_templates import Numbers

_SPHERE, _CAPSULE = int(mujoco.mjtGeom.mjGEOM_SPHERE), int(mujoco.mjtGeom.mjGEOM_CAPSULE)
_CYLINDER = int(mujoco.mjtGeom.mjGEOM_CYLINDER)


@dataclass(kw_only=True, slots=True, eq=False)
class PlainRows:
    """Rows of such bodies in MuJoCo's arrays."""

    bodies: np.ndarray
    """(n,) rows among the bodies."""
    geoms: np.ndarray
    """(g,) those of all their geoms."""
    geom_owners: np.ndarray
    """(g,) places of these geoms' bodies."""
    boxes: np.ndarray
    """(b,) those of all their boxes in the tree of boxes."""
    box_owners: np.ndarray
    """(b,) places of these boxes' bodies."""
    massive: np.ndarray
    """(m,) places of bodies with a mass."""
    free: np.ndarray
    """(f,) places of bodies whose base is free."""
    turns: np.ndarray
    """(f, 3) rows of their rotations among the degrees of freedom."""


def rows_of(model: Any, bodies: Sequence[int], numbers: Sequence[Numbers]) -> PlainRows:
    """Return the rows of bodies.

    Args:
        model: MjModel.
        bodies: rows of the bodies.
        numbers: of each; `Numbers.is_plain`.
    """
    rows = np.array(bodies)
    geoms, geom_owners = _runs(model.body_geomadr[rows], model.body_geomnum[rows])
    boxes, box_owners = _runs(model.body_bvhadr[rows], model.body_bvhnum[rows])
    free = np.flatnonzero(model.body_dofnum[rows] == 6)
    return PlainRows(
        bodies=rows,
        geoms=geoms,
        geom_owners=geom_owners,
        boxes=boxes,
        box_owners=box_owners,
        massive=np.array([k for k, one in enumerate(numbers) if one.mass is not None], np.intp),
        free=free,
        turns=model.body_dofadr[rows[free], None] + np.arange(3, 6),
    )


def write(model: Any, rows: PlainRows, numbers: Sequence[Numbers]) -> None:
    """Write sizes and masses into a model; `mj_setConst` computes the rest.

    Args:
        model: MjModel.
        rows: of the bodies.
        numbers: of each.
    """
    kinds, sizes = np.array([one.kind for one in numbers]), np.array([one.sizes for one in numbers])
    sizes[kinds == _SPHERE, 1:] = 0.0
    half, reach = _extents(kinds, sizes)
    model.geom_size[rows.geoms] = sizes[rows.geom_owners]
    model.geom_rbound[rows.geoms] = reach[rows.geom_owners]
    model.geom_aabb[rows.geoms, 3:] = half[rows.geom_owners]
    model.bvh_aabb[rows.boxes, 3:] = half[rows.box_owners]
    if len(rows.massive):
        masses = [one.mass for one in numbers if one.mass is not None]
        bodies = rows.bodies[rows.massive]
        model.body_mass[bodies] = [mass.mass for mass in masses]
        model.body_inertia[bodies] = [mass.principal for mass in masses]
    model.dof_length[rows.turns] = reach[rows.free, None]


def _extents(kinds: np.ndarray, sizes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return half sizes (n, 3) of boxes around shapes and radii (n,) of spheres around them (m).

    Args:
        kinds: (n,) MuJoCo's types.
        sizes: (n, 3) MuJoCo's sizes (m).
    """
    half = sizes.copy()
    squares = sizes * sizes
    reach = np.sqrt(squares[:, 0] + squares[:, 1] + squares[:, 2])
    for kind in {_SPHERE, _CAPSULE, _CYLINDER}.intersection(kinds.tolist()):
        among = kinds == kind
        a, b = sizes[among, 0], sizes[among, 1]
        z = a if kind == _SPHERE else a + b if kind == _CAPSULE else b
        half[among] = np.stack([a, a, z], axis=1)
        if kind != _CYLINDER:
            reach[among] = z
    return half, reach


def _runs(starts: np.ndarray, counts: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the numbers of several runs, and which run each is of."""
    owners = np.repeat(np.arange(len(starts)), counts)
    first = np.cumsum(counts) - counts
    return starts[owners] + np.arange(len(owners)) - first[owners], owners
