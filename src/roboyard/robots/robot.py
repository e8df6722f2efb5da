"""A robot in a world: one class for all, with the capabilities that its definition's blocks give it."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from roboyard.description.model import RobotDescription
from roboyard.errors import ConfigError, RoboyardError, StaleHandleError, unknown_name
from roboyard.robots import capabilities
from roboyard.robots.backends import Backend, as_numpy
from roboyard.robots.configure_body import configure
from roboyard.robots.control import Controller
from roboyard.robots.control.action_space import ActionSpace
from roboyard.robots.control.control_loop import ControlLoop
from roboyard.robots.control.setup import ControllerConfig, Group, Setup, make_groups
from roboyard.robots.definition.groups import plan_groups
from roboyard.robots.definition.postures import ResetMode, reset_posture
from roboyard.robots.definition.schema import RobotDefinition
from roboyard.robots.joint_arrays import Indices
from roboyard.robots.robot_body import RobotBody
from roboyard.robots.sensor_set import SensorOptions, SensorSet
from roboyard.robots.stability.support_polygon import support_polygon_of
from roboyard.sim.body import Body
from roboyard.transforms import Array

CONTROL_FREQUENCY = 30.0
"""Hz"""


class Robot(RobotBody, SensorSet):
    """A body with controllers. Actions are applied at the next time step of the world and their goals held
    until the next action.
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
        sensor_file: Path | None = None,
        sensor_options: SensorOptions | None = None,
    ) -> None:
        """Take over a body; `roboyard.robots.add_robot` is how users get here."""
        if default_reset_mode not in ("tuck", "untuck"):
            raise ConfigError(f'default_reset_mode: must be "tuck" or "untuck"; got {default_reset_mode!r}')
        super().__init__(body, definition, description, model=model, backend=backend)
        configure(self)
        posture = reset_posture(definition, self.joint_names, given=reset_joint_pos, mode=default_reset_mode)
        self.has_reset_pose = posture is not None
        """Whether anyone says where the joints rest; otherwise they start nearest to zero."""
        if posture is None:
            posture = np.zeros(len(self.joint_names))
        self._reset_posture = np.clip(posture, self.limits.lower, self.limits.upper)
        self._action_normalize = action_normalize
        self._control_frequency = CONTROL_FREQUENCY if control_freq is None else float(control_freq)
        self.loop = self._make_loop(controllers or {})
        self.world.before_step.append(self._before_step)
        self.set_joint_positions(self.keeping_base(self._reset_posture))
        self.have_senses(sensor_file, sensor_options or {})

    def __repr__(self) -> str:
        return (
            f"<Robot {self.name!r}: {len(self.joint_names)} joints, groups "
            f"{', '.join(self.groups) or 'none'}>"
        )

    def _repr_html_(self) -> str:
        from roboyard.robots.notebook import robot_html

        return robot_html(self)

    def _jumped(self) -> None:
        self.loop.invalidate()

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
            self.joints,
            self.limits,
            groups,
            rest=self._reset_posture,
            steps_per_control=max(1, round(steps)),
            support_polygon=support_polygon_of(self),
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

    # --------------------------------------------------------------------------------------------- postures

    @property
    def reset_joint_pos(self) -> Array:
        """(n,) posture that `reset` puts the joints into."""
        return self._reset_posture.copy()

    def reset(self) -> None:
        """Put the joints into the reset posture, at rest; the base stays where it is. Goals are forgotten."""
        self.set_joint_positions(self.keeping_base(self._reset_posture))
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

    def _need_postures(self) -> capabilities.MobileManipulation:
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
