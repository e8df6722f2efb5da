"""`Playback`: which of the recorded states a page shows; none while it shows the world as it is."""

from __future__ import annotations

import copy
import threading
from bisect import bisect_right
from collections.abc import Callable
from dataclasses import replace
from time import perf_counter
from typing import Any

from roboyard.viewer.scene.snapshot import Snapshot
from roboyard.viewer.timeline.moments import Frames, Moment, Moments


class Playback:
    """Shows recorded states; from any thread.

    The states are those of the time at which scrubbing or the replay began; they stay while the world
    goes on.
    """

    def __init__(self, moments: Moments, clock: Callable[[], float] = perf_counter) -> None:
        """Start live.

        Args:
            moments: the recording.
            clock: wall clock (s) that a replay follows.
        """
        self._moments, self._clock = moments, clock
        self._lock = threading.Lock()
        self._held: tuple[Moment, ...] = ()
        self._index = 0
        self._began: tuple[float, float] | None = None
        """Wall clock and clock of the recording (s) at which a replay began; None: no replay."""
        self._posed: tuple[Moment, Snapshot] | None = None
        self._fixed: tuple[Any, Frames, Any] | None = None

    @property
    def is_live(self) -> bool:
        """Whether the page shows the world as it is."""
        return not self._held

    @property
    def is_replaying(self) -> bool:
        """Whether a replay runs."""
        return self._began is not None

    @property
    def moment(self) -> Moment | None:
        """The shown state; None: live."""
        with self._lock:
            return self._held[self._index] if self._held else None

    @property
    def held(self) -> tuple[Moment, ...]:
        """The states that can be shown, oldest first: those held, or all while live."""
        return self._held or self._moments.all()

    @property
    def before_now(self) -> float:
        """Time from the shown state to the newest that can be shown (s); 0 while live."""
        with self._lock:
            return self._held[-1].clock - self._held[self._index].clock if self._held else 0.0

    def go_live(self) -> None:
        """Show the world as it is."""
        with self._lock:
            self._stop()

    def scrub(self, before_now: float) -> None:
        """Show the recorded state of `before_now` seconds before the newest, or the oldest."""
        with self._lock:
            self._began = None
            if self._hold():
                self._seek(self._held[-1].clock - before_now)

    def replay(self) -> None:
        """Show the states one after the other, as fast as they were simulated, from the shown one on.

        While live it begins with the oldest; after the newest the page is live again.
        """
        with self._lock:
            if self._hold():
                if self._index == len(self._held) - 1:
                    self._index = 0
                self._began = self._clock(), self._held[self._index].clock

    def shown(self) -> Snapshot | None:
        """Return the state to show now, the same object while it is the same; None: live."""
        with self._lock:
            if self._began is not None:
                clock = self._began[1] + self._clock() - self._began[0]
                if clock > self._held[-1].clock:
                    self._stop()
                else:
                    self._seek(clock)
            if not self._held:
                return None
            moment = self._held[self._index]
            if self._posed is None or self._posed[0] is not moment:
                self._posed = moment, replace(moment.snapshot, model=self._model_of(moment))
            return self._posed[1]

    def _hold(self) -> bool:
        if not self._held:
            self._held = self._moments.all()
            self._index = len(self._held) - 1
        return bool(self._held)

    def _stop(self) -> None:
        self._held, self._index, self._began = (), 0, None
        self._posed = self._fixed = None

    def _seek(self, clock: float) -> None:
        """Choose the last state at or before a time (s) of the recording."""
        found = bisect_right(self._held, clock + 1e-9, key=lambda moment: moment.clock)
        self._index = max(found - 1, 0)

    def _model_of(self, moment: Moment) -> Any:
        """Return a model with the fixed frames of a state, which may have been moved since."""
        model, frames = moment.snapshot.model, moment.frames
        if (model.body_pos == frames.positions).all() and (model.body_quat == frames.wxyz).all():
            return model
        if self._fixed is None or self._fixed[0] is not model or self._fixed[1] is not frames:
            copied = copy.copy(model)
            copied.body_pos[:], copied.body_quat[:] = frames.positions, frames.wxyz
            self._fixed = model, frames, copied
        return self._fixed[2]
