"""State of a page that drives a robot, and the requests that change it; independent of the panel."""

from __future__ import annotations

import queue
from collections.abc import Mapping
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from roboyard.recording import Recorder, SceneSetup, set_up
from roboyard.recording.state_log import StateLog
from roboyard.rendering import Camera
from roboyard.viewer.bar.bar import Controls
from roboyard.viewer.driving.action_source import KEY_NAMES, ActionSource
from roboyard.viewer.driving.aim import look_from_behind, seen_heights
from roboyard.viewer.driving.ik_handles import IkHandles
from roboyard.viewer.driving.insets import Insets
from roboyard.viewer.driving.planned_moves import PlannedMoves
from roboyard.viewer.driving.video import HEIGHT, WIDTH, VideoRecording, free_file, is_same_scene, moment_of
from roboyard.viewer.page.joysticks import Joysticks
from roboyard.viewer.page.keys import KeyEvent, Keys
from roboyard.viewer.page.markdown import plain
from roboyard.viewer.page.requests import RequestQueue
from roboyard.viewer.page.server import DEFAULT_PORT
from roboyard.viewer.scene.follow import Follow
from roboyard.viewer.scene.scans import Scans
from roboyard.viewer.scene.see_through import SeeThrough
from roboyard.viewer.viewer import Viewer

if TYPE_CHECKING:
    from roboyard.robots import Robot
    from roboyard.sim import World
    from roboyard.transforms import Array

MESSAGE_PERIOD = 5.0
"""Least time for which an error or a message stays on the page (s)."""


class SessionPanel(Protocol):
    """The elements of the page that a session updates."""

    @property
    def follows_robot(self) -> bool:
        """Whether the camera follows the robot."""
        ...

    @property
    def sees_through(self) -> bool:
        """Whether walls and furniture that hide the robot fade in pages."""
        ...

    @property
    def plans_moves(self) -> bool:
        """Whether arms move to their handles on planned ways."""
        ...

    def show_robot(self) -> None:
        """Show the buttons and choices of the session's robot."""
        ...

    def show_recording(self, path: Path | None) -> None:
        """Show which video is being recorded; None: none."""
        ...

    def show_status(self, text: str) -> None:
        """Show the status line (Markdown)."""
        ...

    def show_error(self, message: str) -> None:
        """Show an error message (plain text)."""
        ...


class DrivingSession:
    """A scene with a robot, its inputs, videos and saved moments.

    All methods run in the simulation thread; the panel puts its requests into `requests`.
    """

    def __init__(
        self,
        setup: Mapping[str, Any],
        *,
        host: str = "127.0.0.1",
        port: int = DEFAULT_PORT,
        folder: Path | None = None,
        quiet: bool = False,
    ) -> None:
        """Load a scene with a robot and open a viewer; subclasses set `_panel` and call `start`.

        Args:
            setup: scene, robot and controllers; see `roboyard.recording.set_up`.
            host: address to listen on.
            port: first port to try.
            folder: where videos and moments are written; the working directory by default.
            quiet: do not print the address.

        Raises:
            ConfigError: `setup` is invalid, or the server cannot listen on `host` and `port`.
            MissingExtraError: viser is not installed.
        """
        self.folder = Path() if folder is None else folder
        self._panel: SessionPanel
        self.scene_setup: SceneSetup = set_up(setup)
        self.viewer = Viewer(self.world, host, port, title="Roboyard: drive", quiet=quiet)
        server = self.viewer.server
        self.requests = RequestQueue(self.show_error)
        self.keys = Keys(server, grab=KEY_NAMES)
        self._events: queue.SimpleQueue[KeyEvent] = queue.SimpleQueue()
        self.keys.subscribe(self._events.put)
        self.joysticks = Joysticks(server)
        self.follow = Follow(server)
        self.see_through = SeeThrough(server)
        self.recording = VideoRecording()
        self.filmed_client: int | None = None
        """Number of the client whose page started the video; None: no page did."""
        self.scans = Scans(server)
        self.insets = Insets(server, self.requests.do)
        self.recorder: Recorder | None = None
        """State recorder that samples each control step; None: none."""
        self.moments: dict[str, StateLog] = {}
        self.is_playing = True
        self._speed: float | None = None
        self._behind = 0.0
        self._single_steps = 0
        """Control periods that `tick` simulates while paused."""
        self._message_until = 0.0
        self._pace = [(perf_counter(), self.world.time)]
        self.time_speed: float | None = 1.0
        """Simulated seconds per second; None: as fast as possible."""
        self.viewer.bar.controls = Controls(
            play=lambda playing: self.requests.do(lambda: self.play(playing)),
            step=lambda: self.requests.do(self.step_once),
            reset=lambda: self.requests.do(self.reset),
            set_speed=lambda speed: self.requests.do(lambda: self.set_time_speed(speed)),
            home=lambda client: self.requests.do(lambda: look_from_behind(self.viewer, self.robot, client)),
            refresh=lambda: self.requests.do(self.viewer.sync),
        )
        self.viewer.bar.show(speed=self.time_speed)

    @property
    def world(self) -> World:
        """The simulated world."""
        return self.scene_setup.scene.world

    @property
    def robot(self) -> Robot:
        """The driven robot."""
        assert self.scene_setup.robot is not None
        return self.scene_setup.robot

    def start(self) -> None:
        """Connect the inputs to the robot, after the robot or its controllers changed."""
        self.action_source = ActionSource(self.robot)
        if self._speed is not None:
            self.action_source.speed = self._speed
        self.ik_handles = IkHandles(self.viewer, self.action_source)
        self.planned_moves = PlannedMoves(self.viewer, self.action_source, self.ik_handles.let_go)
        self.joysticks.show(self.action_source.joysticks)
        self._start = self.world.save_state()
        self.viewer.time_folder.setup = self.scene_setup.setup
        self._panel.show_robot()
        self.insets.show_robot(self.robot)
        self.set_follow(self._panel.follows_robot)
        self.set_see_through(self._panel.sees_through)
        self.set_planning(self._panel.plans_moves)
        self.show_status()

    # --------------------------------------------------------------------------------------------- requests

    def set_up(self, setup: Mapping[str, Any]) -> None:
        """Replace the scene, the robot and its controllers; the old ones stay if loading fails.

        Raises:
            ConfigError: `setup` is invalid.
        """
        self.stop_video()
        self.ik_handles.remove()
        try:
            self.scene_setup = set_up(setup)
            self.moments = {
                name: log
                for name, log in self.moments.items()
                if is_same_scene(log.setup, self.scene_setup.setup)
            }
            self.recorder = None
            self.viewer.show_world(self.world)
            self.viewer.sync(wait=True)
        finally:
            self.start()
        look_from_behind(self.viewer, self.robot)

    def set_controllers(self, controllers: Mapping[str, str]) -> None:
        """Replace the controllers of some joint groups; the robot keeps its state."""
        chosen = {**(self.scene_setup.setup.get("controllers") or {}), **controllers}
        self.robot.reload_controllers(chosen)
        self.scene_setup.setup["controllers"] = chosen
        self.ik_handles.remove()
        start = self._start
        self.start()
        self._start = start

    def set_speed(self, speed: float) -> None:
        """Set the fraction of the base's maximum speed at a held key or a full deflection."""
        self._speed = self.action_source.speed = speed

    def set_follow(self, follow: bool) -> None:
        """Let the camera follow the robot, or stay."""
        self.follow.set(self.viewer.path_of(self.robot.base_link) if follow else None)

    def set_see_through(self, on: bool) -> None:
        """Fade walls and furniture between the cameras of pages and the robot, or show them."""
        if on:
            self.see_through.keep(self.viewer.path_of(self.robot.base_link), seen_heights(self.robot))
        else:
            self.see_through.clear()

    def set_planning(self, on: bool) -> None:
        """Let arms take planned ways around obstacles to their handles, or follow the handles directly."""
        self.planned_moves.stop()
        self.ik_handles.release()
        do = self.requests.do
        self.ik_handles.on_release = (
            (lambda group, pose: do(lambda: self._plan_move(group, pose))) if on else None
        )

    def _plan_move(self, group: str, pose: Array) -> None:
        """Plan the motion of an arm to a (4, 4) pose in the base frame, and begin it."""
        self.action_source.targets.pop(group, None)
        try:
            self.show_message(self.planned_moves.start(group, pose))
        finally:
            if not self.planned_moves.moves(group):
                self.ik_handles.let_go(group)

    def play(self, playing: bool) -> None:
        """Run or pause the simulation."""
        self.is_playing, self._behind = playing, 0.0
        self.viewer.bar.show(playing=playing)
        self.show_status()

    def set_time_speed(self, speed: float | None) -> None:
        """Set simulated seconds per second; None: as fast as possible."""
        self.time_speed, self._behind = speed, 0.0
        self.viewer.bar.show(speed=speed)

    def step_once(self) -> None:
        """Pause, and let `tick` simulate one control period."""
        if self.is_playing:
            self.play(False)
        self._single_steps += 1

    def reset(self) -> None:
        """Restore the initial state."""
        self.viewer.grab.release(self.world)
        self.world.restore_state(self._start)
        self.robot.reset()
        self.action_source.reset()
        self._after_jump()

    def save_moment(self) -> str:
        """Save the current state in memory; returns its name."""
        log = moment_of(self.scene_setup)
        name = f"{len(self.moments) + 1}: {log.time[-1]:.1f} s"
        self.moments[name] = log
        return name

    def load_moment(self, log: StateLog) -> None:
        """Restore the last state of a log, and its scene if that is another one.

        Raises:
            ConfigError: the log's scene cannot be set up, or its states do not fit.
        """
        if not is_same_scene(log.setup, self.scene_setup.setup):
            self.set_up(log.setup)
        self.viewer.grab.release(self.world)
        log.check_fits(self.world)
        log.restore(self.world, len(log) - 1)
        self.robot.loop.invalidate()
        for controller in self.robot.controllers.values():
            controller.reset()
        self.action_source.targets.clear()
        self._after_jump()

    def _after_jump(self) -> None:
        self._behind = 0.0
        self.viewer.sync()
        self.planned_moves.stop()
        self.ik_handles.release()
        self.show_status()

    def start_video(
        self, path: Path | None = None, ending: str = "gif", *, client: int | None = None
    ) -> Path:
        """Start to record a video; returns its path.

        Args:
            path: file to write; a free name in `folder` by default.
            ending: file name ending of that free name.
            client: number of the client whose page is filmed; None: the page used last.
        """
        self.filmed_client = client
        if path is None:
            path = free_file(self.folder, self.file_stem, ending)
        self.recording.start(path, self.world.time)
        self._panel.show_recording(path)
        return path

    def stop_video(self) -> Path | None:
        """Finish the video; returns its path, or None if nothing was recorded."""
        path = self.recording.stop()
        self._panel.show_recording(None)
        return path

    @property
    def file_stem(self) -> str:
        """Start of the names of the files that this session writes."""
        return f"{self.scene_setup.setup['robot']}-{self.scene_setup.scene.name}"

    # ----------------------------------------------------------------------------------------------- status

    def camera(self) -> Camera:
        """Return the camera of the filmed page; the scene's own view without a page.

        It is the page whose button started the video while that page is open, else the page used last.
        """
        clients = self.viewer.server.get_clients()
        client = clients.get(self.filmed_client, self.viewer.last_used.client)
        if client is not None:
            view = client.camera
            fovy = float(np.clip(view.fov, 0.05, 3.0))
            return Camera.look_at(
                view.position, view.look_at, view.up_direction, width=WIDTH, height=HEIGHT, fovy=fovy
            )
        return self.scene_setup.scene.camera(width=WIDTH, height=HEIGHT)

    def show_status(self) -> None:
        """Show simulated time, speed and selection."""
        wall, time = self._pace[0]
        passed = perf_counter() - wall
        rate = (self.world.time - time) / passed if passed > 0.2 else 1.0
        state = f"{max(rate, 0.0):.2f}x real time" if self.is_playing else "paused"
        self._panel.show_status(f"{self.world.time:.1f} s, {state}. {self.action_source.status()}")

    def show_error(self, message: str) -> None:
        """Show an error for at least `MESSAGE_PERIOD`."""
        self._message_until = perf_counter() + MESSAGE_PERIOD
        self._panel.show_error(message)

    def show_message(self, text: str) -> None:
        """Show plain text in place of the status for `MESSAGE_PERIOD`."""
        self._message_until = perf_counter() + MESSAGE_PERIOD
        self._panel.show_status(plain(text))
