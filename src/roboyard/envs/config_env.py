"""An environment from OmniGibson's configuration: scene, robots, objects and task as nested mappings.

The robots act through their own controllers, at `action_frequency`, in a full `World`. Keys that Roboyard
does not know are errors.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces

from roboyard.errors import ConfigError, RoboyardError, unknown_name
from roboyard.robots import add_robot
from roboyard.robots.robot import Robot
from roboyard.scenes import load_scene
from roboyard.sim.world import World
from roboyard.transforms import conjugate, rotate

_ENV = {"action_frequency": 30.0, "physics_frequency": 240.0}
_TASKS: dict[str, dict[str, Any]] = {
    "DummyTask": {"max_steps": 500},
    "PointNavigationTask": {
        "goal_pos": None,
        "goal_tolerance": 0.36,
        "max_steps": 500,
        "r_potential": 1.0,
        "r_pointgoal": 10.0,
    },
}
_ROBOT = (
    *(
        "type",
        "model",
        "name",
        "position",
        "orientation",
        "obs_modalities",
        "action_type",
        "action_normalize",
    ),
    *("controller_config", "reset_joint_pos", "default_reset_mode", "grasping_mode", "proprio_obs", "scale"),
    *("fixed_base", "self_collisions"),
)
_SHAPES = ("Cube", "Sphere", "Cylinder")
_OBJECT = (
    "type",
    "name",
    "primitive_type",
    "size",
    "radius",
    "height",
    "position",
    "orientation",
    "mass",
    "rgba",
)
_PICTURES: dict[str, tuple[float, float, Any]] = {
    "rgb": (0, 255, np.uint8),
    "depth": (0.0, np.inf, np.float32),
    "seg": (-1, np.iinfo(np.int32).max, np.int32),
    "scan": (0.0, np.inf, np.float32),
}


class ConfigEnv(gymnasium.Env[dict[str, Any], np.ndarray]):
    """The environment of one configuration, with the actions and observations of its robots."""

    def __init__(self, configs: Mapping[str, Any]) -> None:
        """Build the world.

        Args:
            configs: "scene": {"type": "Scene"} for a floor, or {"scene_model": a scene's name or file};
                "robots": a list of {"type": "R1", "obs_modalities": [...], "action_normalize": True,
                "controller_config": {...}, ...}; "objects": a list of {"type": "PrimitiveObject",
                "primitive_type": "Cube", "size": ..., "position": ...}; "task": {"type": "DummyTask"} or
                {"type": "PointNavigationTask", "goal_pos": [x, y, z], ...}; "env": {"action_frequency": 30,
                "physics_frequency": 240}.

        Raises:
            ConfigError: a key, scene, robot or task is unknown; the message names the nearest.
        """
        _known("configs", configs, ("env", "scene", "robots", "objects", "task"))
        rates = {**_ENV, **_section(configs, "env", _ENV)}
        steps = float(rates["physics_frequency"]) / float(rates["action_frequency"])
        if abs(steps - round(steps)) > 1e-6 or round(steps) < 1:
            raise ConfigError(
                "env.physics_frequency must be a multiple of action_frequency, got "
                f"{rates['physics_frequency']} and {rates['action_frequency']}"
            )
        self._steps = round(steps)
        scene = _section(configs, "scene", ("type", "scene_model"))
        world = World(timestep=1.0 / float(rates["physics_frequency"]))
        self.scene = load_scene(str(scene.get("scene_model", "empty")), world)
        """The scene."""
        self.world = self.scene.world
        """The world, with everything in it."""
        self.robots: list[Robot] = [
            self._add_robot(k, entry, float(rates["action_frequency"]))
            for k, entry in enumerate(configs.get("robots", ()))
        ]
        """The robots, in order; an action is theirs one after another."""
        if not self.robots:
            raise ConfigError("robots: give at least one")
        for k, entry in enumerate(configs.get("objects", ())):
            self._add_object(k, entry)
        task = dict(configs.get("task", {"type": "DummyTask"}))
        kind = str(task.pop("type", "DummyTask"))
        if kind not in _TASKS:
            raise ConfigError(f"task.type: {unknown_name('task', kind, _TASKS)}")
        _known("task", task, _TASKS[kind])
        self._task = {**_TASKS[kind], **task}
        goal = self._task.get("goal_pos")
        if kind == "PointNavigationTask" and goal is None:
            raise ConfigError("task.goal_pos: give the goal, [x, y, z] (m)")
        self.goal = None if goal is None else np.asarray(goal, dtype=float)
        """(3,) goal of a PointNavigationTask in the world frame (m)."""
        self._start = self.world.save_state()
        self._count, self._away = 0, 0.0
        boxes = [robot.action_space for robot in self.robots]
        self.action_space = spaces.Box(
            np.concatenate([box.low for box in boxes]).astype(np.float32),
            np.concatenate([box.high for box in boxes]).astype(np.float32),
        )
        self.observation_space = _space_of(self._observe())

    def _add_robot(self, k: int, entry: Mapping[str, Any], frequency: float) -> Robot:
        where = f"robots[{k}]"
        _known(where, entry, _ROBOT)
        name = entry.get("model", entry.get("type"))
        if name is None:
            raise ConfigError(f"{where}.type: give the robot, such as 'R1'")
        if entry.get("action_type", "continuous") != "continuous":
            raise ConfigError(f"{where}.action_type must be 'continuous', got {entry['action_type']!r}")
        options: dict[str, Any] = {
            "controllers": entry.get("controller_config"),
            "action_normalize": bool(entry.get("action_normalize", True)),
            "control_freq": frequency,
        }
        renamed = {"self_collisions": "self_collision"}
        for key in (
            *("name", "reset_joint_pos", "default_reset_mode", "grasping_mode", "obs_modalities", "scale"),
            *("fixed_base", "self_collisions"),
        ):
            if entry.get(key) is not None:
                options[renamed.get(key, key)] = entry[key]
        text = str(name)
        robot = add_robot(
            self.world,
            text if "/" in text or "." in text else text.lower(),
            entry.get("position", self.scene.spawn),
            entry.get("orientation", self.scene.spawn_orientation),
            **options,
        )
        self._proprioception = getattr(self, "_proprioception", {})
        keys = entry.get("proprio_obs")
        self._proprioception[robot.name] = None if keys in (None, "default") else tuple(keys)
        return robot

    def _add_object(self, k: int, entry: Mapping[str, Any]) -> None:
        where = f"objects[{k}]"
        _known(where, entry, _OBJECT)
        shape = entry.get("primitive_type")
        if entry.get("type", "PrimitiveObject") != "PrimitiveObject" or shape not in _SHAPES:
            raise ConfigError(
                f"{where}: type must be 'PrimitiveObject' with primitive_type {', '.join(_SHAPES)}, got "
                f"{entry.get('type')!r}, {shape!r}"
            )
        place = entry.get("position", (0.0, 0.0, 0.0))
        options: dict[str, Any] = {"mass": float(entry.get("mass", 1.0))}
        for key in ("name", "rgba"):
            if key in entry:
                options[key] = entry[key]
        radius, turn = float(entry.get("radius", 0.05)), entry.get("orientation", (0, 0, 0, 1))
        if shape == "Cube":
            size = np.broadcast_to(np.asarray(entry.get("size", 0.1), dtype=float), 3)
            self.world.add_box(size, place, turn, **options)
        elif shape == "Sphere":
            self.world.add_sphere(radius, place, **options)
        else:
            self.world.add_cylinder(radius, float(entry.get("height", 0.1)), place, turn, **options)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Any], dict[str, Any]]:
        """Put everything back where it started and return observation and information."""
        super().reset(seed=seed)
        self.world.restore_state(self._start)
        for robot in self.robots:
            robot.loop.invalidate()
        self._count, self._away = 0, self._distance()
        return self._observe(fresh=True), {}

    def step(self, action: np.ndarray) -> tuple[dict[str, Any], float, bool, bool, dict[str, Any]]:
        """Advance by one action (n,), the robots' actions one after another.

        Returns:
            Observation, reward, terminated, truncated, information.

        Raises:
            RoboyardError: the action has another shape, or is not finite.
        """
        given = np.asarray(action, dtype=float)
        if given.shape != self.action_space.shape:
            raise RoboyardError(f"an action must have shape {self.action_space.shape}, got {given.shape}")
        at = 0
        for robot in self.robots:
            robot.apply_action(given[at : at + robot.action_dim])
            at += robot.action_dim
        self.world.step(self._steps)
        self._count += 1
        reward, done = 0.0, False
        if self.goal is not None:
            before, self._away = self._away, self._distance()
            done = self._away < float(self._task["goal_tolerance"])
            reward = float(self._task["r_potential"]) * (before - self._away)
            reward += float(self._task["r_pointgoal"]) * done
        truncated = not done and self._count >= int(self._task["max_steps"])
        return self._observe(), reward, done, truncated, {"success": done}

    def _distance(self) -> float:
        if self.goal is None:
            return 0.0
        return float(np.linalg.norm(self.goal[:2] - self.robots[0].position[:2]))

    def _observe(self, *, fresh: bool = True) -> dict[str, Any]:
        found: dict[str, Any] = {}
        for robot in self.robots:
            seen, _ = robot.observe(fresh=fresh)
            keys = self._proprioception[robot.name]
            parts: dict[str, Any] = {}
            for sensor, arrays in seen.items():
                if sensor == "proprio":
                    vector = robot.proprioception(keys)[0] if keys else arrays
                    parts["proprio"] = vector.astype(np.float32)
                    continue
                for modality, values in arrays.items():
                    if modality in _PICTURES:
                        dtype = _PICTURES[modality][2]
                        parts[f"{sensor}::{modality}"] = np.ascontiguousarray(values, dtype=dtype)
            found[robot.name] = parts
        if self.goal is not None:
            robot = self.robots[0]
            gap = rotate(conjugate(robot.orientation), self.goal - robot.position)
            found["task"] = {"low_dim": gap.astype(np.float32)}
        return found

    def render(self) -> Any:
        """Return None: look at `world` with a camera, or open it in a `roboyard.Viewer`."""
        return None


def _space_of(observation: Mapping[str, Any]) -> spaces.Dict:
    found: dict[str, Any] = {}
    for name, value in observation.items():
        if isinstance(value, Mapping):
            found[name] = _space_of(value)
            continue
        low, high, dtype = _PICTURES.get(name.rsplit("::", 1)[-1], (-np.inf, np.inf, np.float32))
        found[name] = spaces.Box(low, high, value.shape, dtype=dtype)
    return spaces.Dict(found)


def _known(where: str, given: Mapping[str, Any], known: Any) -> None:
    if not isinstance(given, Mapping):
        raise ConfigError(f"{where}: must be a mapping, got {given!r}")
    for key in given:
        if key not in known:
            raise ConfigError(f"{where}: {unknown_name('key', str(key), list(known))}")


def _section(configs: Mapping[str, Any], name: str, known: Any) -> Mapping[str, Any]:
    section = configs.get(name, {})
    _known(name, section, known)
    return section
