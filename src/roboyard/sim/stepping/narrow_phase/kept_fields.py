"""The height fields and searched meshes of a world, looked up once for all that search their triangles."""

from __future__ import annotations

from roboyard.sim.body import Body
from roboyard.sim.build.records import windows_of
from roboyard.sim.engine import Engine
from roboyard.sim.stepping.narrow_phase.fields import Fields, fields_of

_FIELDS = "height fields"
"""Name in `Engine.of_arrays`."""


def kept_fields(world: Engine[Body]) -> Fields:
    """Return the height fields of a world that is compiled; they are kept as long as MuJoCo's arrays stay."""
    found: Fields | None = world.of_arrays.get(_FIELDS)
    if found is None:
        windows = windows_of(world.body_by_id.values())
        found = world.of_arrays[_FIELDS] = fields_of(world.live_model, world.live_data, windows)
    return found
