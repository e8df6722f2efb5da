"""Saving and restoring the state of a world, bit for bit."""

from __future__ import annotations

from functools import cache

import numpy as np

from roboyard._mujoco import mujoco
from roboyard._records import dataclass
from roboyard.errors import ModelError
from roboyard.sim.body import Body
from roboyard.sim.engine import Engine
from roboyard.sim.stepping.points.kept_points import KeptPoints
from roboyard.transforms import Array


@dataclass(kw_only=True, slots=True, eq=False)
class WorldState:
    """The state of one world; valid as long as no body is added or removed."""

    values: Array
    """Positions, velocities, activations, controls, pending forces, warm start."""
    equalities: Array
    """(neq,) whether each constraint is active; of the moment where constraints came or went since."""
    next_constraint: int
    """Id of the first constraint that came since."""
    static_positions: Array
    static_quaternions: Array
    signature: tuple[int, ...]
    """Ids of the bodies, in order."""
    layout: bytes
    """Of each MuJoCo body its parent and its number of degrees of freedom."""
    has_forces: tuple[bool, bool]
    """Whether external forces act on links, and whether any act at all."""
    friction: Array | None = None
    """(ngeom, 3) coefficients of friction; None keeps those of the moment."""
    contacts: KeptPoints | None = None
    """Points that pairs keep from step to step, where contacts are rigid."""
    fits: tuple[int, bytes, bytes, bytes] = (-1, b"", b"", b"")
    """Revision of the world's arrays that it was last found to fit, and bytes of the static poses and of what
    is active."""
    known_points: bool | None = None
    """`has_points`, once it was asked for."""

    @property
    def has_points(self) -> bool:
        """Whether contacts kept any points."""
        if self.known_points is None:
            self.known_points = self.contacts is not None and bool(self.contacts.counts.any())
        return self.known_points


def save(world: Engine[Body], contacts: KeptPoints | None) -> WorldState:
    """Return the present state, with the points that contacts keep.

    Inactive bodies are deleted first, so that the state fits later compiles.
    """
    world.ensure_compiled()
    world.wrenches.find()
    kind = _kind()
    model = world.model_of_bodies
    values = np.empty(mujoco.mj_stateSize(model, kind))
    mujoco.mj_getState(model, world.live_data, values, kind)
    return WorldState(
        values=values,
        equalities=world.live_data.eq_active.copy(),
        next_constraint=world.next_constraint,
        static_positions=model.body_pos.copy(),
        static_quaternions=model.body_quat.copy(),
        signature=tuple(world.body_by_id),
        layout=_layout(model),
        has_forces=(world.wrenches.pushed, world.wrenches.pending),
        friction=model.geom_friction.copy(),
        contacts=contacts,
    )


def restore(world: Engine[Body], state: WorldState, *, by_place: bool = False) -> None:
    """Restore a saved state; constraints that were created since stay, removed ones do not come back.

    Args:
        world: to restore.
        state: saved before.
        by_place: whether bodies may have been replaced by others with as many links and joints.

    Raises:
        ModelError: bodies were added or removed since the state was saved.
    """
    kind, kept = _kind(), world.kept_poses
    if kept is None or world.is_stale or world.pool.is_used or state.fits[0] != world.revision:
        model = world.model_of_bodies  # inactive ones are deleted
        data = world.live_data
        kept = world.kept_poses = model.body_pos, model.body_quat, data.eq_active, model, data
        if state.fits[0] != world.revision:
            _check(world, state, mujoco.mj_stateSize(model, kind), by_place=by_place)
    positions, quaternions, active, model, data = kept
    mujoco.mj_setState(model, data, state.values, kind)
    _, known_positions, known_quaternions, known_active = state.fits
    # bytes are much faster than arrays
    if len(state.equalities) == len(active) and active.tobytes() != known_active:
        active[:] = state.equalities
        world.restore_active(active, state.next_constraint)
    wrenches = world.wrenches
    wrenches.pushed, wrenches.pending = state.has_forces
    if state.friction is not None:
        _restore_friction(world, state.friction)
    if positions.tobytes() == known_positions and quaternions.tobytes() == known_quaternions:
        world.mark_moved()
        return
    positions[:], quaternions[:] = state.static_positions, state.static_quaternions
    for body in world.body_by_id.values():
        if body.is_fixed:
            root = body.built.links[0].element
            root.pos = positions[root.id]
            root.quat = quaternions[root.id]
    world.mark_fixed_moved()


def _layout(model: mujoco.MjModel) -> bytes:
    return model.body_parentid.tobytes() + model.body_dofnum.tobytes()


def _check(world: Engine[Body], state: WorldState, size: int, *, by_place: bool) -> None:
    """Note that a state fits the world's arrays as they are, whose state has `size` numbers.

    Raises:
        ModelError: it does not.
    """
    bodies = tuple(world.body_by_id)
    positions, quaternions = state.static_positions, state.static_quaternions
    is_same = state.signature == bodies or (by_place and state.layout == _layout(world.live_model))
    if not is_same or len(state.values) != size or len(positions) != world.live_model.nbody:
        raise ModelError(
            f"the state was saved with other bodies, ids {state.signature} instead of {bodies}; "
            "save again after adding or removing bodies"
        )
    poses = positions.tobytes(), quaternions.tobytes()
    state.fits = world.revision, *poses, state.equalities.tobytes()


@cache
def _kind() -> int:
    """Return what MuJoCo saves: everything that steps need but which constraints are active."""
    return int(mujoco.mjtState.mjSTATE_INTEGRATION) & ~int(mujoco.mjtState.mjSTATE_EQ_ACTIVE)


def _restore_friction(world: Engine[Body], saved: Array) -> None:
    """Write (ngeom, 3) coefficients of friction where they differ, for the next compile as well."""
    world.write_late()
    model = world.live_model
    changed = (model.geom_friction != saved).any(axis=1)
    if not changed.any():
        return
    world.note_edit()
    for body in world.body_by_id.values():
        for record in body.built.links:
            for geom in record.geoms:
                if changed[geom.id]:
                    geom.friction = saved[geom.id]
    model.geom_friction[changed] = saved[changed]
