"""All declared differences of n environments."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from roboyard.envs.env_arrays import EnvArrays
from roboyard.envs.random_rows import RandomRows, Rows
from roboyard.envs.randomization.declared import Randomization
from roboyard.envs.randomization.dynamics import Delay
from roboyard.errors import ConfigError
from roboyard.transforms import Array


class Randomizer:
    """All randomisations of n environments, and the actions that wait for their delay."""

    def __init__(self, declared: Sequence[Randomization], env: EnvArrays) -> None:
        """Bind the declarations to bodies and robots."""
        self._draws = [draw for d in declared if (draw := d.bind(env)) is not None]
        delays = [d for d in declared if isinstance(d, Delay)]
        if len(delays) > 1:
            raise ConfigError("randomize: give one Delay")
        self._bounds = delays[0].steps if delays else (0, 0)
        self._delay = np.zeros(env.n, dtype=np.intp)
        self._past: list[Array] = []
        self._env = env

    def start(self, rows: Rows, random: RandomRows) -> None:
        """Draw new values for episodes that start."""
        for draw in self._draws:
            draw(rows, random)
        if self._bounds[1]:
            self._delay[rows] = random.integers(*self._bounds)
            for past in self._past:
                past[rows] = 0.0

    def delayed(self, actions: Array) -> Array:
        """Return the actions that act now, (n, k)."""
        longest = self._bounds[1]
        if not longest:
            return actions
        if not self._past:
            self._past = [np.zeros_like(actions) for _ in range(longest + 1)]
        self._past = [actions.copy(), *self._past[:longest]]
        return np.stack(self._past)[self._delay, np.arange(len(actions))]
