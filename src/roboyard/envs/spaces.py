"""Gymnasium spaces of a task, and which modalities are vectors and which are pictures."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from gymnasium import spaces

from roboyard.envs.runner import Runner
from roboyard.envs.task import Task
from roboyard.errors import ConfigError, unknown_name

if TYPE_CHECKING:
    from roboyard.envs.pictures.picture_arrays import PictureArrays

PICTURES = ("rgb", "depth", "seg", "scan")
"""Modalities of cameras and lidars."""


def split_modalities(task: Task, wanted: Sequence[str] | None) -> tuple[list[str], list[str]]:
    """Return the modalities that are vectors of the task's functions, and those of cameras and lidars.

    Raises:
        ConfigError: a modality does not exist, or there is none.
    """
    known = list(task.modalities)
    if wanted is None:
        return known, []
    for name in wanted:
        if name not in known and name not in PICTURES:
            raise ConfigError(f"obs_modalities: {unknown_name('modality', name, (*known, *PICTURES))}")
    if not wanted:
        raise ConfigError("obs_modalities: give at least one modality")
    return [n for n in wanted if n in known], [n for n in wanted if n not in known]


def action_space(runner: Runner) -> spaces.Box:
    """Return the space of actions of one environment: (k,) within -1 to 1."""
    return spaces.Box(-1.0, 1.0, (runner.action_size,), dtype=np.float32)


def observation_space(runner: Runner, pictures: PictureArrays | None) -> Any:
    """Return the space of observations of one environment: one vector, or a dictionary by modality."""
    vectors = {
        name: spaces.Box(-np.inf, np.inf, (size,), dtype=np.float32)
        for name, size in runner.observer.sizes.items()
    }
    if pictures is None:
        total = sum(runner.observer.sizes.values())
        return spaces.Box(-np.inf, np.inf, (total,), dtype=np.float32)
    return spaces.Dict({**vectors, **pictures.spaces()})
