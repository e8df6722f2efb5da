"""Observations of n environments: the task's functions, by modality, as one array or a dictionary."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from roboyard.envs.env_arrays import EnvArrays
from roboyard.envs.task import Task, Term
from roboyard.errors import ConfigError, RoboyardError, unknown_name
from roboyard.transforms import Array


class Observer:
    """Computes the vectors that a task's functions give."""

    def __init__(self, task: Task, env: EnvArrays, modalities: Sequence[str]) -> None:
        """Evaluate all functions once to learn their sizes.

        Args:
            task: with functions by modality.
            env: of the environments.
            modalities: those to observe.

        Raises:
            ConfigError: a modality does not exist, or a function returns another shape.
        """
        self._env = env
        known = task.modalities
        for name in modalities:
            if name not in known:
                raise ConfigError(f"obs_modalities: {unknown_name('modality', name, known)}")
        self._terms: dict[str, dict[str, Term]] = {name: known[name] for name in modalities}
        self.slices: dict[str, dict[str, slice]] = {}
        """Modality to name to its numbers in the modality's vector."""
        self.sizes: dict[str, int] = {}
        """Modality to the length of its vector."""
        for modality, terms in self._terms.items():
            at, parts = 0, {}
            for name, term in terms.items():
                size = rows_of(term, env, f"observation {name!r}").shape[1]
                parts[name] = slice(at, at + size)
                at += size
            self.slices[modality], self.sizes[modality] = parts, at

    def observe(self) -> dict[str, np.ndarray]:
        """Return modality to its (n, k) vectors (float32).

        Raises:
            RoboyardError: a value is not finite; the message names it.
        """
        found = {}
        for modality, terms in self._terms.items():
            vector = np.empty((self._env.n, self.sizes[modality]), dtype=np.float32)
            for name, part in self.slices[modality].items():
                values = terms[name](self._env)
                vector[:, part] = values if values.ndim == 2 else values[:, None]
            if not np.isfinite(vector.sum()):
                self._refuse(vector, modality)
            found[modality] = vector
        return found

    def _refuse(self, vector: np.ndarray, modality: str) -> None:
        for name, part in self.slices[modality].items():
            bad = np.flatnonzero(~np.isfinite(vector[:, part]).all(axis=1))
            if len(bad):
                raise RoboyardError(f"observation {name!r} is not finite in environment {bad[0]}")


def rows_of(term: Term, env: EnvArrays, what: str, *, flat: bool = False) -> Array:
    """Return what a function gives for the present state, (n, k); or (n,) with `flat`.

    Raises:
        ConfigError: it returns another shape.
    """
    values = np.asarray(term(env))
    if flat and values.shape == (env.n,):
        return values
    if not flat and values.ndim == 1 and len(values) == env.n:
        values = values[:, None]
    if flat or values.ndim != 2 or len(values) != env.n:
        expected = f"({env.n},)" if flat else f"({env.n},) or ({env.n}, k)"
        raise ConfigError(f"{what} has shape {np.shape(term(env))} for {env.n} environments, not {expected}")
    return values


def joined(found: Mapping[str, np.ndarray]) -> np.ndarray:
    """Return the vectors of all modalities as one (n, k) array."""
    vectors: list[Any] = list(found.values())
    return vectors[0] if len(vectors) == 1 else np.concatenate(vectors, axis=1)
