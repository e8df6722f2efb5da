"""The physics of n environments on MuJoCo Warp, in single precision.

States live in the arrays of `BatchPhysics`, so that tasks, resets and differences are the same code; Warp
makes the time steps. Sources of the interface: `google-deepmind/mujoco_warp`.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import mujoco
import numpy as np

from roboyard.envs.batch_physics import BatchPhysics
from roboyard.envs.on_warp.translation import Translation
from roboyard.errors import ConfigError, MissingExtraError, ModelError
from roboyard.sim.world import World
from roboyard.transforms import Array

try:
    import mujoco_warp as mjw  # pyright: ignore[reportMissingImports]
    import warp as wp  # pyright: ignore[reportMissingImports]
except ModuleNotFoundError as error:
    raise MissingExtraError("mujoco_warp", "warp", "environments on MuJoCo Warp") from error

_STATE = ("qpos", "qvel", "qacc_warmstart")
_FROM_MASSES = (
    "body_subtreemass", "body_invweight0", "dof_invweight0", "tendon_length0", "tendon_invweight0",
    "actuator_acc0",
)  # fmt: skip
"""Fields that follow from masses and inertias."""


class WarpPhysics(BatchPhysics):
    """n simulations of a world as it is now, stepped by MuJoCo Warp."""

    def __init__(
        self,
        world: World,
        count: int,
        *,
        threads: int = 0,
        device: str | None = None,
        contacts: int | None = None,
    ) -> None:
        """Create n simulations in the present state of a world.

        Args:
            world: as in `BatchPhysics`.
            count: n.
            threads: of the processor, for resets.
            device: Warp's name of a device; "cuda:0" by default where there is one, else "cpu".
            contacts: room for contacts of each environment; Warp's own estimate by default.

        Raises:
            ConfigError: there is no such device.
            ModelError: the world has rules that copies of it or MuJoCo Warp do not know.
        """
        wp.config.quiet = True
        self._derived: dict[str, tuple[Array, Array]] = {}  # MuJoCo's own array, and the one that is read
        super().__init__(world, count, threads=threads)
        try:
            self._device: Any = wp.get_device(device)
        except (ValueError, RuntimeError):
            names = ", ".join(str(one) for one in wp.get_devices())
            raise ConfigError(f"device {device!r} is none of those that Warp finds: {names}") from None
        self._translation = Translation(world)
        self._expanded: dict[str, Array] = {}
        self._is_changed = False
        self._graph: Any = None
        try:
            with wp.ScopedDevice(self._device):
                self._model: Any = mjw.put_model(self._translation.model)
                self._data: Any = mjw.make_data(self._translation.model, nworld=count, nconmax=contacts)
        except NotImplementedError as error:
            raise ModelError(f"MuJoCo Warp cannot run this world: {error}") from None
        self._state = {name: self.batch.bind(name) for name in _STATE}
        self._time = self.batch.bind("time")

    def field(self, name: str) -> Array:
        """Return a live (n, ...) array of an MjData field; state fields may be written."""
        if name not in self._fields:
            bound = super().field(name)
            if not bound.flags.writeable:
                if not hasattr(self._data, name):
                    raise ModelError(f"MuJoCo Warp has no field {name!r}")
                self._fields[name] = bound.copy()
                self._derived[name] = bound, self._fields[name]
        return self._fields[name]

    def forward(self, rows: np.ndarray | None = None) -> None:
        """Bring derived fields of `rows` (k,), all by default, up to date with the state."""
        super().forward(rows)
        for bound, read in self._derived.values():
            if rows is None:
                read[:] = bound
            else:
                read[rows] = bound[rows]

    def model_field(self, name: str) -> Array:
        """Return a live (n, ...) array of an MjModel field, which then may differ between environments.

        Raises:
            ModelError: MuJoCo Warp has no such field.
        """
        if name not in self._expanded:
            owner, _, key = name.rpartition(".")
            if not hasattr(getattr(self._model, owner) if owner else self._model, key):
                raise ModelError(f"MuJoCo Warp has no {name!r} that differs between environments")
            self._expanded[name] = super().model_field(name)
            self._graph = None
        self._is_changed = True
        return self._expanded[name]

    def update_constants(self, rows: Sequence[int] | np.ndarray | None = None) -> None:
        """Recompute what follows from masses and inertias of `rows` (k,), all by default, after a change."""
        super().update_constants(rows)
        for name in _FROM_MASSES:
            if hasattr(self._model, name) and getattr(self.world.model, name).size:
                self.model_field(name)

    def reset(self, rows: np.ndarray) -> None:
        """Put simulations `rows` (k,) into the start state; call `forward` after changing it."""
        super().reset(rows)
        self._is_changed = True  # differences are drawn at the start of episodes

    def _send_model(self) -> None:
        for name, values in self._expanded.items():
            owner, _, key = name.rpartition(".")
            holder = getattr(self._model, owner) if owner else self._model
            present = getattr(holder, key)
            rows = np.ascontiguousarray(values, dtype=np.float32)
            if present.shape[0] == self.count and self.count > 1:
                present.assign(rows.reshape(present.numpy().shape))
            else:
                shape = (self.count, *present.numpy().shape[1:])
                setattr(holder, key, wp.array(rows.reshape(shape), dtype=present.dtype, device=self._device))
        self._is_changed = False

    def _advance(self, substeps: int) -> np.ndarray:
        with wp.ScopedDevice(self._device):
            if self._is_changed:
                self._send_model()
            data = self._data
            for name, values in self._state.items():
                getattr(data, name).assign(values.astype(np.float32))
            name = "actuator_biasprm"
            bias = self._expanded[name] if name in self._expanded else self.world.model.actuator_biasprm[None]
            data.ctrl.assign(self._translation.inputs(self.field("ctrl"), bias).astype(np.float32))
            self._run(substeps)
            for name, values in self._state.items():
                values[:] = getattr(data, name).numpy()
            self._time += substeps * self.world.model.opt.timestep
            for name, (_, read) in self._derived.items():
                read[:] = getattr(data, name).numpy().reshape(read.shape)
        return np.zeros(0, dtype=np.intp)

    def _run(self, substeps: int) -> None:
        """Make time steps; on a GPU as a graph that is recorded once."""
        if not self._device.is_cuda:
            self._step(substeps)
            return
        if self._graph is None or self._graph[0] != substeps:
            self._step(substeps)  # compiles, and must not be recorded
            for name, values in self._state.items():
                getattr(self._data, name).assign(values.astype(np.float32))
            with wp.ScopedCapture() as capture:
                self._step(substeps)
            self._graph = substeps, capture.graph
        wp.capture_launch(self._graph[1])

    def _step(self, substeps: int) -> None:
        for _ in range(substeps):
            mjw.step(self._model, self._data)
        if self._stage >= int(mujoco.mjtStage.mjSTAGE_POS):
            mjw.kinematics(self._model, self._data)
            mjw.com_pos(self._model, self._data)
        if self._stage >= int(mujoco.mjtStage.mjSTAGE_VEL):
            mjw.com_vel(self._model, self._data)

    def _is_warned(self) -> bool:
        return False
