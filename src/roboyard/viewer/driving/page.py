"""`DrivingPage`: a robot in a scene, driven from a web page."""

from __future__ import annotations

import queue
from collections.abc import Mapping
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Any

import numpy as np

from roboyard.recording import Recorder, SceneSetup, set_up
from roboyard.recording.state_log import StateLog
from roboyard.rendering import Camera
from roboyard.viewer.driving.action_source import NAMES, ActionSource
from roboyard.viewer.driving.aim import look_from_behind
from roboyard.viewer.driving.ik_handles import IkHandles
from roboyard.viewer.driving.panel import DrivingPanel
from roboyard.viewer.driving.video import HEIGHT, WIDTH, Filming, free_file, moment_of, same_words
from roboyard.viewer.page.joysticks import Joysticks
from roboyard.viewer.page.keys import KeyEvent, Keys
from roboyard.viewer.page.requests import RequestQueue
from roboyard.viewer.page.server import DEFAULT_PORT
from roboyard.viewer.scene.follow import Follow
from roboyard.viewer.scene.scans import Scans, lidars_of
from roboyard.viewer.viewer import Viewer

if TYPE_CHECKING:
    from roboyard.robots import Robot

TICK = 1.0 / 60.0
"""s: how often the page's wishes are looked at."""
LONGEST_CATCH_UP = 0.1
"""s: simulated time falls behind real time rather than that a tick takes longer."""
STATUS_PERIOD, HANDLE_PERIOD = 0.25, 0.1
"""s"""
COMPLAINT_PERIOD = 5.0
"""s that a complaint stays on the page at least"""


class DrivingPage:
    """Everything happens in the thread that calls `tick`."""

    def __init__(
        self,
        setup: Mapping[str, Any],
        *,
        host: str = "127.0.0.1",
        port: int = DEFAULT_PORT,
        folder: Path | None = None,
        quiet: bool = False,
    ) -> None:
        """Set up a scene with a robot and serve the page.

        Args:
            setup: see `roboyard.recording.set_up`; with a robot.
            host: address to listen at.
            port: first port to try.
            folder: where films and moments are written; the working folder by default.
            quiet: do not print the address.

        Raises:
            ConfigError: the words are wrong, or nothing can listen at `host` and `port`.
            MissingExtraError: viser is not installed.
        """
        self.folder = Path() if folder is None else folder
        self.stage: SceneSetup = set_up(setup)
        self.viewer = Viewer(self.stage.scene.world, host, port, title="Roboyard: drive", quiet=quiet)
        server = self.viewer.server
        self.requests = RequestQueue(self.complain)
        self.keys = Keys(server, grab=NAMES)
        self._events: queue.SimpleQueue[KeyEvent] = queue.SimpleQueue()
        self.keys.subscribe(self._events.put)
        self.joysticks = Joysticks(server)
        self.follow = Follow(server)
        self.filming = Filming()
        self.scans = Scans(server)
        self.recorder: Recorder | None = None
        """Takes every control step where someone set it."""
        self.moments: dict[str, StateLog] = {}
        self.taken = 0
        """Actions so far."""
        self.is_playing = True
        self._most: int | None = None
        self._behind = self._last_handles = 0.0
        self._quiet_until = 0.0
        self._stopped = False
        self._pace = [(perf_counter(), self.stage.scene.world.time)]
        self.panel = DrivingPanel(server.gui, self)
        self._begin()
        look_from_behind(self.viewer, self.robot)

    @property
    def robot(self) -> Robot:
        """The robot that is driven."""
        assert self.stage.robot is not None
        return self.stage.robot

    def _begin(self) -> None:
        """Everything that depends on the robot, after it or its controllers changed."""
        speed = self.action_source.speed if hasattr(self, "pilot") else None
        self.action_source = ActionSource(self.robot)
        if speed is not None:
            self.action_source.speed = speed
        self.hands = IkHandles(self.viewer, self.action_source)
        self.joysticks.show(self.action_source.joysticks)
        self._start = self.stage.scene.world.save_state()
        self.panel.show_robot()
        self.follow.set(self.viewer.path_of(self.robot.base_link) if self.panel.follow_box.value else None)
        self.show_status()

    # ----------------------------------------------------------------------------------------------- wishes

    def set_up(self, setup: Mapping[str, Any]) -> None:
        """Another scene, robot or set of controllers, from the beginning."""
        self.stop_film()
        self.hands.remove()
        try:
            self.stage = set_up(setup)
            self.moments = {
                name: log for name, log in self.moments.items() if same_words(log.setup, self.stage.setup)
            }
            self.recorder = None
            self.viewer.show_world(self.stage.scene.world)
            self.viewer.sync(wait=True)
        finally:
            self._begin()
        look_from_behind(self.viewer, self.robot)

    def set_controllers(self, controllers: Mapping[str, str]) -> None:
        """Other controllers for some groups; the robot stays where it is."""
        chosen = {**(self.stage.setup.get("controllers") or {}), **controllers}
        self.robot.reload_controllers(chosen)
        self.stage.setup["controllers"] = chosen
        self.hands.remove()
        start = self._start
        self._begin()
        self._start = start

    def play(self, playing: bool) -> None:
        """Let time run, or stop it."""
        self.is_playing, self._behind = playing, 0.0
        self.panel.show_playing(playing)
        self.show_status()

    def reset(self) -> None:
        """Back to the beginning."""
        self.stage.scene.world.restore_state(self._start)
        self.robot.reset()
        self.action_source.reset()
        self._moved_by_hand()

    def save_moment(self) -> str:
        """Keep the present moment; its name."""
        log = moment_of(self.stage)
        name = f"{len(self.moments) + 1}: {log.time[-1]:.1f} s"
        self.moments[name] = log
        return name

    def load_moment(self, log: StateLog) -> None:
        """Go back to the last moment of a log; into its scene, where that is another one."""
        if not same_words(log.setup, self.stage.setup):
            self.set_up(log.setup)
        log.check_fits(self.stage.scene.world)
        log.restore(self.stage.scene.world, len(log) - 1)
        self.robot.loop.invalidate()
        for controller in self.robot.controllers.values():
            controller.reset()
        self.action_source.targets.clear()
        self._moved_by_hand()

    def _moved_by_hand(self) -> None:
        self._behind = 0.0
        self.viewer.sync()
        self.hands.let_go()
        self.show_status()

    def start_film(self, path: Path | None = None, ending: str = "gif") -> Path:
        """Begin a film of what the page that looked last shows; its path."""
        if path is None:
            stem = f"{self.stage.setup['robot']}-{self.stage.scene.name}"
            path = free_file(self.folder, stem, ending)
        self.filming.start(path, self.stage.scene.world.time)
        self.panel.show_filming(path)
        return path

    def stop_film(self) -> Path | None:
        """End the film, if there is one; its path."""
        path = self.filming.stop()
        self.panel.show_filming(None)
        return path

    # ------------------------------------------------------------------------------------------------- loop

    def run(self, most: int | None = None) -> None:
        """Serve the page until `stop` is called, the process is interrupted, or `most` actions are taken."""
        last = perf_counter()
        self._most = most
        while not self._stopped and not self._is_done():
            now = perf_counter()
            self.tick(now - last)
            last = now
            rest = TICK - (perf_counter() - now)
            if rest > 0:
                self.requests.wait(rest)

    def _is_done(self) -> bool:
        return self._most is not None and self.taken >= self._most

    def tick(self, elapsed: float) -> None:
        """Fulfil what the page asked for, then let `elapsed` seconds pass, if time runs."""
        self.requests.fulfil_all()
        tapped = self._tapped()
        if self.is_playing:
            self._behind = min(self._behind + elapsed, max(LONGEST_CATCH_UP, 1.0 / self.robot.control_freq))
            period = self.robot.steps_per_control * self.stage.scene.world.timestep
            while self._behind >= period and self.is_playing and not self._is_done():
                self._behind -= period
                if not self.requests.fulfil(lambda tapped=tapped: self._act(tapped)):
                    self.play(False)
                tapped = ()
        now = perf_counter()
        if now - self._last_handles > HANDLE_PERIOD:
            self._last_handles = now
            self.hands.follow()
            if not self.panel.scans_box.value:
                self.scans.clear()
            elif self.viewer.watchers:
                self.scans.show(lidars_of(self.robot))
            self._pace = [*self._pace[-10:], (now, self.stage.scene.world.time)]
            if now > self._quiet_until:
                self.show_status()

    def _act(self, tapped: tuple[str, ...]) -> None:
        """One control step."""
        held = dict.fromkeys((*self.keys.held, *tapped))
        self.robot.apply_action(self.action_source.action(held, self.joysticks.values))
        self.stage.scene.world.step(self.robot.steps_per_control)
        self.taken += 1
        if self.recorder is not None:
            self.recorder.take()
        if self.filming.film is not None:
            self.filming.take(self.stage, self.camera())

    def _tapped(self) -> tuple[str, ...]:
        """Keys that went down since the last look, though they may be up again."""
        tapped = []
        for _ in range(self._events.qsize()):
            event = self._events.get()
            if not event.is_down:
                continue
            if event.key == "r":
                self.requests.fulfil(self.reset)
            self.action_source.press(event.key)
            tapped.append(event.key)
        return tuple(tapped)

    def camera(self) -> Camera:
        """What the page that was opened first looks at; the scene's own view where no page is open."""
        for client in self.viewer.server.get_clients().values():
            place = client.camera
            fovy = float(np.clip(place.fov, 0.05, 3.0))
            return Camera.look_at(
                place.position, place.look_at, place.up_direction, width=WIDTH, height=HEIGHT, fovy=fovy
            )
        return self.stage.scene.camera(width=WIDTH, height=HEIGHT)

    def show_status(self) -> None:
        """Tell how things stand."""
        (wall, time), world = self._pace[0], self.stage.scene.world
        passed = perf_counter() - wall
        rate = (world.time - time) / passed if passed > 0.2 else 1.0
        state = f"{max(rate, 0.0):.2f}x real time" if self.is_playing else "paused"
        self.panel.status.content = f"{world.time:.1f} s, {state}. {self.action_source.status()}"

    def complain(self, words: str) -> None:
        """Show what went wrong for a while."""
        self._quiet_until = perf_counter() + COMPLAINT_PERIOD
        self.panel.complain(words)

    def stop(self) -> None:
        """Let `run` return; may be called from any thread."""
        self._stopped = True

    def close(self) -> None:
        """End a film that runs, and take the page down."""
        self.stop()
        self.filming.stop()
        self.viewer.close()
