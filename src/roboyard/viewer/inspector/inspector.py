"""`Inspector`: one robot on a page, with switches, sliders and findings; it owns its world and steps it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np

from roboyard.errors import RoboyardError
from roboyard.sim import World
from roboyard.sim.body import Body
from roboyard.viewer.inspector.panels.all_panels import Panels
from roboyard.viewer.inspector.read_robot import ReadRobot, read_robot
from roboyard.viewer.inspector.robot_source import RobotSource
from roboyard.viewer.page.markdown import plain
from roboyard.viewer.page.requests import RequestQueue
from roboyard.viewer.page.server import DEFAULT_PORT
from roboyard.viewer.viewer import Viewer

TICK = 1.0 / 60.0
"""s: how often the page's wishes are looked at."""
LONGEST_CATCH_UP = 0.1
"""s: simulated time falls behind real time rather than that a tick takes longer."""
CLEARANCE = 0.001
"""m between the robot's lowest point and the floor."""
STATUS_PERIOD = 0.25
"""s"""
COMPLAINT_PERIOD = 5.0
"""s that a complaint stays on the page at least."""


class Inspector:
    """A robot on a floor, paused until someone plays. All edits happen in the thread that calls `tick`."""

    def __init__(
        self,
        source: RobotSource,
        *,
        host: str = "127.0.0.1",
        port: int = DEFAULT_PORT,
        fixed_base: bool = True,
        self_collision: bool = False,
        packages: Mapping[str, Path] | None = None,
        quiet: bool = False,
    ) -> None:
        """Read, audit and show a robot.

        Args:
            source: which robot; see `find_robot`.
            host: address to listen at.
            port: first port to try.
            fixed_base: bolt the root link to the world.
            self_collision: let links of the robot touch one another.
            packages: folders of `package://` names.
            quiet: do not print the address.

        Raises:
            DescriptionError: the URDF cannot be used; the message says what is wrong and how to mend it.
            MissingExtraError: viser is not installed.
            ConfigError: a planner file is wrong, or nothing can listen at `host` and `port`.
        """
        self._fixed_base, self._self_collision = fixed_base, self_collision
        self._packages = packages
        self._requests = RequestQueue(self._show_error)
        self._wiggle: Iterator[str] | None = None
        self._behind = 0.0
        self._last_status = 0.0
        self._stopped = False
        self.is_playing = False
        self.world = World()
        self.world.add_plane()
        self._put(read_robot(source, self._packages))
        self.viewer = Viewer(self.world, host, port, title=source.name, quiet=quiet, on_click=self._on_click)
        self._add_time(self.viewer.server.gui)
        self._add_panels({})
        self._show_status()

    def _put(self, robot: ReadRobot) -> None:
        """Stand a robot on the floor."""
        self.body: Body = self.world.add_urdf(
            robot.description,
            name=robot.source.name,
            fixed_base=self._fixed_base,
            self_collision=self._self_collision,
        )
        self._robot, self.audit = robot, robot.audit
        self._stand()
        self._start = self.world.save_state()

    def load(self, source: RobotSource, told: str = "") -> None:
        """Another robot, or the same one from new files, in the place of this one; `told` stands under Save.

        Raises as the constructor does; the old robot stays then.
        """
        robot, before = read_robot(source, self._packages), self._robot
        self._end_wiggle()
        self.play(False)
        shown = {label: box.value for label, box in self.switches.items()}
        self.panels.remove()
        self.world.remove(self.body)
        try:
            self._put(robot)
        except RoboyardError:
            self._put(before)
            raise
        finally:
            self.viewer.sync(wait=True)
            self._add_panels(shown)
        self.panels.save.told.content = told
        self._after_moving()

    def _stand(self) -> None:
        """Put the robot on the floor, joints at zero or as near to it as their limits let them."""
        body = self.body
        limits = body.joint_limits
        body.joint_positions = np.clip(0.0, limits[:, 0], limits[:, 1])
        lowest = float(body.bounds[0, 2])
        body.set_pose(position=(0.0, 0.0, body.position[2] - lowest + CLEARANCE))

    # ----------------------------------------------------------------------------------------------- panels

    def _add_time(self, gui: Any) -> None:
        self._status = gui.add_markdown("")
        with gui.add_folder("Time"):
            self.play_button = gui.add_button("Play", color="green")
            self.step_button = gui.add_button("Step", hint="one time step")
            self.reset_button = gui.add_button("Reset", hint="back to how it was loaded")
            self.gravity_box = gui.add_checkbox("gravity", True)
            self.hold_box = gui.add_checkbox("drives hold the joints", True)
        self.play_button.on_click(lambda _: self.do(lambda: self.play(not self.is_playing)))
        self.step_button.on_click(lambda _: self.do(self.step_once))
        self.reset_button.on_click(lambda _: self.do(self.reset))
        self.gravity_box.on_update(lambda event: self.do(lambda on=event.target.value: self.set_gravity(on)))
        self.hold_box.on_update(lambda event: self.do(lambda on=event.target.value: self.joints.hold(on)))

    def _add_panels(self, shown: Mapping[str, bool]) -> None:
        """The tabs of the robot; `shown` says which boxes of the tab Show are ticked."""
        self.panels = Panels(
            viewer=self.viewer,
            world=self.world,
            body=self.body,
            source=self._robot.source,
            audit=self.audit,
            notes=self._robot.notes,
            do=self.do,
            wiggle=self.wiggle,
            reload=self.load,
        )
        panels = self.panels
        self.overlays, self.switches, self.links = panels.overlays, panels.switches, panels.links
        self.joints, self.plot, self.camera = panels.joints, panels.plot, panels.camera
        self.wiggle_button = panels.wiggle_button
        self.joints.is_held = bool(self.hold_box.value)
        for label, box in self.switches.items():
            if shown.get(label, box.value) != box.value:
                box.value = shown[label]
                panels.switch(label, shown[label])

    def _on_click(self, owner: tuple[int, int]) -> None:
        body_id, index = owner
        self.do(lambda: self.links.pick(self.body.links[index] if body_id == self.body.id else None))

    # ----------------------------------------------------------------------------------------------- wishes

    def do(self, wish: Callable[[], None]) -> None:
        """Have something done at the next tick; may be called from any thread."""
        self._requests.do(wish)

    def play(self, playing: bool) -> None:
        """Let time run, or stop it."""
        if playing:
            self._end_wiggle()
        self.is_playing = playing
        self._behind = 0.0
        self.joints.play(playing)
        self.play_button.label = "Pause" if playing else "Play"
        self.play_button.color = "orange" if playing else "green"
        self._show_status()

    def step_once(self) -> None:
        """One time step; stops playing."""
        if self.is_playing:
            self.play(False)
        self._end_wiggle()
        self.joints.play(True)
        self.world.step()
        self.joints.play(False)
        self._after_moving()

    def reset(self) -> None:
        """Back to how the robot was loaded, paused."""
        self._end_wiggle()
        self.play(False)
        self.world.restore_state(self._start)
        self.joints.show_positions()
        self.plot.clear()
        self._after_moving()

    def wiggle(self) -> None:
        """Take every joint to its limits and back, without physics; a second call ends it."""
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
        last = perf_counter()
        while not self._stopped:
            now = perf_counter()
            self.tick(now - last)
            last = now
            rest = TICK - (perf_counter() - now)
            if rest > 0 and self._requests.wait(rest):
                self._after_moving()

    def _execute(self, request: Callable[[], None]) -> bool:
        done = self._requests.execute(request)
        if done:
            self._after_moving()
        return done

    def _show_error(self, words: str) -> None:
        self._last_status = perf_counter() + COMPLAINT_PERIOD
        self._status.content = f"**{plain(words)}**"

    def tick(self, elapsed: float) -> None:
        """Fulfil what the page asked for, then let `elapsed` seconds pass, if time runs."""
        if self._requests.execute_all():
            self._after_moving()
        if self.is_playing:
            self._behind = min(self._behind + elapsed, LONGEST_CATCH_UP)
            steps = int(self._behind / self.world.timestep)
            if steps:
                self._behind -= steps * self.world.timestep
                if self._execute(lambda: self.world.step(steps)):
                    self.plot.sample(self.world.time, self.body.joint_velocities)
                else:
                    told = self._status.content
                    self.play(False)
                    self._status.content = told
        elif self._wiggle is not None:
            name = next(self._wiggle, None)
            if name is None:
                self._end_wiggle()
            else:
                self._status.content = f"Wiggling **{name}**"
            self._after_moving()
        self.panels.mounts.update(watched=self.viewer.watchers > 0)

    def _after_moving(self) -> None:
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
        """Take the page down."""
        self.stop()
        self.viewer.close()
