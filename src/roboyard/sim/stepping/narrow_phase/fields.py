"""MuJoCo's height fields, as arguments of compiled loops."""

from __future__ import annotations

from typing import Any

import numpy as np

from roboyard._records import NamedTuple


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


def fields_of(model: Any, data: Any) -> Fields:
    """Return the height fields of an MjModel, at the places of its MjData."""
    return Fields(
        places=data.geom_xpos,
        turns=data.geom_xmat,
        ids=model.geom_dataid,
        sizes=model.hfield_size,
        rows=model.hfield_nrow,
        columns=model.hfield_ncol,
        starts=model.hfield_adr,
        heights=model.hfield_data,
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
    )
