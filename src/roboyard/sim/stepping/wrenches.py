"""External forces, which act during one step."""

from __future__ import annotations

from typing import Any

import numpy as np

from roboyard._arrays import ArrayLike
from roboyard.errors import RoboyardError
from roboyard.sim.body import Body
from roboyard.sim.engine import Engine
from roboyard.sim.joint import Joint
from roboyard.sim.link import Link
from roboyard.transforms import rotate


class Wrenches:
    """External forces on links and joints during the next step."""

    def __init__(self, world: Engine[Body]) -> None:
        self._world = world
        self.pending = False
        """Whether an external force acts in the next step."""
        self.pushed = False
        """Whether it acts on a link, by MuJoCo's `xfrc_applied`."""
        self._viewed: Any = None
        self._efforts: Any = None
        """MuJoCo's efforts of all degrees of freedom as plain numbers, and the data whose they are."""
        self._arrays: tuple[np.ndarray, np.ndarray] = np.zeros((0, 6)), np.zeros(0)
        self.of_last_push: tuple[float, np.ndarray] | None = None
        """Simulated time after the last step with external forces, and (nbody, 6) forces and torques."""

    def add(
        self, link: Link, force: ArrayLike, torque: ArrayLike, point: ArrayLike | None, local: bool
    ) -> None:
        """Add a force and a torque on a link; see `Link.apply_wrench`.

        Args:
            link: the link.
            force: (3,) (N).
            torque: (3,) (N m).
            point: (3,) where the force acts (m); None for the centre of mass.
            local: whether these are in the link frame instead of the world frame.
        """
        data = self._world.kinematics()
        row = link.body.mujoco_ids[link.index]
        f, t = np.asarray(force, dtype=float), np.asarray(torque, dtype=float)
        at = None if point is None else np.asarray(point, dtype=float)
        if not (np.isfinite(f).all() and np.isfinite(t).all() and (at is None or np.isfinite(at).all())):
            raise RoboyardError(
                f"link {link.name!r}: force, torque and point must be finite, got {f}, {t} and {at}"
            )
        if local:
            position, quaternion = link.pose
            f, t = rotate(quaternion, f), rotate(quaternion, t)
            at = None if at is None else position + rotate(quaternion, at)
        if at is not None:
            t = t + np.cross(at - data.xipos[row], f)
        data.xfrc_applied[row, :3] += f
        data.xfrc_applied[row, 3:] += t
        self.pending = self.pushed = True

    def add_joint_effort(self, joint: Joint, effort: float) -> None:
        """Add an effort (N m or N) on a joint of one degree of freedom, for one step."""
        if not np.isfinite(effort):
            raise RoboyardError(f"joint {joint.name!r}: an effort must be finite, got {effort}")
        self._world.ensure_compiled()
        self.add_effort(int(joint.body.dof_addresses[joint.index]), effort)

    def add_effort(self, dof: int, effort: float) -> None:
        """Add a finite effort (N m or N) to one of MuJoCo's degrees of freedom; the world is compiled."""
        if self._viewed is not self._world.live_data:
            self._look_up()
        self._efforts[dof] += effort
        self.pending = True

    def find(self) -> None:
        """Note which forces MuJoCo's arrays hold, after they were written in other ways."""
        data = self._world.live_data
        self.pushed = bool(data.xfrc_applied.any())
        self.pending = self.pushed or bool(data.qfrc_applied.any())

    def clear(self, *, drag: bool = False) -> None:
        """Clear all external forces.

        Args:
            drag: whether MuJoCo's forces on links have drag in them.
        """
        if self._viewed is not self._world.live_data:
            self._look_up()
        wrenches, efforts = self._arrays
        if self.pushed:
            self.of_last_push = (self._world.time, wrenches.copy())
        if self.pushed or drag:
            wrenches.fill(0.0)
        if self.pending:
            efforts.fill(0.0)
            self.pending = self.pushed = False

    def _look_up(self) -> None:
        data = self._world.live_data
        self._viewed, self._arrays = data, (data.xfrc_applied, data.qfrc_applied)
        self._efforts = data.qfrc_applied.data
