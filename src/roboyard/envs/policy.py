"""Trained policies as plain files: layers of numbers and the task they were trained for, no program code.

    {"format": "roboyard-policy 1", "task": "roboyard/Reach-v0", "options": {...},
     "mean": [...], "deviation": [...], "layers": [{"weight": [[...]], "bias": [...]}, ...]}

The action is a fully connected network of the scaled observation, (o - mean) / deviation, with tanh or ReLU
between layers, clipped to -1 to 1. Such a file is safe to read from strangers, unlike a pickle.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from roboyard.errors import ConfigError
from roboyard.robots.spawn import is_robot_file
from roboyard.transforms import Array
from roboyard.untrusted.files import FileRefusedError
from roboyard.untrusted.json_reading import read_json

FORMAT = "roboyard-policy 1"
LARGEST_FILE = 64 << 20
"""Bytes of a policy file."""
ACTIVATIONS = {
    "tanh": np.tanh,
    "relu": lambda x: np.maximum(x, 0.0),
    "elu": lambda x: np.where(x > 0, x, np.expm1(np.minimum(x, 0))),
}


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Policy:
    """A network that chooses actions."""

    task: str
    """Id of the task."""
    layers: tuple[tuple[Array, Array], ...]
    """(outputs, inputs) weights and (outputs,) biases of each layer."""
    options: Mapping[str, Any] = field(default_factory=dict)
    """Options of the task."""
    activation: str = "tanh"
    """Function between layers: "tanh", "relu" or "elu"."""
    mean: Array | None = None
    """(k,) subtracted from observations; None: 0."""
    deviation: Array | None = None
    """(k,) that observations are divided by; None: 1."""

    def __call__(self, observation: Array) -> Array:
        """Return the (..., a) actions of (..., k) observations."""
        x = np.asarray(observation, dtype=float)
        if self.mean is not None:
            x = x - self.mean
        if self.deviation is not None:
            x = x / self.deviation
        x = np.clip(x, -10.0, 10.0) if self.deviation is not None else x
        between = ACTIVATIONS[self.activation]
        for k, (weight, bias) in enumerate(self.layers):
            x = x @ weight.T + bias
            if k < len(self.layers) - 1:
                x = between(x)
        return np.clip(x, -1.0, 1.0)

    def save(self, file: Path | str) -> None:
        """Write the policy to a file, which must not exist or be a policy."""
        path = Path(file)
        if path.exists():
            load_policy(path)  # nothing else is overwritten
        content = {
            "format": FORMAT,
            "task": self.task,
            "options": dict(self.options),
            "activation": self.activation,
            "mean": None if self.mean is None else np.asarray(self.mean).tolist(),
            "deviation": None if self.deviation is None else np.asarray(self.deviation).tolist(),
            "layers": [
                {"weight": np.asarray(w, dtype=float).tolist(), "bias": np.asarray(b, dtype=float).tolist()}
                for w, b in self.layers
            ],
        }
        partial = path.with_name(path.name + ".partial")
        partial.write_text(json.dumps(content), encoding="utf-8")
        partial.replace(path)


def load_policy(file: Path | str) -> Policy:
    """Read a policy.

    Raises:
        ConfigError: the file does not exist or is no policy; the message names the element.
    """
    path = Path(file)
    try:
        content = read_json(path, LARGEST_FILE)
    except FileRefusedError as error:
        raise ConfigError(f"{path.name}: {error.strerror}") from None
    except OSError:
        raise ConfigError(f"{path.name}: no such policy; check the path") from None
    except ValueError as error:
        raise ConfigError(f"{path.name}: not a policy: it is no JSON: {error}") from None
    if not isinstance(content, dict) or content.get("format") != FORMAT:
        raise ConfigError(f'{path.name}: not a policy: "format" must be "{FORMAT}"')
    try:
        return _policy(content, path)
    except (TypeError, KeyError, ValueError) as error:
        raise ConfigError(f"{path.name}: not a policy: {error}") from None


def _robot_beside(policy: Path, robot: str) -> Path:
    """Return the file of a policy's robot.

    Raises:
        ConfigError: it is not in the policy's folder.
    """
    folder = policy.resolve().parent
    file = (folder / robot).resolve()
    if not file.is_relative_to(folder):
        raise ConfigError(
            f"{policy.name}: options.robot: {robot!r} is not in the policy's folder; put it there, "
            "or import the robot and give its name"
        )
    return file


def _policy(content: Mapping[str, Any], path: Path) -> Policy:
    name = path.name
    layers = [
        (np.array(layer["weight"], dtype=float), np.array(layer["bias"], dtype=float))
        for layer in content["layers"]
    ]
    width = None
    for k, (weight, bias) in enumerate(layers):
        if weight.ndim != 2 or bias.shape != weight.shape[:1] or width not in (None, weight.shape[1]):
            raise ConfigError(f"{name}: layers[{k}]: weight {weight.shape} and bias {bias.shape} do not fit")
        if not (np.isfinite(weight).all() and np.isfinite(bias).all()):
            raise ConfigError(f"{name}: layers[{k}]: weights must be finite")
        width = weight.shape[0]
    if not layers:
        raise ConfigError(f"{name}: layers: there is none")
    if content.get("activation", "tanh") not in ACTIVATIONS:
        raise ConfigError(f"{name}: activation must be one of {', '.join(ACTIVATIONS)}")
    scales = []
    for key in ("mean", "deviation"):
        values = content.get(key)
        array = None if values is None else np.array(values, dtype=float)
        if array is not None and (array.shape != (layers[0][0].shape[1],) or not np.isfinite(array).all()):
            raise ConfigError(f"{name}: {key} must be {layers[0][0].shape[1]} finite numbers")
        scales.append(array)
    if not isinstance(content["task"], str) or not isinstance(content["options"], dict):
        raise ConfigError(f"{name}: task must be a text and options a mapping")
    robot = content["options"].get("robot")
    if isinstance(robot, str) and is_robot_file(robot):
        options = {**content["options"], "robot": str(_robot_beside(path, robot))}
    else:
        options = content["options"]
    return Policy(
        task=content["task"],
        options=options,
        activation=content.get("activation", "tanh"),
        mean=scales[0],
        deviation=scales[1],
        layers=tuple(layers),
    )
