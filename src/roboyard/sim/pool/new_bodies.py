"""The new bodies of a world that are read and written alone until its next compile, and when bodies are."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Generic, TypeVar

from roboyard.sim.pool.lone_bodies import LoneBody, lone_body
from roboyard.sim.protocols import EngineBody

BodyT = TypeVar("BodyT", bound=EngineBody)

MOST_COMPILES = 2
"""Compiles at one moment after which a new body is read alone instead."""


class NewBodies(Generic[BodyT]):
    """The new bodies of one world that are read and written alone until its next compile."""

    def __init__(self) -> None:
        self._by_id: dict[int, LoneBody] = {}
        self._compiled_at, self._compiles_there = -1.0, 0
        """Simulated time of the last compile (s), and the number of compiles at that time."""

    def __len__(self) -> int:
        return len(self._by_id)

    def avoids_compiles(self, time: float) -> bool:
        """Return whether bodies are read alone at a simulated time (s).

        The first compiles at one moment are not avoided: most programs need one before the next step.
        """
        return self._compiles_there >= MOST_COMPILES and self._compiled_at == time

    def of(self, body: BodyT) -> LoneBody | None:
        """Return a body alone; None where its place or its plan is not known."""
        found, place, plan = self._by_id.get(body.id), body.placed, body.plan_of_tree
        if place is None or plan is None:
            return None
        if found is None:
            found = lone_body(plan)
            if found is None:
                return None
            self._by_id[body.id] = found
        found.put(*place)
        return found

    def end(self, bodies: Mapping[int, BodyT], time: float) -> None:
        """Give bodies the state that they had alone, after a compile at a simulated time (s)."""
        for number, lone in self._by_id.items():
            body = bodies.get(number)
            if body is not None:
                body.take_state(lone)
        self._by_id.clear()
        self._compiles_there = self._compiles_there + 1 if time == self._compiled_at else 1
        self._compiled_at = time
