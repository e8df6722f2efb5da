"""One time step: MuJoCo's own where that will do, else in two halves with Roboyard's rules between."""

from __future__ import annotations

import logging
import threading
from typing import TYPE_CHECKING, Any

import mujoco
import numpy as np

if TYPE_CHECKING:
    from roboyard.sim.world import World

log = logging.getLogger("roboyard.sim")


class _Alarm(threading.local):
    """What MuJoCo warned of during the step that this thread is taking."""

    message: str | None = None


alarm = _Alarm()


def _on_warning(message: str) -> None:
    if "unstable" in message:
        alarm.message = message
    else:
        log.warning("MuJoCo: %s", message)


mujoco.set_mju_user_warning(_on_warning)


class Stepping:
    """Takes the steps of one world; `refresh` is called whenever a rule comes or goes."""

    def __init__(self, world: World) -> None:
        self._world = world
        self.is_plain = True
        """MuJoCo's own step will do."""
        self._surfaces = self._motors = self._bounded = False
        self._velocity_limits: dict[tuple[int, int], float] = {}
        self._limit_rows: np.ndarray | None = None

    def refresh(self) -> None:
        """Look again at what steps have to pass through."""
        world = self._world
        self._surfaces = world.surfaces.is_active
        self._motors = world.motors.is_active
        self._bounded = world.constraints.is_bounded
        self.is_plain = not (self._surfaces or self._motors or self._bounded or world.wrenches.pending)

    def invalidate(self) -> None:
        """MuJoCo's arrays are new."""
        self._limit_rows = None

    def forget(self, body_id: int) -> None:
        self._velocity_limits = {k: v for k, v in self._velocity_limits.items() if k[0] != body_id}

    def set_velocity_limit(self, body_id: int, joint_index: int, largest: float) -> None:
        """Bound a joint's speed otherwise than the world's profile does; rad/s or m/s."""
        self._velocity_limits[(body_id, joint_index)] = largest
        self._limit_rows = None

    def step(self, model: Any, data: Any) -> None:
        """One step with every rule."""
        world = self._world
        if self._motors:
            world.motors.prepare(model)
        if self._bounded:
            world.constraints.prepare(model)
        mujoco.mj_step1(model, data)
        if self._surfaces:
            world.surfaces.apply(model, data)
        if self._motors:
            world.motors.apply(model, data)
        if world.hard_contacts or self._bounded or world.profile.largest_velocity is not None:
            self._solve(model, data)
        else:
            mujoco.mj_step2(model, data)
        if self._surfaces or world.wrenches.pending:
            world.wrenches.clear()

    def _solve(self, model: Any, data: Any) -> None:
        """The second half by hand, with the solver repeated where the rules ask for it."""
        world = self._world
        if self._bounded:
            world.constraints.free_axes(model, data)
        mujoco.mj_fwdActuation(model, data)
        mujoco.mj_fwdAcceleration(model, data)
        mujoco.mj_fwdConstraint(model, data)
        if world.hard_contacts:
            world.surfaces.correct_sliding(model, data)
        if self._bounded:
            world.constraints.bound_forces(model, data)
        if world.profile.largest_velocity is not None:
            from roboyard.sim import _kernels

            limits = self._limit_rows
            if limits is None:
                limits = self._limit_rows = self._gather_limits(model, world.profile.largest_velocity)
            _kernels.bound_velocity(data.qvel, data.qacc, model.opt.timestep, limits)
        if world.profile.integrator == "euler":
            mujoco.mj_Euler(model, data)
        else:
            mujoco.mj_implicit(model, data)

    def _gather_limits(self, model: Any, usual: float) -> np.ndarray:
        limits = np.full(model.nv, usual)
        for (body_id, joint_index), largest in self._velocity_limits.items():
            limits[self._world.body_by_id[body_id].joints[joint_index].dof_slice] = largest
        return limits
