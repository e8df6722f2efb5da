"""`DrivingPage`: a robot in a scene, driven from the browser."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from time import perf_counter
from typing import Any

from roboyard.viewer.driving.aim import look_from_behind
from roboyard.viewer.driving.panel import DrivingPanel
from roboyard.viewer.driving.session import DrivingSession
from roboyard.viewer.page.loop import serve
from roboyard.viewer.page.server import DEFAULT_PORT
from roboyard.viewer.scene.scans import lidars_of

LONGEST_CATCH_UP = 0.1
"""Longest simulated time of one tick (s); a slower simulation falls behind real time."""
UPDATE_PERIOD = 0.1
"""Period at which handles, lidar scans and the status are updated (s)."""


class DrivingPage(DrivingSession):
    """The loop of a page that drives; everything runs in the thread that calls `tick`."""

    def __init__(
        self,
        setup: Mapping[str, Any],
        *,
        host: str = "127.0.0.1",
        port: int = DEFAULT_PORT,
        folder: Path | None = None,
        quiet: bool = False,
    ) -> None:
        """Set up a scene with a robot and serve the page; arguments and errors as of `DrivingSession`."""
        super().__init__(setup, host=host, port=port, folder=folder, quiet=quiet)
        self.actions = 0
        """Actions applied so far."""
        self._max_actions: int | None = None
        self._last_update = 0.0
        self._stopped = False
        self.panel = self._panel = DrivingPanel(self.viewer.server.gui, self)
        self.start()
        look_from_behind(self.viewer, self.robot)

    def run(self, max_actions: int | None = None) -> None:
        """Serve the page until `stop` is called, the process is interrupted or `max_actions` are applied."""
        self._max_actions = max_actions
        serve(self.tick, self.requests, lambda: self._stopped or self._is_done())

    def _is_done(self) -> bool:
        return self._max_actions is not None and self.actions >= self._max_actions

    def tick(self, elapsed: float) -> None:
        """Execute the page's requests, then simulate `elapsed` seconds unless paused."""
        self.requests.execute_all()
        tapped = self._pressed_keys()
        if self.is_playing:
            most = max(LONGEST_CATCH_UP, 1.0 / self.robot.control_freq)
            self._behind = min(
                self._behind + (most if self.time_speed is None else self.time_speed * elapsed), most
            )
            period = self.robot.steps_per_control * self.world.timestep
            while self._behind >= period and self.is_playing and not self._is_done():
                self._behind -= period
                if not self.requests.execute(lambda tapped=tapped: self._act(tapped)):
                    self.play(False)
                tapped = ()
        while self._single_steps and not self.is_playing:
            self._single_steps -= 1
            self.requests.execute(lambda: self._act(tapped))
        now = perf_counter()
        if now - self._last_update > UPDATE_PERIOD:
            self._last_update = now
            self._update(now)

    def _update(self, now: float) -> None:
        """Update handles, lidar scans and status; `now` is `perf_counter` (s)."""
        self.ik_handles.follow()
        if not self.panel.scans_box.value:
            self.scans.clear()
        elif self.viewer.watchers:
            self.scans.show(lidars_of(self.robot))
        if self.viewer.watchers:
            self.requests.execute(self.insets.update)
        self._pace = [*self._pace[-10:], (now, self.world.time)]
        if now > self._message_until:
            self.show_status()

    def _act(self, tapped: tuple[str, ...]) -> None:
        """Apply one action and simulate one control period."""
        held = dict.fromkeys((*self.keys.held, *tapped))
        self.robot.apply_action(self.action_source.action(held, self.joysticks.values))
        if self.action_source.steered is not None:
            self.planned_moves.stop(self.action_source.steered)
        self.planned_moves.act(self.robot.steps_per_control * self.world.timestep)
        self.world.step(self.robot.steps_per_control)
        self.actions += 1
        if self.recorder is not None:
            self.recorder.record()
        if self.recording.writer is not None:
            self.recording.add_frame(self.scene_setup, self.camera())

    def _pressed_keys(self) -> tuple[str, ...]:
        """Keys pressed since the last call, even if already released."""
        pressed = []
        for _ in range(self._events.qsize()):
            event = self._events.get()
            if not event.is_down:
                continue
            if event.key == "r":
                self.requests.execute(self.reset)
            self.action_source.press(event.key)
            pressed.append(event.key)
        return tuple(pressed)

    def stop(self) -> None:
        """Let `run` return; may be called from any thread."""
        self._stopped = True

    def close(self) -> None:
        """Finish a running video and close the page."""
        self.stop()
        self.recording.stop()
        self.viewer.close()
