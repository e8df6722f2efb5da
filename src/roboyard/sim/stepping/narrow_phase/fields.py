"""MuJoCo's height fields, and the meshes that some represent, as arguments of compiled loops."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from roboyard._records import NamedTuple

if TYPE_CHECKING:
    from roboyard.sim.build.mesh_fields import MeshField
    from roboyard.sim.build.triangle_windows import TriangleWindow


class Fields(NamedTuple):
    """MuJoCo's height fields, and where they are."""

    places: np.ndarray
    """(ngeom, 3) of all geoms (m)."""
    turns: np.ndarray
    """(ngeom, 9)."""
    ids: np.ndarray
    """(ngeom,) height field of each geom that is one."""
    sizes: np.ndarray
    """(n, 4) half sizes along x and y and the range of heights (m), and a fourth number."""
    rows: np.ndarray
    columns: np.ndarray
    starts: np.ndarray
    heights: np.ndarray
    """Shares of the ranges of heights, row by row from the least y; of none where there are no fields."""
    meshes: np.ndarray
    """(n,) row in `trees` of the mesh that a field represents, -1 for terrain."""
    trees: np.ndarray
    """(m, 3) each mesh's first row of `boxes` and first one of `leaves`, and its number of leaves."""
    boxes: np.ndarray
    """(k, 6) least and largest coordinates (m) of the nodes of complete binary trees; see `MeshField`."""
    leaves: np.ndarray
    """First triangle of each leaf, and the end of each tree's last."""
    corners: np.ndarray
    """(t, 9) the triangles' corners in the frame of the geom (m)."""
    margins: np.ndarray
    """(m,) margin around the triangles of each mesh (m), which does not hold for balls."""


def fields_of(model: Any, data: Any, windows: Sequence[TriangleWindow]) -> Fields:
    """Return the height fields of an MjModel, at the places of its MjData.

    Args:
        model: MjModel.
        data: MjData.
        windows: concave meshes; those that are searched have a height field each.
    """
    searched = [window for window in windows if window.whole is not None]
    meshes = np.full(model.nhfield, -1, np.int32)
    for row, window in enumerate(searched):
        meshes[model.geom_dataid[window.whole.id]] = row
    return Fields(
        places=data.geom_xpos,
        turns=data.geom_xmat,
        ids=model.geom_dataid,
        sizes=model.hfield_size,
        rows=model.hfield_nrow,
        columns=model.hfield_ncol,
        starts=model.hfield_adr,
        heights=model.hfield_data,
        meshes=meshes,
        margins=np.array([window.margin for window in searched]),
        **_joined([_triangles(window) for window in searched]),
    )


def no_fields() -> Fields:
    """Return the height fields of no geoms."""
    integers = np.zeros(0, np.int32)
    return Fields(
        places=np.zeros((0, 3)),
        turns=np.zeros((0, 9)),
        ids=integers,
        sizes=np.zeros((0, 4)),
        rows=integers,
        columns=integers,
        starts=integers,
        heights=np.zeros(0, np.float32),
        meshes=integers,
        margins=np.zeros(0),
        **_joined([]),
    )


def _triangles(window: TriangleWindow) -> MeshField:
    from roboyard.sim.build.mesh_fields import mesh_field

    return mesh_field(window.mesh, single=window.is_single)


def _joined(fields: Sequence[MeshField]) -> dict[str, np.ndarray]:
    """Return the trees of all meshes one after another; those of one mesh are not copied."""
    counts = np.array([[len(f.boxes), len(f.leaves), len(f.corners)] for f in fields]).reshape(-1, 3)
    starts = np.cumsum(counts, axis=0) - counts
    trees = np.stack([starts[:, 0], starts[:, 1], counts[:, 1] - 1], axis=1).astype(np.int32)
    if len(fields) == 1:
        (field,) = fields
        return {"trees": trees, "boxes": field.boxes, "leaves": field.leaves, "corners": field.corners}
    leaves = [f.leaves + np.int32(first) for f, first in zip(fields, starts[:, 2].tolist(), strict=True)]
    return {
        "trees": trees,
        "boxes": np.concatenate([np.zeros((0, 6)), *(f.boxes for f in fields)]),
        "leaves": np.concatenate([np.zeros(0, np.int32), *leaves]),
        "corners": np.concatenate([np.zeros((0, 9)), *(f.corners for f in fields)]),
    }
