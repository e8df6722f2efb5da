"""Saving and restoring everything that moves, bit for bit."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from roboyard.errors import ModelError
from roboyard.sim.body import Body
from roboyard.sim.engine import Engine
from roboyard.transforms import Array


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class WorldState:
    """A moment of one world. It fits that world as long as no body was added or removed since."""

    values: Array
    """Positions, velocities, activations, controls, pending forces, warm start."""
    static_positions: Array
    static_quaternions: Array
    signature: tuple[int, ...]
    """Ids of the bodies, in order."""


def save(world: Engine[Body]) -> WorldState:
    """The present moment."""
    import mujoco

    world.ensure_compiled()
    kind = mujoco.mjtState.mjSTATE_INTEGRATION
    values = np.empty(mujoco.mj_stateSize(world.model, kind))
    mujoco.mj_getState(world.model, world.data, values, kind)
    return WorldState(
        values=values,
        static_positions=world.model.body_pos.copy(),
        static_quaternions=world.model.body_quat.copy(),
        signature=tuple(world.body_by_id),
    )


def restore(world: Engine[Body], state: WorldState) -> None:
    """Go back to a saved moment.

    Raises:
        ModelError: bodies were added or removed since the state was saved.
    """
    import mujoco

    world.ensure_compiled()
    kind = mujoco.mjtState.mjSTATE_INTEGRATION
    fits = (
        state.signature == tuple(world.body_by_id)
        and len(state.values) == mujoco.mj_stateSize(world.model, kind)
        and len(state.static_positions) == world.model.nbody
    )
    if not fits:
        raise ModelError(
            "the state was saved with other bodies in the world; save again after adding or removing"
        )
    mujoco.mj_setState(world.model, world.data, state.values, kind)
    world.model.body_pos[:] = state.static_positions
    world.model.body_quat[:] = state.static_quaternions
    for body in world.body_by_id.values():
        if body.is_fixed:
            root = body.built.links[0].element
            root.pos = world.model.body_pos[root.id]
            root.quat = world.model.body_quat[root.id]
    world.mark_moved()
