"""Bodies and robots of n environments as arrays with n rows; all poses are in the world frame."""

from __future__ import annotations

from collections.abc import Iterable
from functools import cached_property

import mujoco
import numpy as np

from roboyard.envs.batch_physics import BatchPhysics
from roboyard.errors import ConfigError, unknown_name
from roboyard.robots.definition.schema import VIRTUAL_JOINTS
from roboyard.robots.robot import Robot
from roboyard.sim.body import Body
from roboyard.sim.link import Link
from roboyard.transforms import Array, conjugate, from_wxyz, multiply, rotate, to_wxyz


class LinkArrays:
    """One link in n environments."""

    def __init__(self, physics: BatchPhysics, row: int) -> None:
        """Create the arrays of a row of MuJoCo's bodies."""
        self._physics = physics
        self.row = row
        """Row in MuJoCo's arrays of bodies."""
        self.root = int(physics.world.model.body_rootid[row])
        """Row of its tree's first body; MuJoCo's velocities and axes are about the tree's centre of mass."""
        physics.field("xpos")

    @property
    def position(self) -> Array:
        """(n, 3) position (m)."""
        return self._physics.field("xpos")[:, self.row]

    @property
    def quaternion(self) -> Array:
        """(n, 4) orientation x, y, z, w."""
        return from_wxyz(self._physics.field("xquat")[:, self.row])

    @property
    def angular_velocity(self) -> Array:
        """(n, 3) angular velocity in world axes (rad/s)."""
        return self._physics.field("cvel")[:, self.row, :3]

    @property
    def linear_velocity(self) -> Array:
        """(n, 3) velocity of the link frame's origin in world axes (m/s)."""
        cvel = self._physics.field("cvel")[:, self.row]
        # MuJoCo gives velocities at the centre of mass of the whole tree
        lever = self.position - self._physics.field("subtree_com")[:, self.root]
        return cvel[:, 3:] + np.cross(cvel[:, :3], lever)

    def moves_with(self) -> np.ndarray:
        """(nv,) whether the link moves with each of MuJoCo's degrees of freedom."""
        model = self._physics.world.model
        found, row = np.zeros(model.nv, dtype=bool), self.row
        while row > 0:
            first, count = int(model.body_dofadr[row]), int(model.body_dofnum[row])
            found[first : first + count] = count > 0
            row = int(model.body_parentid[row])
        return found

    def jacobian(self, dofs: np.ndarray) -> tuple[Array, Array]:
        """Return the Jacobians of the frame's origin and of its orientation, in world axes.

        Args:
            dofs: (k,) of MuJoCo's degrees of freedom, with each of which the link moves.

        Returns:
            (n, 3, k) of the position (m/rad or m/m), (n, 3, k) of the orientation (rad/rad or rad/m).
        """
        axes = self._physics.field("cdof")[:, dofs].transpose(2, 0, 1)
        ax, ay, az = axes[0], axes[1], axes[2]
        lever = (self.position - self._physics.field("subtree_com")[:, self.root])[:, :, None]
        x, y, z = lever[:, 0], lever[:, 1], lever[:, 2]
        linear = np.stack(
            [axes[3] + ay * z - az * y, axes[4] + az * x - ax * z, axes[5] + ax * y - ay * x], axis=1
        )
        return linear, np.stack([ax, ay, az], axis=1)

    def to_local(self, vector: Array) -> Array:
        """Return (n, 3) vectors given in world axes in the link's own axes."""
        return rotate(conjugate(self.quaternion), vector)


class BodyArrays:
    """A body in n environments: pose of its root link, and joints."""

    def __init__(self, physics: BatchPhysics, body: Body) -> None:
        """Create the arrays of a body of the physics' world."""
        self.physics = physics
        self.body = body
        model = physics.world.model
        self.joint_names: tuple[str, ...] = tuple(body.joint_names)
        order = [body.joint(name).index for name in self.joint_names]
        self.qpos_addresses = np.asarray(body.qpos_addresses)[order].astype(np.int64)
        """(j,) where the joints are in MuJoCo's positions."""
        self.qpos = as_slice(self.qpos_addresses)
        """The same, as a slice where they are side by side."""
        self.dofs = as_slice(np.asarray(body.dof_addresses)[order].astype(np.intp))
        """Where the joints are in MuJoCo's velocities."""
        self._links: dict[str, LinkArrays] = {}
        root = int(body.mujoco_ids[0])
        first = int(model.body_jntadr[root])
        is_free = first >= 0 and model.jnt_type[first] == int(mujoco.mjtJoint.mjJNT_FREE)
        self._free = (int(model.jnt_qposadr[first]), int(model.jnt_dofadr[first])) if is_free else None

    @property
    def is_free(self) -> bool:
        """Whether the root link moves freely."""
        return self._free is not None

    def link(self, name: str) -> LinkArrays:
        """Return the arrays of a link.

        Raises:
            RoboyardError: there is none; the message lists the nearest.
        """
        if name not in self._links:
            self._links[name] = self._link_arrays(self.body.link(name))
        return self._links[name]

    def _link_arrays(self, link: Link) -> LinkArrays:
        return LinkArrays(self.physics, int(self.body.mujoco_ids[link.index]))

    @cached_property
    def root(self) -> LinkArrays:
        """The root link."""
        return self._link_arrays(self.body.links[0])

    @property
    def position(self) -> Array:
        """(n, 3) position of the root link (m)."""
        return self.root.position

    @property
    def quaternion(self) -> Array:
        """(n, 4) orientation x, y, z, w of the root link."""
        return self.root.quaternion

    @property
    def linear_velocity(self) -> Array:
        """(n, 3) velocity of the root link in world axes (m/s)."""
        return self.root.linear_velocity

    @property
    def angular_velocity(self) -> Array:
        """(n, 3) angular velocity of the root link in world axes (rad/s)."""
        return self.root.angular_velocity

    @property
    def q(self) -> Array:
        """(n, j) joint positions in the order of `joint_names` (rad or m)."""
        return self.physics.field("qpos")[:, self.qpos]

    @property
    def v(self) -> Array:
        """(n, j) joint velocities (rad/s or m/s)."""
        return self.physics.field("qvel")[:, self.dofs]

    def indices_of(self, names: Iterable[str]) -> np.ndarray:
        """Return (k,) indices of joints in `joint_names`.

        Raises:
            ConfigError: there is none of a name; the message lists the nearest.
        """
        found = []
        for name in names:
            if name not in self.joint_names:
                raise ConfigError(f"{self.body.name}: {unknown_name('joint', name, self.joint_names)}")
            found.append(self.joint_names.index(name))
        return np.array(found, dtype=np.intp)

    def set_pose(self, rows: np.ndarray, position: Array, quaternion: Array | None = None) -> None:
        """Move the root link of a free body, at the start of an episode; it is then at rest.

        Args:
            rows: (k,) environments.
            position: (3,) or (k, 3) (m).
            quaternion: (4,) or (k, 4) x, y, z, w; as in the start state by default.

        Raises:
            ConfigError: the body is fixed.
        """
        if self._free is None:
            raise ConfigError(f"{self.body.name!r} is fixed to the world and cannot start elsewhere")
        at, dof = self._free
        qpos = self.physics.field("qpos")
        qpos[rows, at : at + 3] = position
        if quaternion is not None:
            qpos[rows, at + 3 : at + 7] = to_wxyz(quaternion)
        self.physics.field("qvel")[rows, dof : dof + 6] = 0.0

    def set_velocity(self, rows: np.ndarray, linear: Array, angular: Array | None = None) -> None:
        """Set the velocity of a free body's root link.

        Args:
            rows: (k,) environments.
            linear: (3,) or (k, 3) in world axes (m/s).
            angular: (3,) or (k, 3) in the link's axes (rad/s); 0 by default.

        Raises:
            ConfigError: the body is fixed.
        """
        if self._free is None:
            raise ConfigError(f"{self.body.name!r} is fixed to the world and cannot move")
        dof = self._free[1]
        velocity = self.physics.field("qvel")
        velocity[rows, dof : dof + 3] = linear
        velocity[rows, dof + 3 : dof + 6] = 0.0 if angular is None else angular

    def set_joints(self, rows: np.ndarray, q: Array, v: Array | float = 0.0) -> None:
        """Move joints at once, at the start of an episode.

        Args:
            rows: (k,) environments.
            q: (j,) or (k, j) positions (rad or m).
            v: (j,) or (k, j) velocities (rad/s or m/s).
        """
        columns, dofs = self.qpos_addresses, _columns(self.dofs)
        self.physics.field("qpos")[np.ix_(rows, columns)] = q
        self.physics.field("qvel")[np.ix_(rows, dofs)] = v


class RobotArrays(BodyArrays):
    """A robot in n environments."""

    def __init__(self, physics: BatchPhysics, robot: Robot) -> None:
        """Create the arrays of a robot of the physics' world."""
        super().__init__(physics, robot.body)
        self.robot = robot
        self.rest = robot.joint_positions
        """(j,) joint positions in which the world builder left the robot (rad or m)."""
        self.lower, self.upper = robot.limits.lower, robot.limits.upper
        """(j,) position limits (rad or m), infinite for none."""
        if tuple(robot.joint_names) != self.joint_names:
            raise ConfigError(f"robot {robot.name!r} has joints with several degrees of freedom")
        self._base = self._link_arrays(robot.base_link)
        self._virtual = self.indices_of([n for n in VIRTUAL_JOINTS if n in self.joint_names])

    @property
    def base(self) -> LinkArrays:
        """The robot's base frame."""
        return self._base

    def tip(self, arm: str = "default") -> LinkArrays:
        """Return the arrays of an arm's end effector.

        Args:
            arm: its name ("left"); the first by default.

        Raises:
            ConfigError: the robot has no arm.
            RoboyardError: there is no arm of this name.
        """
        manipulation = self.robot.manipulation
        if manipulation is None:
            raise ConfigError(f"robot {self.robot.name!r} has no arm")
        return self.link(manipulation.eef_links[manipulation.arm(arm)].name)

    def gravity_in_base(self) -> Array:
        """(n, 3) direction of gravity in the base's axes, (0, 0, -1) where it is level."""
        return self.base.to_local(np.array([0.0, 0.0, -1.0]))

    def set_base(self, rows: np.ndarray, x: Array, y: Array, yaw: Array) -> None:
        """Move a mobile robot on its floor, at the start of an episode.

        Args:
            rows: (k,) environments.
            x: (k,) shift from where it was put, in world axes (m).
            y: (k,) likewise (m).
            yaw: (k,) turn about the vertical (rad).

        Raises:
            ConfigError: the base is fixed.
        """
        qpos = self.physics.field("qpos")
        if len(self._virtual):
            columns = self.qpos_addresses[self._virtual]
            qpos[rows, columns[0]], qpos[rows, columns[1]], qpos[rows, columns[5]] = x, y, yaw
            return
        if self._free is None:
            raise ConfigError(f"robot {self.robot.name!r} has a fixed base and cannot start elsewhere")
        at = self._free[0]
        start = self.physics.start_qpos[at : at + 7]
        half = np.asarray(yaw) / 2
        zero = np.zeros_like(half)
        turn = np.stack([zero, zero, np.sin(half), np.cos(half)], axis=-1)
        quaternion = multiply(turn, np.broadcast_to(from_wxyz(start[3:]), turn.shape))
        position = np.stack([start[0] + x, start[1] + y, np.full_like(half, start[2])], axis=-1)
        self.set_pose(rows, position, quaternion)


def as_slice(indices: np.ndarray) -> slice | np.ndarray:
    """Return consecutive indices (k,) as a slice, whose arrays are views; others as they are."""
    if len(indices) and (np.diff(indices) == 1).all():
        return slice(int(indices[0]), int(indices[-1]) + 1)
    return indices


def _columns(where: slice | np.ndarray) -> np.ndarray:
    return np.arange(where.start, where.stop) if isinstance(where, slice) else where
