"""Options of a task as plain data, for files: declared differences by their names and numbers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, is_dataclass
from typing import Any

from roboyard.envs.randomization.declared import Randomization
from roboyard.envs.randomization.dynamics import Delay, Friction, Gains, Gravity, Mass
from roboyard.envs.randomization.looks import CameraPose, Color, Lighting
from roboyard.envs.randomization.starts import JointNoise, Pose
from roboyard.errors import ConfigError, unknown_name

KINDS: dict[str, type[Randomization]] = {
    kind.__name__: kind
    for kind in (CameraPose, Color, Delay, Friction, Gains, Gravity, JointNoise, Lighting, Mass, Pose)
}
"""Name to the declared difference."""
KEY = "randomization"


def to_plain(options: Mapping[str, Any]) -> dict[str, Any]:
    """Return options in which declared differences are plain data.

    Raises:
        ConfigError: a difference is of a class that is not Roboyard's own.
    """
    return {key: _plain(value) for key, value in options.items()}


def from_plain(options: Mapping[str, Any]) -> dict[str, Any]:
    """Return options as `to_plain` was given them.

    Raises:
        ConfigError: a difference has an unknown name or field.
    """
    return {key: _whole(value) for key, value in options.items()}


def _plain(value: Any) -> Any:
    if isinstance(value, Randomization):
        name = type(value).__name__
        if KINDS.get(name) is not type(value) or not is_dataclass(value):
            raise ConfigError(f"{name} is no randomization of Roboyard's and cannot be kept in a file")
        return {KEY: name, **asdict(value)}
    return [_plain(one) for one in value] if isinstance(value, list | tuple) else value


def _whole(value: Any) -> Any:
    if isinstance(value, Mapping) and KEY in value:
        fields = {key: _whole(one) for key, one in value.items() if key != KEY}
        name = value[KEY]
        if name not in KINDS:
            raise ConfigError(unknown_name("randomization", str(name), KINDS))
        try:
            return KINDS[name](**fields)
        except TypeError as error:
            raise ConfigError(f"randomization {name}: {error}") from None
    return tuple(_whole(one) for one in value) if isinstance(value, list | tuple) else value
