"""n environments of a task: steps, rewards, ends of episodes and their starts, all as arrays."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from roboyard.envs.batch_physics import BatchPhysics, check_count
from roboyard.envs.divergence import write_divergence
from roboyard.envs.env_arrays import EnvArrays, named_bodies
from roboyard.envs.observer import Observer, rows_of
from roboyard.envs.placed_actions import ActionRows, place_actions, prepare_all_drives
from roboyard.envs.random_rows import RandomRows, Rows
from roboyard.envs.randomization import Randomizer
from roboyard.envs.task import Task
from roboyard.errors import RoboyardError
from roboyard.robots.robot import Robot
from roboyard.sim.world import World
from roboyard.transforms import Array


@dataclass(frozen=True, kw_only=True, slots=True)
class StepRows:
    """The result of a step of n environments, before new episodes start."""

    observations: dict[str, np.ndarray]
    """Modality to (n, k)."""
    reward: Array
    """(n,)."""
    terminated: np.ndarray
    """(n,) whether episodes ended by the task's rules, or because the simulation diverged."""
    truncated: np.ndarray
    """(n,) whether episodes reached the limit of steps."""
    info: dict[str, Any]
    """Arrays with n rows: "rewards" by name, "success", "diverged", causes of the end by name."""


class Runner:
    """n environments of one task."""

    def __init__(
        self,
        task: Task,
        count: int,
        *,
        modalities: Sequence[str] | None = None,
        threads: int = 0,
        state_folder: Path | None = None,
        make_physics: Callable[..., BatchPhysics] = BatchPhysics,
    ) -> None:
        """Build the task's world and copy it n times; call `reset` before the first step.

        Args:
            task: to run.
            count: n.
            modalities: of observations; all those of the task's functions by default.
            threads: of the processor; 0 for all that this process may use.
            state_folder: where states of simulations that diverged are kept; a temporary folder by default.
            make_physics: makes the simulations of (world, count, threads=...).

        Raises:
            ConfigError: a name in the task is unknown, or a function returns another shape.
            ModelError: the world has rules that copies of it cannot follow.
        """
        self.task = task
        self.count = check_count(count)
        self.world = World(timestep=task.timestep, gravity=task.gravity, visual_geoms=False)
        """The world that was copied; `show` writes an environment's state into it."""
        self.bodies = named_bodies(task.build(self.world))
        """Robots and bodies of that world by the task's names."""
        robots = {name: body for name, body in self.bodies.items() if isinstance(body, Robot)}
        placed = place_actions(task, robots)
        model = self.world.model  # compiles
        if task.cone == "pyramidal":
            model.opt.cone = mujoco.mjtCone.mjCONE_PYRAMIDAL
            self.world.stepping.sliding.invalidate()
        prepare_all_drives(robots, placed)
        self.physics = make_physics(self.world, count, threads=threads)
        """The simulations."""
        self.env = EnvArrays(self.physics, self.bodies, task.buffers, task.substeps * task.timestep)
        """The state as arrays."""
        self.actions = ActionRows(self.env, self.physics, placed)
        """The meaning of actions."""
        self.env.action = np.zeros((count, self.actions.size))
        self.env.last_action = np.zeros((count, self.actions.size))
        self._randomizer = Randomizer(task.randomize, self.env)
        self._delayed: list[Array] = []
        self._streams = [np.random.default_rng() for _ in range(count)]
        self._state_folder = state_folder
        self._parts = task.parts
        self.episode_rewards = {name: np.zeros(count) for name in self._parts}
        """Part of the reward to its (n,) sum over the episode."""
        everyone = np.arange(count)
        self._start(everyone)  # so that functions see a start state when they are checked
        chosen = list(task.modalities) if modalities is None else list(modalities)
        self.observer = Observer(task, self.env, chosen)
        """Computes observations."""
        for name, part in self._parts.items():
            rows_of(part.function, self.env, f"reward {name!r}", flat=True)
        for name, term in task.terminations.items():
            rows_of(term, self.env, f"termination {name!r}", flat=True)
        if task.success is not None:
            rows_of(task.success, self.env, "success", flat=True)

    @property
    def action_size(self) -> int:
        """Numbers of an action."""
        return self.actions.size

    @property
    def streams(self) -> list[np.random.Generator]:
        """The random stream of each environment; assign another to seed it."""
        return self._streams

    # ------------------------------------------------------------------------------------------- episodes

    def reset(
        self, rows: Rows | None = None, seeds: Sequence[int | None] | None = None
    ) -> dict[str, np.ndarray]:
        """Start episodes and return observations of all environments, modality to (n, k).

        Args:
            rows: (k,) environments; all by default.
            seeds: k seeds; streams whose seed is None go on.
        """
        rows = np.arange(self.count) if rows is None else np.asarray(rows, dtype=np.intp)
        for row, seed in zip(rows, seeds or [], strict=bool(seeds)):
            if seed is not None:
                self._streams[row] = np.random.default_rng(seed)
        self._start(rows)
        return self.observer.observe()

    def _start(self, rows: Rows) -> None:
        env = self.env
        self.physics.reset(rows)
        env.forget()
        env.clear(rows)
        for total in self.episode_rewards.values():
            total[rows] = 0.0
        random = RandomRows([self._streams[row] for row in rows])
        self._randomizer.start(rows, random)
        for event in self.task.reset:
            event(env, rows, random)
            env.forget()
        self.physics.forward(rows)
        env.forget()
        self.actions.reset(rows)

    # -------------------------------------------------------------------------------------------- stepping

    def step(self, actions: Array) -> StepRows:
        """Advance all environments by one action; call `reset` for those whose episode ended.

        Args:
            actions: (n, action_size), clipped to -1 to 1.

        Raises:
            RoboyardError: actions have another shape, or are not finite.
        """
        env = self.env
        command = np.asarray(actions, dtype=float)
        if command.shape != (self.count, self.action_size):
            raise RoboyardError(
                f"actions must have shape ({self.count}, {self.action_size}), got {command.shape}"
            )
        if not np.isfinite(command.sum()):
            raise RoboyardError("actions must be finite")
        env.last_action = env.action
        env.action = np.clip(command, -1.0, 1.0)
        before = self.physics.batch.state.copy()
        self.actions.apply(self._randomizer.delayed(env.action))
        diverged = self.physics.step(self.task.substeps)
        env.steps += 1
        env.forget()
        info: dict[str, Any] = {"diverged": np.zeros(self.count, dtype=bool)}
        if len(diverged):
            info["diverged"][diverged] = True
            files: list[str | None] = [None] * self.count
            for row in diverged:
                files[row] = write_divergence(
                    before[row],
                    self.physics.field("ctrl")[row],
                    env.action[row],
                    self.task.substeps,
                    self._state_folder,
                )
            info["diverged_file"] = files
            # the last state that is known, so that no function of the task sees values that are not finite
            self.physics.batch.state[diverged] = before[diverged]
            self.physics.forward(diverged)
        reward = self._reward(info)
        terminated = info["diverged"].copy()
        for name, term in self.task.terminations.items():
            info[name] = term(env).astype(bool)
            terminated |= info[name]
        if self.task.success is not None:
            info["success"] = self.task.success(env).astype(bool)
        truncated = (env.steps >= self.task.limit) & ~terminated
        return StepRows(
            observations=self.observer.observe(),
            reward=reward,
            terminated=terminated,
            truncated=truncated,
            info=info,
        )

    def _reward(self, info: dict[str, Any]) -> Array:
        total = np.zeros(self.count)
        info["rewards"] = {}
        for name, part in self._parts.items():
            value = part.weight * part.function(self.env)
            if not np.isfinite(value.sum()):
                raise RoboyardError(
                    f"reward {name!r} is not finite in environment {np.flatnonzero(~np.isfinite(value))[0]}"
                )
            info["rewards"][name] = value
            self.episode_rewards[name] += value
            total += value
        if self.task.reward_floor is not None:
            np.maximum(total, self.task.reward_floor, out=total)
        return total

    def show(self, row: int = 0) -> World:
        """Write one environment's state into the world, for pictures and sensors, and return the world."""
        self.physics.copy_to_world(row)
        return self.world

    def robot(self, row: int = 0) -> Robot:
        """Return the first robot of the world, in the state of one environment."""
        self.show(row)
        return next(body for body in self.bodies.values() if isinstance(body, Robot))
