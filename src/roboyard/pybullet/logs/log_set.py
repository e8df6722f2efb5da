"""The log files that a client is writing, by id."""

from __future__ import annotations

from typing import Protocol, TypeVar

from roboyard.pybullet.state.ids import Counter

R = TypeVar("R")


class Recorder(Protocol):
    """A log file that is being written."""

    def record(self) -> None:
        """Append the result of one step."""
        ...

    def close(self) -> None:
        """Finish the file."""
        ...


class LogSet:
    """Recorders by id, counted from 0."""

    def __init__(self) -> None:
        """Start without recorders."""
        self._ids = Counter()
        self.recorders: dict[int, Recorder] = {}
        """Recorders by id."""

    def start(self, recorder: Recorder) -> int:
        """Add a recorder and return its id."""
        number = self._ids.take()
        self.recorders[number] = recorder
        return number

    def stop(self, number: int) -> None:
        """Close a recorder; an unknown id is ignored."""
        recorder = self.recorders.pop(number, None)
        if recorder is not None:
            recorder.close()

    def stop_all(self) -> None:
        """Close all recorders."""
        for number in list(self.recorders):
            self.stop(number)

    def first_of(self, kind: type[R]) -> R | None:
        """Return the first recorder of a class, or None."""
        if not self.recorders:
            return None
        return next((each for each in self.recorders.values() if isinstance(each, kind)), None)

    def after_step(self) -> None:
        """Let every recorder append the step; stepSimulation calls this."""
        for recorder in self.recorders.values():
            recorder.record()

    def __bool__(self) -> bool:
        """Whether any log is being written."""
        return bool(self.recorders)
