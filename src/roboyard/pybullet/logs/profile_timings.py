"""Timings of named spans, written as a trace for chrome://tracing."""

from __future__ import annotations

import json
from pathlib import Path
from time import perf_counter

from roboyard.pybullet.state.output_files import write_file


class ProfileTimings:
    """Spans between submitProfileTiming calls and from step to step."""

    def __init__(self, path: Path) -> None:
        """Start a trace, which `close` writes to a file."""
        self._path = path
        self._origin = perf_counter()
        self._events: list[dict[str, object]] = []
        self._open: list[tuple[str, float]] = []
        self._last_step = self._origin

    def push(self, name: str) -> None:
        """Open a span."""
        self._open.append((name, perf_counter()))

    def pop(self) -> None:
        """Close the span opened last; does nothing if none is open."""
        if self._open:
            name, start = self._open.pop()
            self._add(name, start, perf_counter())

    def record(self) -> None:
        """Add the span from the previous step to this one."""
        now = perf_counter()
        self._add("stepSimulation", self._last_step, now)
        self._last_step = now

    def close(self) -> None:
        """Close all open spans and write the file."""
        while self._open:
            self.pop()
        trace = {"traceEvents": self._events, "displayTimeUnit": "ns"}
        write_file(self._path, json.dumps(trace).encode())

    def _add(self, name: str, start: float, end: float) -> None:
        """Append a complete event ("X"); start and end in s, stored in µs as the trace format requires."""
        self._events.append(
            {
                "cat": "timing",
                "pid": 1,
                "tid": 0,
                "name": name,
                "ph": "X",
                "ts": (start - self._origin) * 1e6,
                "dur": (end - start) * 1e6,
            }
        )
