"""Saving and restoring the state of a world, bit for bit."""

from __future__ import annotations

from functools import cache

import numpy as np

from roboyard._records import dataclass
from roboyard.errors import ModelError
from roboyard.sim.body import Body
from roboyard.sim.engine import Engine
from roboyard.sim.stepping.manifolds import KeptPoints
from roboyard.transforms import Array


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class WorldState:
    """The state of one world; valid as long as no body is added or removed."""

    values: Array
    """Positions, velocities, activations, controls, pending forces, warm start."""
    equalities: Array
    """(neq,) whether each constraint is active; of the moment where constraints came or went since."""
    static_positions: Array
    static_quaternions: Array
    signature: tuple[int, ...]
    """Ids of the bodies, in order."""
    has_forces: tuple[bool, bool]
    """Whether external forces act on links, and whether any act at all."""
    friction: Array | None = None
    """(ngeom, 3) coefficients of friction; None keeps those of the moment."""
    contacts: KeptPoints | None = None
    """Points that pairs keep from step to step, where contacts are rigid."""


def save(world: Engine[Body], contacts: KeptPoints | None) -> WorldState:
    """Return the present state, with the points that contacts keep.

    Inactive bodies are deleted first, so that the state fits later compiles.
    """
    import mujoco

    world.ensure_compiled()
    world.wrenches.find()
    kind = _kind()
    values = np.empty(mujoco.mj_stateSize(world.model, kind))
    mujoco.mj_getState(world.model, world.data, values, kind)
    return WorldState(
        values=values,
        equalities=world.data.eq_active.copy(),
        static_positions=world.model.body_pos.copy(),
        static_quaternions=world.model.body_quat.copy(),
        signature=tuple(world.body_by_id),
        has_forces=(world.wrenches.pushed, world.wrenches.pending),
        friction=world.model.geom_friction.copy(),
        contacts=contacts,
    )


def restore(world: Engine[Body], state: WorldState) -> None:
    """Restore a saved state; constraints that were created since stay, removed ones do not come back.

    Raises:
        ModelError: bodies were added or removed since the state was saved.
    """
    import mujoco

    world.ensure_compiled()
    kind, model, data = _kind(), world.model, world.data
    fits = (
        state.signature == tuple(world.body_by_id)
        and len(state.values) == mujoco.mj_stateSize(model, kind)
        and len(state.static_positions) == model.nbody
    )
    if not fits:
        raise ModelError(
            f"the state was saved with other bodies, ids {state.signature} instead of "
            f"{tuple(world.body_by_id)}; save again after adding or removing bodies"
        )
    mujoco.mj_setState(model, data, state.values, kind)
    if len(state.equalities) == model.neq:
        data.eq_active[:] = state.equalities
    world.wrenches.pushed, world.wrenches.pending = state.has_forces
    if state.friction is not None:
        _restore_friction(world, state.friction)
    positions, quaternions = model.body_pos, model.body_quat
    if (  # bytes are much faster than arrays
        positions.tobytes() == state.static_positions.tobytes()
        and quaternions.tobytes() == state.static_quaternions.tobytes()
    ):
        world.mark_moved()
        return
    positions[:], quaternions[:] = state.static_positions, state.static_quaternions
    for body in world.body_by_id.values():
        if body.is_fixed:
            root = body.built.links[0].element
            root.pos = model.body_pos[root.id]
            root.quat = model.body_quat[root.id]
    world.mark_fixed_moved()


@cache
def _kind() -> int:
    """Return what MuJoCo saves: everything that steps need but which constraints are active."""
    import mujoco

    return int(mujoco.mjtState.mjSTATE_INTEGRATION) & ~int(mujoco.mjtState.mjSTATE_EQ_ACTIVE)


def _restore_friction(world: Engine[Body], saved: Array) -> None:
    """Write (ngeom, 3) coefficients of friction where they differ, for the next compile as well."""
    model = world.model
    changed = (model.geom_friction != saved).any(axis=1)
    if not changed.any():
        return
    for body in world.body_by_id.values():
        for record in body.built.links:
            for geom in record.geoms:
                if changed[geom.id]:
                    geom.friction = saved[geom.id]
    model.geom_friction[changed] = saved[changed]
