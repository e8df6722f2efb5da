"""The folder *Last minute* of every page: a slider over the last minute, replay, live and a saved moment."""

from __future__ import annotations

import math
import tempfile
import threading
from collections.abc import Mapping
from pathlib import Path
from time import perf_counter
from typing import Any

from roboyard.viewer.timeline.moment_log import log_of
from roboyard.viewer.timeline.moments import Moments
from roboyard.viewer.timeline.playback import Playback

LAST = 1000.0
"""Order of the folder in the panel: below all others."""
PERIOD = 0.2
"""Least time between two updates of slider and text (s)."""
STEP = 0.01
"""Step of the slider (s)."""


class TimeFolder:
    """Slider, buttons and text that control a `Playback`."""

    def __init__(self, gui: Any, moments: Moments, playback: Playback) -> None:
        """Add the folder to a `viser` panel."""
        self._moments, self._playback = moments, playback
        self._next = 0.0
        self._is_past = False
        """Whether the slider is where the past is shown."""
        self._lock = threading.RLock()
        """Held while slider and playback change: the viewer's thread shows what the event loop chooses."""
        self.setup: Mapping[str, Any] = {}
        """Data to build the scene again, for saved moments; empty: a world built otherwise."""
        with gui.add_folder("Last minute", order=LAST, expand_by_default=False):
            self.slider = gui.add_slider(
                "Time",
                min=-1.0,
                max=0.0,
                step=STEP,
                initial_value=0.0,
                hint="seconds before now; the page shows the past, the simulation goes on",
            )
            self.buttons = gui.add_button_group("show", ("Replay", "Live"))
            self.save_button = gui.add_button(
                "Save moment", hint="downloads the shown state, for `roboyard replay` and `drive`"
            )
            self.text = gui.add_markdown("")
        self.slider.on_update(self._on_slider)
        self.buttons.on_click(self._on_button)
        self.save_button.on_click(self._on_save)
        self.show()

    def tick(self) -> None:
        """Update slider and text, at most each `PERIOD`; call it once per frame."""
        now = perf_counter()
        if now >= self._next:
            self._next = now + PERIOD
            self.show()

    def show(self) -> None:
        """Show which state the page shows."""
        with self._lock:
            self._show()

    def _show(self) -> None:
        playback = self._playback
        moment = playback.moment
        if moment is None:
            kept = self._moments.all()
            span = kept[-1].clock - kept[0].clock if kept else 0.0
            least = -float(max(math.ceil(span), 1))
            if self._is_past:  # otherwise a page has just moved the slider, and it is passed on next
                self._is_past, self.slider.value = False, 0.0
            if self.slider.min != least:
                self.slider.min = least
            self._write(f"Live. {span:.0f} s recorded.")
            return
        self._is_past = True
        if playback.is_replaying:
            self.slider.value = max(-playback.before_now, self.slider.min)
        word = "Replay" if playback.is_replaying else "Recorded"
        self._write(f"**{word}**: {moment.snapshot.time:.2f} s of simulated time.")

    def _write(self, text: str) -> None:
        if self.text.content != text:
            self.text.content = text

    async def _on_slider(self, event: Any) -> None:
        # coroutines run in the event loop, in order
        if event.client_id is None:
            return
        with self._lock:
            value = float(event.target.value)
            if value < 0.0:
                self._playback.scrub(-value)
            else:
                self._playback.go_live()
            self._is_past = True
            self._show()

    async def _on_button(self, event: Any) -> None:
        if event.target.value == "Replay":
            self._playback.replay()
        else:
            self._playback.go_live()
        self.show()

    async def _on_save(self, event: Any) -> None:
        moment = self._playback.moment
        kept = self._moments.all()
        if moment is None and kept:
            moment = kept[-1]
        if moment is None or event.client is None:
            return
        log = log_of(moment, self.setup)
        with tempfile.TemporaryDirectory() as folder:
            file = log.save(Path(folder) / f"moment-{moment.snapshot.time:.2f}s.npz")
            event.client.send_file_download(file.name, file.read_bytes(), save_immediately=True)
