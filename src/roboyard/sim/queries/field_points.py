"""The closest points of a shape and the triangles of terrain or a concave mesh."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from roboyard._lazy import lazy_module
from roboyard.sim.stepping.narrow_phase.field_kernels import WORK, is_searched
from roboyard.sim.stepping.narrow_phase.kept_fields import kept_fields
from roboyard.transforms import Array

if TYPE_CHECKING:
    from roboyard.sim.simulation import Simulation

kernels = lazy_module("roboyard.sim.stepping.narrow_phase.field_queries")

_FEW = 64
"""Number of triangles for which there is room at first."""


def points_on_field(world: Simulation, field: int, shape: int, limit: float) -> Array | None:
    """Return the closest points of a shape and of each triangle of a field within a distance.

    Args:
        world: the world, whose positions are known.
        field: MuJoCo geom, a height field or one that represents a concave mesh.
        shape: geom of another type.
        limit: distance (m).

    Returns:
        (n, 10) distance (m), point on the shape (m), point on the field (m) and the direction from this to
        that, in the world frame, in the order of the triangles; None where the shape's form is not known.
    """
    model, data = world.live_model, world.live_data
    forms = world.surfaces.forms(model, data)
    found = kept_fields(world)
    if not is_searched(found, model.geom_type, forms.boxes, forms.spans, field, shape):
        return None
    shapes = model.geom_type, model.geom_bodyid, data.xpos, data.xmat, forms.boxes
    work, room = np.zeros(WORK), _FEW
    while True:
        out = np.zeros((room, 10))
        count = kernels().closest_on_field(
            *(found, *shapes, forms.rounding, forms.hulls, forms.spans, field, shape, limit, work, out)
        )
        if count <= room:
            return out[: int(count)]
        room = int(count)
