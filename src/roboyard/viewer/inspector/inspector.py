"""`Inspector`: one robot on a page with its overlays, sliders, findings and edits, in a world of its own."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np

from roboyard.errors import RoboyardError
from roboyard.sim import World
from roboyard.sim.body import Body
from roboyard.viewer.bar.bar import Controls
from roboyard.viewer.inspector.lead import Lead
from roboyard.viewer.inspector.panels.all_panels import Panels
from roboyard.viewer.inspector.panels.link_tree import Kept
from roboyard.viewer.inspector.read_robot import ReadRobot, read_robot
from roboyard.viewer.inspector.robot_source import RobotSource
from roboyard.viewer.page.callbacks import in_order
from roboyard.viewer.page.loop import serve
from roboyard.viewer.page.markdown import plain
from roboyard.viewer.page.requests import RequestQueue
from roboyard.viewer.page.server import DEFAULT_PORT
from roboyard.viewer.viewer import Viewer

LONGEST_CATCH_UP = 0.1
"""Longest simulated time of one tick (s); a slower simulation falls behind real time."""
CLEARANCE = 0.001
"""Initial distance between the robot's lowest point and the floor (m)."""
STATUS_PERIOD = 0.25
"""Period of updates of the status line (s)."""
ERROR_PERIOD = 5.0
"""Least time for which an error stays on the page (s)."""


class Inspector:
    """A robot on a floor, initially paused. All requests are executed in the thread that calls `tick`."""

    def __init__(
        self,
        source: RobotSource,
        *,
        host: str = "127.0.0.1",
        port: int = DEFAULT_PORT,
        fixed_base: bool = True,
        self_collision: bool = False,
        packages: Mapping[str, Path] | None = None,
        xacro_args: Mapping[str, str] | None = None,
        quiet: bool = False,
        on_open: Callable[[str], object] | None = None,
    ) -> None:
        """Load, audit and show a robot.

        Args:
            source: files of the robot; see `find_robot`.
            host: address to listen on.
            port: first port to try.
            fixed_base: fix the root link to the world.
            self_collision: let links of the robot collide with each other.
            packages: package name to folder, for `package://` references.
            xacro_args: values of `<xacro:arg>` by name, for a xacro file.
            quiet: do not print the address.
            on_open: called with the address once pages can be opened; the robot appears in them later.

        Raises:
            DescriptionError: the URDF is invalid; the message names the cause and the remedy.
            MissingExtraError: viser is not installed.
            ConfigError: a planner file is invalid, or the server cannot listen on `host` and `port`.
        """
        self._fixed_base, self._self_collision = fixed_base, self_collision
        self._packages, self._xacro_args = packages, xacro_args
        self._requests = RequestQueue(self._show_error)
        self._wiggle: Iterator[str] | None = None
        self._behind = 0.0
        self._last_status = 0.0
        self._stopped = False
        self.is_playing = False
        self.speed: float | None = 1.0
        """Simulated seconds per second; None: as fast as possible."""
        self.world = World()
        self.world.add_plane()
        robot = read_robot(source, self._packages, self._xacro_args)
        # a browser loads the page while the robot is built
        self.viewer = Viewer(self.world, host, port, title=source.name, quiet=quiet, on_click=self._on_click)
        try:
            if on_open is not None:
                on_open(self.viewer.url)
            self._spawn(robot, is_early=True)
            self.viewer.sync(wait=True)
        except BaseException:
            self.viewer.close()
            raise
        self.viewer.first_view.aim()
        self._add_time(self.viewer.server.gui)
        self._add_panels({}, {})
        self._show_status()

    def _spawn(self, robot: ReadRobot, *, is_early: bool = False) -> None:
        """Spawn a robot on the floor; `is_early`: show it before the world is compiled."""
        self.body: Body = self.world.add_urdf(
            robot.description,
            name=robot.source.name,
            fixed_base=self._fixed_base,
            self_collision=self._self_collision,
        )
        self._robot = robot
        sending = self.viewer.show_uncompiled(self.body, self._rest(self.body)) if is_early else None
        self._place_on_floor()
        if sending is not None:
            sending.join()
        self._start = self.world.save_state()

    def load(self, source: RobotSource, message: str = "") -> None:
        """Replace the robot, or load it again from new files; `message` is shown under Save.

        Raises the errors of the constructor; the old robot stays then.
        """
        robot, before = read_robot(source, self._packages, self._xacro_args), self._robot
        self._end_wiggle()
        self.play(False)
        shown = {label: box.value for label, box in self.switches.items()}
        kept = self.links.tree.kept()
        self.viewer.grab.release(self.world)
        self.panels.remove()
        self.world.remove(self.body)
        try:
            self._spawn(robot)
        except RoboyardError:
            self._spawn(before)
            raise
        finally:
            self.viewer.sync(wait=True)
            self._add_panels(shown, kept)
        self.panels.save.message.content = message
        self._after_motion()

    @staticmethod
    def _rest(body: Body) -> dict[str, float]:
        """Return each joint at zero, or at the limit nearest to it (rad or m)."""
        limits = body.joint_limits
        return dict(zip(body.joint_names, np.clip(0.0, limits[:, 0], limits[:, 1]).tolist(), strict=True))

    def _place_on_floor(self) -> None:
        """Place the robot on the floor, joints at zero or at the limit nearest to it."""
        body = self.body
        body.joint_positions = self._rest(body)
        lowest = float(body.bounds[0, 2])
        body.set_pose(position=(0.0, 0.0, body.position[2] - lowest + CLEARANCE))

    # ----------------------------------------------------------------------------------------------- panels

    def _add_time(self, gui: Any) -> None:
        self._status = gui.add_markdown("")
        with gui.add_folder("Simulation"):
            self.gravity_box = gui.add_checkbox("gravity", True)
            self.hold_box = gui.add_checkbox("drives hold the joints", True)
        self.viewer.bar.controls = Controls(
            play=lambda playing: self.do(lambda: self.play(playing)),
            step=lambda: self.do(self.step_once),
            reset=lambda: self.do(self.reset),
            set_speed=lambda speed: self.do(lambda: self.set_speed(speed)),
            home=self.viewer.go_home,
            refresh=lambda: self.do(self.viewer.sync),
        )
        self.viewer.bar.show(playing=False, speed=self.speed)
        self.gravity_box.on_update(
            in_order(lambda event: self.do(lambda on=event.target.value: self.set_gravity(on)))
        )
        self.hold_box.on_update(
            in_order(lambda event: self.do(lambda on=event.target.value: self.joints.hold(on)))
        )

    def _add_panels(self, shown: Mapping[str, bool], kept: Kept) -> None:
        """Add the tabs of the robot; `shown` and `kept` have what the tab Look showed of the one before."""
        self.audit = self._robot.audit
        self.panels = Panels(
            viewer=self.viewer,
            world=self.world,
            body=self.body,
            source=self._robot.source,
            audit=self.audit,
            edits=self._robot.edits,
            do=self.do,
            wiggle=self.wiggle,
            reload=self.load,
        )
        panels = self.panels
        self.overlays, self.switches, self.links = panels.overlays, panels.switches, panels.links
        self.joints, self.plot, self.camera = panels.joints, panels.plot, panels.camera
        self.wiggle_button = panels.wiggle_button
        self._lead = Lead(self.body, self.joints.move, self.joints.followers)
        self.joints.is_held = bool(self.hold_box.value)
        for label, box in self.switches.items():
            if shown.get(label, box.value) != box.value:
                box.value = shown[label]
                panels.switch(label, shown[label])
        self.links.tree.keep(kept)

    def _on_click(self, owner: tuple[int, int]) -> None:
        body_id, index = owner
        self.do(lambda: self.links.pick(self.body.links[index] if body_id == self.body.id else None))

    # --------------------------------------------------------------------------------------------- requests

    def do(self, request: Callable[[], None]) -> None:
        """Queue a request for the next tick; may be called from any thread."""
        self._requests.do(request)

    def play(self, playing: bool) -> None:
        """Run or pause the simulation."""
        if playing:
            self._end_wiggle()
        self.is_playing = playing
        self._behind = 0.0
        self.joints.play(playing)
        self.viewer.bar.show(playing=playing)
        self._show_status()

    def set_speed(self, speed: float | None) -> None:
        """Set simulated seconds per second; None: as fast as possible."""
        self.speed, self._behind = speed, 0.0
        self.viewer.bar.show(speed=speed)

    def step_once(self) -> None:
        """Pause and simulate one time step."""
        if self.is_playing:
            self.play(False)
        self._end_wiggle()
        self.joints.play(True)
        self.world.step()
        self.joints.play(False)
        self._after_motion()

    def reset(self) -> None:
        """Restore the initial state and pause."""
        self._end_wiggle()
        self.play(False)
        self.viewer.grab.release(self.world)
        self.world.restore_state(self._start)
        self.joints.show_positions()
        self.plot.clear()
        self._after_motion()

    def wiggle(self) -> None:
        """Move every joint to its limits and back, without physics; a second call stops it."""
        if self._wiggle is not None:
            self._end_wiggle()
            return
        self.play(False)
        self._wiggle = self.joints.wiggle()
        self.wiggle_button.label = "Stop wiggling"

    def _end_wiggle(self) -> None:
        if self._wiggle is not None:
            self._wiggle = None
            self.wiggle_button.label = "Wiggle every joint"
            self._show_status()

    def set_gravity(self, on: bool) -> None:
        """Switch gravity on or off."""
        self.world.gravity = (0.0, 0.0, -9.81 if on else 0.0)

    # ------------------------------------------------------------------------------------------------- loop

    def run(self) -> None:
        """Serve the page until `stop` is called or the process is interrupted."""
        serve(self.tick, self._requests, lambda: self._stopped, after_request=self._after_motion)

    def _execute(self, request: Callable[[], None]) -> bool:
        done = self._requests.execute(request)
        if done:
            self._after_motion()
        return done

    def _show_error(self, message: str) -> None:
        self._last_status = perf_counter() + ERROR_PERIOD
        self._status.content = f"**{plain(message)}**"

    def tick(self, elapsed: float) -> None:
        """Execute the page's requests, then simulate `elapsed` seconds unless paused."""
        if self._requests.execute_all():
            self.panels.history.note()
            self.links.tree.update()
            self._after_motion()
        if self.is_playing:
            passed = LONGEST_CATCH_UP if self.speed is None else self.speed * elapsed
            self._behind = min(self._behind + passed, LONGEST_CATCH_UP)
            steps = int(self._behind / self.world.timestep)
            if steps:
                self._behind -= steps * self.world.timestep
                if self._execute(lambda: self.world.step(steps)):
                    self.plot.sample(self.world.time, self.body.joint_velocities)
                else:
                    error = self._status.content
                    self.play(False)
                    self._status.content = error
        elif self._wiggle is not None:
            name = next(self._wiggle, None)
            if name is None:
                self._end_wiggle()
            else:
                self._status.content = f"Wiggling **{name}**"
            self._after_motion()
        elif self.viewer.grab.is_pending:
            self._lead_body()
        self.panels.sensors.update(watched=self.viewer.watchers > 0)

    def _lead_body(self) -> None:
        """Move the joints of the paused robot so that its grabbed point follows the mouse."""
        grab = self.viewer.grab
        start, drag = grab.take()
        if grab.is_holding or drag is None:
            grab.release(self.world)
        else:
            if start is not None:
                self._lead.start(start)
            self._lead.follow(np.array(drag.target))
            self.joints.show_positions()
        self._after_motion()

    def _after_motion(self) -> None:
        self.viewer.sync()
        self.overlays.update()
        if self._wiggle is None and perf_counter() - self._last_status > STATUS_PERIOD:
            self._show_status()

    def _show_status(self) -> None:
        self._last_status = perf_counter()
        state = "playing" if self.is_playing else "paused"
        contacts = len(self.world.contacts(self.body))
        touching = f", {contacts} contacts" if contacts else ""
        self._status.content = f"{self.world.time:.2f} s, {state}{touching}"

    def stop(self) -> None:
        """Let `run` return; may be called from any thread."""
        self._stopped = True

    def close(self) -> None:
        """Close the page."""
        self.stop()
        self.viewer.close()
