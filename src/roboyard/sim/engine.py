"""The engine of a world: positions and velocities of links that agree with the state, computed when read."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from roboyard._mujoco import mujoco
from roboyard.sim.build.solver_options import Solver
from roboyard.sim.compiled_world import ALL_MOVED, FORCES_MOVED, CompiledWorld
from roboyard.sim.engine_hooks import BodyT
from roboyard.sim.frame_updates import CENTRES, KEEP, POSES, SPEEDS, FrameUpdates
from roboyard.sim.physics_profile import PhysicsProfile
from roboyard.sim.shape_bounds import shape_bounds
from roboyard.transforms import Array

_FRAMES = "frames"
"""Name in `Engine.of_arrays`."""
_SLEEPS = int(mujoco.mjtEnableBit.mjENBL_SLEEP)


class Engine(CompiledWorld[BodyT]):
    """A compiled world and the frames of its links."""

    def __init__(
        self, *, gravity: Sequence[float], timestep: float, solver: Solver, profile: PhysicsProfile
    ) -> None:
        super().__init__(gravity=gravity, timestep=timestep, solver=solver, profile=profile)
        self._centres_moved = True
        """Whether body frames were computed since what is computed of them."""
        self.keeps_frames = False
        """Whether body frames of the last step are kept in `kept_frames` when they are brought up to date."""
        self.kept_frames: tuple[Array, Array] | None = None
        """(nbody, 3) positions (m) and (nbody, 4) quaternions w, x, y, z before the last position update,
        where MuJoCo's arrays hold later ones."""
        self._lengths: tuple[int, Array] | None = None

    @property
    def is_sleeping(self) -> bool:
        """Whether bodies at rest sleep."""
        return bool(self._model.opt.enableflags & _SLEEPS)

    def mark_fixed_moved(self) -> None:
        """Note that the pose of a fixed body was written. A world with sleeping takes fixed bodies, and what
        hangs on them, for unmoved, so their positions are computed here with sleeping off.
        """
        self.mark_moved()
        option = self._model.opt
        if self.is_sleeping:
            option.enableflags &= ~_SLEEPS
            try:
                mujoco.mj_kinematics(self._model, self._data)
            finally:
                option.enableflags |= _SLEEPS

    def link_frames(self, *, keeps_last: bool) -> Any:
        """Return the MjData with positions of bodies, geoms and sites that agree with qpos.

        Args:
            keeps_last: whether body frames of the last step are kept where the world keeps them at all.
        """
        if self.is_stale:
            self.ensure_compiled()
        return self._frames_so_far(keeps_last=keeps_last)

    def awaited_frames(self) -> Any:
        """Return the MjData of the last compile, whose frames agree with its qpos, while the next is awaited.

        None where a fixed body was moved meanwhile.
        """
        if not self.is_stale or self._model is None or self.is_outdated:
            return None
        self.kept_frames = None
        return self._frames_so_far(keeps_last=False)

    def _frames_so_far(self, *, keeps_last: bool) -> Any:
        if self.is_moved:
            self._update_frames(keeps_last=keeps_last)
        return self._data

    def kinematics(self) -> Any:
        """Return the MjData with positions (xpos, xipos, geom_xpos, ...) that agree with qpos.

        So do centres of mass of trees and axes of motion.
        """
        if self.is_stale:
            self.ensure_compiled()
        if self.is_moved or self._centres_moved:
            self._update_frames(centres=True)
        return self._data

    def link_velocities(self) -> Any:
        """Return the MjData with positions and body velocities (cvel) that agree with qpos and qvel."""
        if self.is_stale:
            self.ensure_compiled()
        if self.is_moved or self._centres_moved or self._velocity_moved == ALL_MOVED:
            self._update_frames(centres=True, speeds=True)
        return self._data

    def axis_lengths(self) -> Array | None:
        """Return the (nv,) lengths of the axes of degrees of freedom; None where all are 1.

        An impulse engine that takes axes as files give them turns a joint by its velocity, and counts it so
        many times larger where it computes velocities of links and forces.
        """
        if not self.long_axes:
            return None
        if self._lengths is None or self._lengths[0] != self.revision:
            lengths, bodies = np.ones(self._model.nv), self.body_by_id
            for (key, joint), length in self.long_axes.items():
                if key in bodies:
                    lengths[bodies[key].dofs_of(joint)] = length
            self._lengths = self.revision, lengths
        return self._lengths[1]

    def velocities(self) -> Any:
        """Return the MjData with `link_velocities`, and what MuJoCo computes of these."""
        data = self.kinematics()
        if self._velocity_moved:
            mujoco.mj_fwdVelocity(self._model, data)
            self._velocity_moved = 0
        return data

    @property
    def frame_updates(self) -> FrameUpdates:
        """Updates of the arrays of a compiled world."""
        updates: FrameUpdates | None = self.of_arrays.get(_FRAMES)
        if updates is None:
            updates = self.of_arrays[_FRAMES] = FrameUpdates(self._model, self._data)
        return updates

    def _update_frames(self, *, keeps_last: bool = True, centres: bool = False, speeds: bool = False) -> None:
        """Compute what has moved of positions, and on request of centres of mass and velocities of bodies."""
        updates = self.frame_updates
        parts = 0
        if self.is_moved:
            parts = POSES
            if keeps_last and self.keeps_frames and self.kept_frames is None:
                parts |= KEEP
                self.kept_frames = updates.kept
            self.is_moved, self._centres_moved = False, True
        if centres and self._centres_moved:
            if self._inertia_changed:
                self.sum_inertia()
            parts |= CENTRES
            self._centres_moved = False
        if speeds and self._velocity_moved == ALL_MOVED:
            parts |= SPEEDS
            self._velocity_moved = FORCES_MOVED
        lengths = self.axis_lengths()
        if lengths is not None and parts & CENTRES:
            updates.update(parts & ~SPEEDS)
            self._data.cdof *= lengths[:, None]
            parts &= SPEEDS
        updates.update(parts)

    def object_velocity(self, row: int, *, at_inertial: bool) -> tuple[Array, Array]:
        """Return linear (3,) (m/s) and angular (3,) (rad/s) velocity of a MuJoCo body in the world frame.

        Args:
            row: of the body.
            at_inertial: take the linear velocity at the centre of mass instead of at the body frame's origin.
        """
        data = self.velocities()
        kind = mujoco.mjtObj.mjOBJ_BODY if at_inertial else mujoco.mjtObj.mjOBJ_XBODY
        out = np.empty(6)
        mujoco.mj_objectVelocity(self._model, data, kind, row, out, 0)
        return out[3:], out[:3]

    def bounds_of(self, mujoco_ids: np.ndarray) -> Array:
        """Return the (2, 3) bounding box of all shapes of some MuJoCo bodies, in the world frame (m).

        Args:
            mujoco_ids: (k,) rows of bodies.
        """
        self.show_triangles()
        data = self.kinematics()
        return shape_bounds(self._model, data, mujoco_ids)

    @property
    def geom_owners(self) -> np.ndarray:
        """(ngeom, 2) int32: body id and link index of each MuJoCo geom; -1 for geoms of inactive bodies."""
        self.ensure_compiled()
        if self._geom_owners is None:
            by_row = np.full((self._model.nbody, 2), -1, dtype=np.int32)
            for body in self.body_by_id.values():
                by_row[body.mujoco_ids, 0] = body.id
                by_row[body.mujoco_ids, 1] = np.arange(len(body.built.links))
            self._geom_owners = by_row[self._model.geom_bodyid]
            for body in self.body_by_id.values():
                if body.built.is_ground:
                    self._geom_owners[[geom.id for geom in body.built.links[0].geoms]] = (body.id, 0)
        return self._geom_owners
