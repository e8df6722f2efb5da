"""A robot in a world: a body with controllers and the capabilities that its definition gives it."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from roboyard._arrays import ArrayLike
from roboyard.description.model import RobotDescription
from roboyard.errors import ConfigError, RoboyardError, StaleHandleError, unknown_name
from roboyard.robots.body_setup import configure_body
from roboyard.robots.capabilities.assisted_grasp import MODES, GraspingMode
from roboyard.robots.control.action_space import ActionSpace
from roboyard.robots.control.control_loop import ControlLoop
from roboyard.robots.control.setup import ControllerConfig, Group, Setup, make_groups
from roboyard.robots.definition.groups import plan_groups
from roboyard.robots.definition.postures import ResetMode, reset_posture
from roboyard.robots.definition.schema import RobotDefinition
from roboyard.robots.robot_body import RobotBody
from roboyard.robots.sensor_set import ObsModalities, SensorOptions, SensorSet
from roboyard.robots.stability.stance import stance_of
from roboyard.robots.stability.support_polygon import support_polygon_of
from roboyard.sim.body import Body
from roboyard.transforms import Array

CONTROL_FREQUENCY = 30.0
"""Default rate of control steps (Hz)."""


class Robot(RobotBody, SensorSet):
    """A body with controllers. An action sets the controllers' goals from the next time step on; goals stay
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
        sensor_file: Path | None = None,
        sensor_options: SensorOptions | None = None,
        grasping_mode: GraspingMode = "physical",
        obs_modalities: ObsModalities = "all",
    ) -> None:
        """Create a robot from a body; `roboyard.robots.add_robot` also creates the body.

        Raises:
            ConfigError: an option is wrong, or does not fit the definition.
        """
        if default_reset_mode not in ("tuck", "untuck"):
            raise ConfigError(f'default_reset_mode must be "tuck" or "untuck", got {default_reset_mode!r}')
        super().__init__(body, definition, description, model=model)
        configure_body(self)
        posture = reset_posture(
            definition, description, self.joint_names, given=reset_joint_pos, mode=default_reset_mode
        )
        self.has_reset_pose = posture is not None
        """Whether the definition or the caller gives a reset posture; otherwise it is nearest to zero."""
        if posture is None:
            posture = np.zeros(len(self.joint_names))
        self._reset_posture = np.clip(posture, self.limits.lower, self.limits.upper)
        self._action_normalize = action_normalize
        self._control_frequency = CONTROL_FREQUENCY if control_freq is None else float(control_freq)
        self.loop = self._make_loop(controllers or {})
        """Applies the controllers before each time step."""
        self.world.before_step.append(self._before_step)
        self.joint_positions = self.with_present_base(self._reset_posture)
        self.mount_sensors(sensor_file, sensor_options or {}, obs_modalities)
        if grasping_mode not in MODES:
            raise ConfigError(f"grasping_mode: {unknown_name('mode', str(grasping_mode), MODES)}")
        if self.manipulation is not None:
            self.manipulation.set_grasping_mode(grasping_mode)

    def __repr__(self) -> str:
        return (
            f"<Robot {self.name!r}: {len(self.joint_names)} joints, groups "
            f"{', '.join(self.groups) or 'none'}>"
        )

    def _repr_html_(self) -> str:
        from roboyard.robots.notebook import robot_html

        return robot_html(self)

    def _on_jump(self) -> None:
        self.loop.invalidate()
        if self.manipulation is not None and self.manipulation.assisted_grasp is not None:
            self.manipulation.assisted_grasp.release()

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
                f"control_freq must be at most the time step rate ({1.0 / self.world.timestep:g} Hz), got "
                f"{self._control_frequency:g} Hz"
            )
        return ControlLoop(
            self.joint_arrays,
            self.limits,
            groups,
            rest=self._reset_posture,
            steps_per_control=max(1, round(steps)),
            free=self.guide_joints,
            support_polygon=support_polygon_of(self),
            stance=stance_of(self, self._reset_posture),
        )

    def _before_step(self) -> None:
        if self.body.is_removed:
            return
        self.loop.before_step()

    def remove(self) -> None:
        """Remove the robot from its world."""
        world = self.world
        if self._before_step in world.before_step:
            world.before_step.remove(self._before_step)
        world.remove(self.body)

    @property
    def groups(self) -> Mapping[str, Group]:
        """Group name to its joints and controller, in action order."""
        return self.loop.groups

    @property
    def control_freq(self) -> float:
        """Rate at which controllers compute drive targets (Hz)."""
        return 1.0 / self.loop.dt

    @property
    def steps_per_control(self) -> int:
        """Time steps of the world in one control step."""
        return self.loop.steps_per_control

    def reload_controllers(
        self, controllers: ControllerConfig | None = None, *, action_normalize: bool | None = None
    ) -> None:
        """Replace all controllers, from the definition's defaults and the given keys.

        Args:
            controllers: group to a controller's name, or to its keys.
            action_normalize: whether commands are in -1 to 1 instead of rad, m and their rates; as before by
                default.

        Raises:
            ConfigError: a group, controller or key does not exist or does not fit.
        """
        before = self._action_normalize
        if action_normalize is not None:
            self._action_normalize = action_normalize
        try:
            self.loop = self._make_loop(controllers or {})
        except ConfigError:
            self._action_normalize = before
            raise

    # ---------------------------------------------------------------------------------------------- actions

    @property
    def action_space(self) -> ActionSpace:
        """Lower and upper bound of each number of an action."""
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
        """Set the controllers' goals; drives follow them from the next time step on.

        Args:
            action: (action_dim,) numbers in group order, or commands by group (others keep their goals).

        Raises:
            RoboyardError: the length does not fit, a group is unknown, or a number is not finite.
            StaleHandleError: the robot was removed from its world.
        """
        if self.body.is_removed:
            raise StaleHandleError(f"robot {self.name!r} was removed from its world")
        commands = action if isinstance(action, Mapping) else self._split(action)
        for name in commands:
            if name not in self.groups:
                raise RoboyardError(f"robot {self.name!r}: {unknown_name('group', str(name), self.groups)}")
        for name, command in commands.items():
            group = self.groups[name]
            group.controller.update_goal(command, self.loop.state_of(group))
        self.loop.make_due()
        if self.manipulation is not None:
            self.manipulation.update_grasps()

    def _split(self, action: Any) -> dict[str, Array]:
        values = np.asarray(action, dtype=float)
        if values.shape != (self.action_dim,):
            parts = ", ".join(f"{n} {c.command_dim}" for n, c in self.controllers.items())
            raise RoboyardError(
                f"robot {self.name!r}: an action must have {self.action_dim} numbers ({parts}), got shape "
                f"{values.shape}"
            )
        return {name: values[part] for name, part in self.controller_action_idx.items()}

    def no_op_action(self) -> Array:
        """Return the (action_dim,) action that keeps every goal."""
        parts = [g.controller.noop_command(self.loop.state_of(g)) for g in self.groups.values()]
        return np.concatenate([np.zeros(0), *parts])

    # --------------------------------------------------------------------------------------------- postures

    @property
    def reset_joint_pos(self) -> Array:
        """(n,) joint positions of the reset posture (rad or m)."""
        return self._reset_posture.copy()

    def reset(self) -> None:
        """Move the joints into the reset posture, at rest, and reset all goals; the base keeps its pose."""
        self.joint_positions = self.with_present_base(self._reset_posture)
        self.base.stop()

    def tuck(self) -> None:
        """Move the joints into the tucked posture at once.

        Raises:
            RoboyardError: the definition has no `mobile_manipulation` block.
        """
        self._set_posture("tuck")

    def untuck(self) -> None:
        """Move the joints into the untucked posture at once.

        Raises:
            RoboyardError: the definition has no `mobile_manipulation` block.
        """
        self._set_posture("untuck")

    def _set_posture(self, mode: ResetMode) -> None:
        if self.mobile_manipulation is None:
            raise RoboyardError(
                f"robot {self.name!r} has no tucked posture; add a mobile_manipulation block to its "
                f"definition"
            )
        self.joint_positions = self.with_present_base(self.mobile_manipulation.posture(mode))

    def stop(self) -> None:
        """Set all velocities to zero."""
        self.joint_velocities = 0.0
        self.base.stop()

    # ----------------------------------------------------------------------------------------- observations

    def proprioception(self, keys: tuple[str, ...] | None = None) -> tuple[Array, dict[str, Array]]:
        """Return the robot's own state: joints, base, end effectors and grasps.

        Args:
            keys: entries of the vector; `default_proprioception` by default.

        Returns:
            (k,) arrays of `keys`, concatenated; all arrays by key.

        Raises:
            RoboyardError: a key does not exist.
        """
        from roboyard.robots.proprioception import own_state

        return own_state(self, keys)

    @property
    def default_proprioception(self) -> tuple[str, ...]:
        """Keys of `proprioception` that are observed by default."""
        from roboyard.robots.proprioception import default_keys

        return default_keys(self)

    def observe(self, *, fresh: bool = False) -> tuple[dict[str, Any], dict[str, dict[str, Any]]]:
        """Return the observations of all sensors and the robot's own state.

        Each sensor is updated at its own rate; between updates its last observation is repeated. Only the
        robot's `obs_modalities` are in it.

        Args:
            fresh: update all sensors now.

        Returns:
            Sensor name to modality to array, with "proprio" (see `proprioception`); sensor name to "seg" to
            the "body/link" of each (body id, link index) in its image.
        """
        from roboyard.sensors import link_names

        latest = self.sensors.observe(fresh=fresh)
        wanted = self.obs_modalities
        observations: dict[str, Any] = {
            name: {key: array for key, array in arrays.items() if wanted == "all" or key in wanted}
            for name, arrays in latest.items()
        }
        info = {
            name: {"seg": link_names(self.world, arrays["seg"])}
            for name, arrays in observations.items()
            if "seg" in arrays
        }
        if wanted == "all" or "proprio" in wanted:
            observations["proprio"] = self.proprioception()[0]
        return observations, info
