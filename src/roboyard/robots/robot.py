"""A robot in a world: one class for all, with the capabilities that its definition's blocks give it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from roboyard.errors import ConfigError, RoboyardError, StaleHandleError, unknown_name
from roboyard.poses import Array, conjugate, normalized, rotate
from roboyard.robots import interfaces
from roboyard.robots.action_space import ActionSpace
from roboyard.robots.backends import Backend, as_backend, as_numpy
from roboyard.robots.control_loop import ControlLoop
from roboyard.robots.controller_setup import ControllerConfig, Group, Setup, make_groups
from roboyard.robots.controllers import Controller
from roboyard.robots.definition import VIRTUAL_JOINTS, RobotDefinition
from roboyard.robots.gains import firmness, motor_inertia
from roboyard.robots.groups import plan_groups
from roboyard.robots.joint_order import robot_joint_names
from roboyard.robots.joints import Indices, JointArrays
from roboyard.robots.limits import joint_limits
from roboyard.robots.postures import ResetMode, reset_posture
from roboyard.sim.body import Body
from roboyard.sim.link import Link
from roboyard.sim.world import World
from roboyard.urdf.model import RobotDescription

CONTROL_FREQUENCY = 30.0
"""Hz"""
SLIDES = 0.1
"""A link whose file gives it less friction than this slides on any floor (casters, skids)."""


class Robot:
    """A body with controllers. Joint vectors are in `joint_names` order: level by level from the root.

    Values come as NumPy arrays, or as torch tensors with `backend="torch"`. Actions are applied at the next
    time step of the world and their goals held until the next action.
    """

    def __init__(
        self,
        body: Body,
        definition: RobotDefinition,
        description: RobotDescription,
        *,
        controllers: ControllerConfig | None = None,
        control_freq: float | None = None,
        action_normalize: bool = True,
        reset_joint_pos: ArrayLike | None = None,
        default_reset_mode: ResetMode = "untuck",
        model: str = "",
        backend: Backend = "numpy",
    ) -> None:
        """Take over a body; `roboyard.robots.add_robot` is how users get here."""
        if default_reset_mode not in ("tuck", "untuck"):
            raise ConfigError(f'default_reset_mode: must be "tuck" or "untuck"; got {default_reset_mode!r}')
        self.body = body
        self.definition = definition
        self.description = description
        self.model = model
        """Name of the robot's kind; `name` is the name in the world."""
        self.backend: Backend = backend
        self.joints = JointArrays(body, robot_joint_names(description))
        self.limits = joint_limits(self.joints)
        base = definition.base_footprint_link_name
        self.base_link: Link = body.links[0] if base is None else body.link(base)
        """The link whose frame is the robot's base frame."""
        posture = reset_posture(definition, self.joint_names, given=reset_joint_pos, mode=default_reset_mode)
        self.has_reset_pose = posture is not None
        """Whether anyone says where the joints rest; otherwise they start nearest to zero."""
        if posture is None:
            posture = np.zeros(len(self.joint_names))
        self._reset_posture = np.clip(posture, self.limits.lower, self.limits.upper)
        self._action_normalize = action_normalize
        self._control_frequency = CONTROL_FREQUENCY if control_freq is None else float(control_freq)
        self._add_interfaces()
        self.loop = self._make_loop(controllers or {})
        self.world.before_step.append(self._before_step)
        self._add_motor_inertia()
        self._put_into(self.keeping_base(self._reset_posture))

    def _add_motor_inertia(self) -> None:
        """Give fingers and legs the inertia of their motors, where nobody gave them any."""
        block = self.definition.manipulation
        names = [name for finger in (block.finger_joint_names if block else {}).values() for name in finger]
        if self.locomotion is not None and self.two_wheel is None and self.definition.holonomic_base is None:
            names += self.locomotion.joint_names
        for place in self.joints.places(names):
            joint = self.joints.joints[place]
            if joint.armature == 0.0:
                is_slide = np.array([joint.type == "prismatic"])
                firm = firmness(self.limits.effort[[place]], is_slide)
                joint.armature = float(motor_inertia(firm)[0])

    def _add_interfaces(self) -> None:
        definition, block = self.definition, self.definition.manipulation
        self.manipulation = None if block is None else interfaces.Manipulation(self, block)
        locomotion, trunk, camera = (
            definition.locomotion,
            definition.articulated_trunk,
            definition.active_camera,
        )
        self.locomotion: interfaces.Locomotion | None = None
        if locomotion is not None:
            floor = locomotion.floor_touching_base_link_names
            self.locomotion = interfaces.Locomotion(self, locomotion.base_joint_names, floor)
        self.trunk: interfaces.ArticulatedTrunk | None = None
        if trunk is not None:
            self.trunk = interfaces.ArticulatedTrunk(self, "trunk", trunk.trunk_joint_names)
        self.camera: interfaces.ActiveCamera | None = None
        if camera is not None:
            self.camera = interfaces.ActiveCamera(self, "camera", camera.camera_joint_names)
        self.two_wheel: interfaces.TwoWheel | None = None
        if definition.two_wheel is not None:
            self.two_wheel = interfaces.TwoWheel(self, definition.two_wheel)
        self.mobile_manipulation: interfaces.MobileManipulation | None = None
        if definition.mobile_manipulation is not None:
            self.mobile_manipulation = interfaces.MobileManipulation(self)
        if definition.holonomic_base is not None:
            self.base: interfaces.FixedBase = interfaces.HolonomicBase(self)
            for link in self.locomotion.floor_touching_links if self.locomotion is not None else ():
                link.glide()
            return
        self.base = interfaces.FixedBase(self) if self.body.is_fixed else interfaces.FloatingBase(self)
        if self.two_wheel is not None and self.locomotion is not None:
            driven = {joint.child.name for joint in map(self.body.joint, self.locomotion.joint_names)}
            for link in self.locomotion.floor_touching_links:
                if link.name not in driven:
                    link.glide()
        for link in self.description.links:
            given = link.contact.lateral_friction if link.contact is not None else None
            if given is not None and given < SLIDES:
                self.body.link(link.name).glide(given)

    def __repr__(self) -> str:
        return (
            f"<Robot {self.name!r}: {len(self.joint_names)} joints, groups "
            f"{', '.join(self.groups) or 'none'}>"
        )

    @property
    def name(self) -> str:
        """Name in the world."""
        return self.body.name

    @property
    def world(self) -> World:
        return self.body.world

    @property
    def capabilities(self) -> tuple[str, ...]:
        """Blocks of the definition that are there."""
        return self.definition.capabilities

    # ------------------------------------------------------------------------------------------ controllers

    def _make_loop(self, config: ControllerConfig) -> ControlLoop:
        child_of = {joint.name: joint.child for joint in self.description.joints}
        setup = Setup(
            definition=self.definition,
            description=self.description,
            joint_names=self.joint_names,
            limits=self.limits,
            base_link=self.base_link.name,
            reset_posture=self._reset_posture if self.has_reset_pose else None,
            action_normalize=self._action_normalize,
            scale=self.body.scale,
        )
        groups = make_groups(setup, plan_groups(self.definition, child_of), config)
        steps = 1.0 / (self._control_frequency * self.world.timestep)
        if not 0.5 <= steps < 1e6:
            raise ConfigError(
                f"control_freq: {self._control_frequency:g} Hz does not fit time steps of "
                f"{self.world.timestep:g} s"
            )
        return ControlLoop(
            self.joints, self.limits, groups, rest=self._reset_posture, steps_per_control=max(1, round(steps))
        )

    def _before_step(self) -> None:
        if self.body.is_removed:
            return
        self.loop.before_step()

    def remove(self) -> None:
        """Take the robot out of its world."""
        world = self.world
        if self._before_step in world.before_step:
            world.before_step.remove(self._before_step)
        world.remove(self.body)

    @property
    def groups(self) -> Mapping[str, Group]:
        """Group name to its joints and controller, in action order."""
        return self.loop.groups

    @property
    def controllers(self) -> Mapping[str, Controller]:
        """Group name to controller, in action order."""
        return {name: group.controller for name, group in self.groups.items()}

    @property
    def control_idx(self) -> dict[str, Indices]:
        """Group name to the places of its joints in joint vectors."""
        found = {name: group.places for name, group in self.groups.items()}
        if self.manipulation is not None and "combined" in self.manipulation.arm_control_idx:
            found["combined"] = self.manipulation.arm_control_idx["combined"]
        return found

    @property
    def control_freq(self) -> float:
        """Hz: how often goals become drive targets."""
        return 1.0 / self.loop.dt

    @property
    def steps_per_control(self) -> int:
        """Time steps of the world for each control step."""
        return self.loop.steps_per_control

    def reload_controllers(self, controllers: ControllerConfig | None = None) -> None:
        """Make all controllers anew, from the definition's defaults and these keys.

        Args:
            controllers: group to a controller's name or to its keys.

        Raises:
            ConfigError: a group, controller or key does not exist or does not fit.
        """
        self.loop = self._make_loop(controllers or {})

    # ---------------------------------------------------------------------------------------------- actions

    @property
    def action_dim(self) -> int:
        """Numbers in an action."""
        return sum(controller.command_dim for controller in self.controllers.values())

    @property
    def controller_action_idx(self) -> dict[str, slice]:
        """Group name to its numbers in an action."""
        found, start = {}, 0
        for name, controller in self.controllers.items():
            found[name] = slice(start, start + controller.command_dim)
            start += controller.command_dim
        return found

    @property
    def action_space(self) -> ActionSpace:
        """The box that actions lie in."""
        low, high = [], []
        for controller in self.controllers.values():
            scaling, size = controller.scaling, controller.command_dim
            low.append(np.full(size, -np.inf) if scaling.low is None else scaling.low)
            high.append(np.full(size, np.inf) if scaling.high is None else scaling.high)
        empty = np.zeros(0)
        return ActionSpace(
            low=np.concatenate([empty, *low]),
            high=np.concatenate([empty, *high]),
            slices=self.controller_action_idx,
        )

    def apply_action(self, action: ArrayLike | Mapping[str, ArrayLike]) -> None:
        """Give every group its goal; the robot acts on it from the next time step on.

        Args:
            action: (action_dim,) in group order, or commands by group (others keep their goals).

        Raises:
            RoboyardError: the length does not fit, a group is unknown, or a number is not finite.
        """
        if self.body.is_removed:
            raise StaleHandleError(f"robot {self.name!r} was removed from its world")
        commands = action if isinstance(action, Mapping) else self._split(action)
        for name in commands:
            if name not in self.groups:
                raise RoboyardError(f"robot {self.name!r}: {unknown_name('group', str(name), self.groups)}")
        for name, command in commands.items():
            group = self.groups[name]
            group.controller.update_goal(as_numpy(command), self.loop.state_of(group))
        self.loop.make_due()

    def _split(self, action: Any) -> dict[str, Array]:
        values = np.asarray(as_numpy(action), dtype=float)
        if values.shape != (self.action_dim,):
            parts = ", ".join(f"{n} {c.command_dim}" for n, c in self.controllers.items())
            raise RoboyardError(
                f"robot {self.name!r}: an action has {self.action_dim} numbers ({parts}); got shape "
                f"{values.shape}"
            )
        return {name: values[part] for name, part in self.controller_action_idx.items()}

    def no_op_action(self) -> Array:
        """(action_dim,) the action that leaves every goal as it is."""
        parts = [g.controller.noop_command(self.loop.state_of(g)) for g in self.groups.values()]
        return np.concatenate([np.zeros(0), *parts])

    # ------------------------------------------------------------------------------------------------- joints

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Names of the joints of one degree of freedom: the order of every vector here."""
        return self.joints.names

    @property
    def n_dof(self) -> int:
        """Length of joint vectors."""
        return len(self.joint_names)

    @property
    def joint_lower_limits(self) -> Array:
        """(n,) rad or m, -inf for none"""
        return self.limits.lower.copy()

    @property
    def joint_upper_limits(self) -> Array:
        """(n,) rad or m, inf for none"""
        return self.limits.upper.copy()

    def get_joint_positions(self, *, normalized: bool = False, backend: Backend | None = None) -> Any:
        """(n,) rad or m; `normalized` to -1..1 between limits (joints without limits stay as they are)."""
        q = self.joints.q
        if normalized:
            bounded = np.isfinite(self.limits.lower) & np.isfinite(self.limits.upper)
            lower, upper = (
                np.where(bounded, self.limits.lower, -1.0),
                np.where(bounded, self.limits.upper, 1.0),
            )
            q = np.where(upper > lower, (2 * q - upper - lower) / np.maximum(upper - lower, 1e-12), 0.0)
        return self._given(q, backend)

    def get_joint_velocities(self, *, normalized: bool = False, backend: Backend | None = None) -> Any:
        """(n,) rad/s or m/s; `normalized` by the velocity limits."""
        v = self.joints.v
        return self._given(v / self.limits.velocity if normalized else v, backend)

    def get_joint_efforts(self, *, normalized: bool = False, backend: Backend | None = None) -> Any:
        """(n,) N m or N that the drives applied in the last step; `normalized` by the effort limits."""
        efforts = self.joints.efforts
        return self._given(efforts / self.limits.effort if normalized else efforts, backend)

    def set_joint_positions(self, positions: ArrayLike, indices: ArrayLike | None = None) -> None:
        """Jump to joint positions, at rest; goals are forgotten.

        Args:
            positions: (n,) or one for each of `indices`; rad or m. Values beyond limits are brought to them.
            indices: places of the joints; all by default.
        """
        q = self._with(self.joints.q, positions, indices, "joint positions")
        self._put_into(np.clip(q, self.limits.lower, self.limits.upper))

    def set_joint_velocities(self, velocities: ArrayLike, indices: ArrayLike | None = None) -> None:
        """Give joints a velocity; rad/s or m/s."""
        self.joints.v = self._with(self.joints.v, velocities, indices, "joint velocities")

    def _with(self, values: Array, given: ArrayLike, indices: ArrayLike | None, what: str) -> Array:
        wanted = np.asarray(as_numpy(given), dtype=float)
        where = slice(None) if indices is None else np.asarray(as_numpy(indices), dtype=np.intp)
        shape = values[where].shape
        if wanted.shape not in ((), shape) or not np.isfinite(wanted).all():
            raise RoboyardError(
                f"robot {self.name!r}: {what} take {shape[0]} finite numbers; got shape {wanted.shape}"
            )
        out = values.copy()
        out[where] = wanted
        return out

    def _put_into(self, q: Array) -> None:
        self.joints.q = q
        self.joints.v = np.zeros(len(q))
        self.loop.invalidate()

    def keeping_base(self, posture: Array) -> Array:
        """A posture with the virtual base joints (and wheels) as they are now."""
        out = posture.copy()
        kept = [name for name in VIRTUAL_JOINTS if name in self.joints.index]
        if self.definition.two_wheel is not None and self.locomotion is not None:
            kept += self.locomotion.joint_names
        places = self.joints.places(kept)
        out[places] = self.joints.q[places]
        return out

    def _given(self, values: Array, backend: Backend | None) -> Any:
        return as_backend(values, backend or self.backend)

    # --------------------------------------------------------------------------------------------- postures

    @property
    def reset_joint_pos(self) -> Array:
        """(n,) posture that `reset` puts the joints into."""
        return self._reset_posture.copy()

    def reset(self) -> None:
        """Put the joints into the reset posture, at rest; the base stays where it is. Goals are forgotten."""
        self._put_into(self.keeping_base(self._reset_posture))
        if not self.body.is_fixed:
            self.body.set_velocity(np.zeros(3), np.zeros(3))

    def tuck(self) -> None:
        """Jump into the tucked posture.

        Raises:
            RoboyardError: the definition has no `mobile_manipulation`.
        """
        self._need_postures().tuck()

    def untuck(self) -> None:
        """Jump into the untucked posture; raises as `tuck`."""
        self._need_postures().untuck()

    def _need_postures(self) -> interfaces.MobileManipulation:
        if self.mobile_manipulation is None:
            raise RoboyardError(
                f"robot {self.name!r} has no tucked posture; add a mobile_manipulation block to its "
                f"definition"
            )
        return self.mobile_manipulation

    def keep_still(self) -> None:
        """Stop all motion."""
        self.joints.v = np.zeros(self.n_dof)
        if not self.body.is_fixed:
            self.body.set_velocity(np.zeros(3), np.zeros(3))

    # ------------------------------------------------------------------------------------------------- place

    def get_position_orientation(self, *, backend: Backend | None = None) -> tuple[Any, Any]:
        """Position (3,) m and quaternion (4,) x, y, z, w of the base frame in the world."""
        position, quaternion = self.base_link.pose
        return self._given(position, backend), self._given(quaternion, backend)

    def set_position_orientation(
        self, position: ArrayLike | None = None, orientation: ArrayLike | None = None
    ) -> None:
        """Put the base frame somewhere; the joints stay, goals are forgotten."""
        here, turned = self.base_link.pose
        xyz = here if position is None else np.asarray(as_numpy(position), dtype=float)
        quaternion = turned if orientation is None else normalized(as_numpy(orientation))
        if xyz.shape != (3,) or quaternion.shape != (4,) or not (np.isfinite(xyz).all()):
            raise RoboyardError(f"robot {self.name!r}: a position has 3 finite numbers, an orientation 4")
        self.base.set_pose(xyz, quaternion)
        self.loop.invalidate()

    def get_linear_velocity(self, *, backend: Backend | None = None) -> Any:
        """(3,) m/s of the base frame's origin, in world axes."""
        return self._given(self.base_link.velocity[0], backend)

    def get_angular_velocity(self, *, backend: Backend | None = None) -> Any:
        """(3,) rad/s of the base frame, in world axes."""
        return self._given(self.base_link.velocity[1], backend)

    def get_relative_velocity(self) -> tuple[Array, Array]:
        """Linear (3,) m/s and angular (3,) rad/s velocity of the base in its own axes."""
        back = conjugate(self.base_link.pose[1])
        linear, angular = self.base_link.velocity
        return rotate(back, linear), rotate(back, angular)

    # -------------------------------------------------------------------------------------------------- arms

    @property
    def arm_names(self) -> tuple[str, ...]:
        return self.manipulation.arm_names if self.manipulation is not None else ()

    def _need_arms(self) -> interfaces.Manipulation:
        if self.manipulation is None:
            raise RoboyardError(
                f"robot {self.name!r} has no arms; add a manipulation block to its definition"
            )
        return self.manipulation

    def get_eef_pose(
        self, arm: str = "default", *, frame: str = "world", backend: Backend | None = None
    ) -> tuple[Any, Any]:
        """Position (3,) m and quaternion (4,) x, y, z, w of an end effector, in the "world" or "base"
        frame.
        """
        position, quaternion = self._need_arms().eef_pose(arm, frame=frame)
        return self._given(position, backend), self._given(quaternion, backend)

    def get_eef_position(self, arm: str = "default", *, backend: Backend | None = None) -> Any:
        """(3,) m, in the world."""
        return self.get_eef_pose(arm, backend=backend)[0]

    def get_eef_orientation(self, arm: str = "default", *, backend: Backend | None = None) -> Any:
        """(4,) x, y, z, w, in the world."""
        return self.get_eef_pose(arm, backend=backend)[1]

    def get_relative_eef_pose(
        self, arm: str = "default", *, backend: Backend | None = None
    ) -> tuple[Any, Any]:
        """Pose of an end effector in the robot's base frame."""
        return self.get_eef_pose(arm, frame="base", backend=backend)

    def is_grasping(self, arm: str = "default") -> bool | None:
        """Whether a gripper holds something; None where that cannot be told."""
        return self._need_arms().is_grasping(arm)

    # --------------------------------------------------------------------------------------- proprioception

    def get_proprioception(
        self, keys: tuple[str, ...] | None = None, *, backend: Backend | None = None
    ) -> tuple[Any, dict[str, Any]]:
        """What the robot feels: a vector of the keys asked for, and everything by key.

        Args:
            keys: what goes into the vector; `default_proprioception` by default.
            backend: "numpy" or "torch".

        Raises:
            RoboyardError: a key does not exist.
        """
        from roboyard.robots.proprioception import proprioception

        return proprioception(self, keys, backend or self.backend)

    @property
    def default_proprioception(self) -> tuple[str, ...]:
        """Keys that are observed where nobody asks for others."""
        from roboyard.robots.proprioception import default_keys

        return default_keys(self)
