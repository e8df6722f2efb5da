"""The panel of a page that drives."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from roboyard.errors import ConfigError, unknown_name
from roboyard.robots import REGISTERED_ROBOTS
from roboyard.scenes import SCENES
from roboyard.viewer.driving.action_source import HELP, SPEED
from roboyard.viewer.driving.video import endings, free_file, read_moment
from roboyard.viewer.inspector.panels.link_panel import plain
from roboyard.viewer.scene.scans import lidars_of

if TYPE_CHECKING:
    from roboyard.viewer.driving.page import DrivingPage

NO_MOMENT = "(none saved)"
MOST_UPLOADED = 50 * 2**20
"""bytes"""


class DrivingPanel:
    """Buttons, choices and the words of a `DrivingPage`."""

    def __init__(self, gui: Any, page: DrivingPage) -> None:
        self._page, self._gui = page, gui
        self._of_robot: list[Any] = []
        self.status = gui.add_markdown("")
        self.play_button = gui.add_button("Pause", color="orange")
        self.reset_button = gui.add_button("Reset", hint="back to the beginning (key r)")
        self.follow_box = gui.add_checkbox("camera goes along", True)
        self.handles_box = gui.add_checkbox("handles on the hands", True, hint="drag one; the arm goes there")
        self.scans_box = gui.add_checkbox(
            "lidar scans", False, hint="points where the rays of the robot's lidars end"
        )
        self.speed_slider = gui.add_slider(
            "speed", min=0.05, max=1.0, step=0.05, initial_value=SPEED, hint="of the base's largest speed"
        )
        tabs = gui.add_tab_group()
        with tabs.add_tab("Grippers"):
            self._grippers = gui.add_folder("Grippers")
        with tabs.add_tab("Keys"):
            gui.add_markdown(HELP)
        with tabs.add_tab("Set-up"):
            self._add_set_up(gui)
        with tabs.add_tab("Film"):
            self._add_film(gui)
        with tabs.add_tab("Moments"):
            self._add_moments(gui)
        do = page.requests.do
        self.play_button.on_click(lambda _: do(lambda: page.play(not page.is_playing)))
        self.reset_button.on_click(lambda _: do(page.reset))
        self.follow_box.on_update(lambda event: do(lambda on=event.target.value: self._follow(on)))
        self.handles_box.on_update(lambda event: do(lambda on=event.target.value: page.hands.show(on)))
        self.speed_slider.on_update(
            lambda event: setattr(page.action_source, "speed", float(event.target.value))
        )

    def _add_set_up(self, gui: Any) -> None:
        page = self._page
        scene, robot = str(page.stage.setup["scene"]), str(page.stage.setup["robot"])
        self.scene_choice = gui.add_dropdown("scene", _with(list(SCENES), scene), initial_value=scene)
        self.robot_choice = gui.add_dropdown(
            "robot", _with(list(REGISTERED_ROBOTS), robot), initial_value=robot
        )
        self.load_button = gui.add_button("Set up", hint="loads the scene and puts the robot into it")
        self._controllers = gui.add_folder("Controllers")
        self.load_button.on_click(lambda _: page.requests.do(self._set_up))

    def _add_film(self, gui: Any) -> None:
        page = self._page
        self.ending_choice = gui.add_dropdown("format", endings(), initial_value=endings()[0])
        self.film_button = gui.add_button("Record", color="red", hint="what this page looks at")
        self.film_text = gui.add_markdown("")
        self.film_button.on_click(lambda event: page.requests.do(lambda: self._film(event.client)))

    def _add_moments(self, gui: Any) -> None:
        page = self._page
        self.save_button = gui.add_button("Save this moment")
        self.moment_choice = gui.add_dropdown("moment", (NO_MOMENT,), initial_value=NO_MOMENT)
        self.restore_button = gui.add_button("Go back to it")
        self.keep_button = gui.add_button("Write it to a file", hint="for later, or for `roboyard replay`")
        self.upload_button = gui.add_upload_button("Load a file", mime_type=".npz")
        self.moment_text = gui.add_markdown("")
        self.save_button.on_click(lambda _: page.requests.do(self._save))
        self.restore_button.on_click(lambda _: page.requests.do(self._restore))
        self.keep_button.on_click(lambda event: page.requests.do(lambda: self._keep(event.client)))
        self.upload_button.on_upload(
            lambda event: page.requests.do(lambda data=event.target.value.content: self._take_in(data))
        )

    # ------------------------------------------------------------------------------------------------ shown

    def show_robot(self) -> None:
        """Buttons and choices of the robot that is there now."""
        for handle in self._of_robot:
            handle.remove()
        self._of_robot.clear()
        page, robot, teleop = self._page, self._page.robot, self._page.action_source.teleop
        with self._grippers:
            for index, (group, _) in enumerate(teleop.grippers):
                buttons = self._gui.add_button_group(group.removeprefix("gripper_"), ("open", "close"))
                buttons.on_click(
                    lambda event, k=index: page.requests.do(
                        lambda on=event.target.value == "open": teleop.set_gripper(k, is_open=on)
                    )
                )
                self._of_robot.append(buttons)
            if not teleop.grippers:
                self._of_robot.append(self._gui.add_markdown("No gripper that opens and closes."))
        with self._controllers:
            for group, allowed in robot.definition.allowed_controllers().items():
                if group in robot.controllers:
                    self._of_robot.append(self._controller_choice(group, allowed))
        self.handles_box.visible = bool(page.hands.handles)
        self.scans_box.visible = bool(lidars_of(robot))
        self.speed_slider.visible = bool(page.action_source.joysticks)
        page.hands.show(self.handles_box.value)
        self.scene_choice.value = str(page.stage.setup["scene"])
        self.robot_choice.value = str(page.stage.setup["robot"])
        self._show_moments()

    def _controller_choice(self, group: str, allowed: Any) -> Any:
        page = self._page
        now = type(page.robot.controllers[group]).__name__
        choice = self._gui.add_dropdown(group, _with(list(allowed), now), initial_value=now)

        @choice.on_update
        def _(event: Any) -> None:
            if event.client_id is not None:
                chosen = {group: str(event.target.value)}
                page.requests.do(lambda: page.set_controllers(chosen))

        return choice

    def show_playing(self, playing: bool) -> None:
        """The button says what it would do."""
        self.play_button.label = "Pause" if playing else "Play"
        self.play_button.color = "orange" if playing else "green"

    def show_filming(self, path: Path | None) -> None:
        """Whether a film runs."""
        self.film_button.label = "Record" if path is None else "Stop"
        if path is not None:
            self.film_text.content = f"Recording {plain(path.name)} ..."

    def _show_moments(self, chosen: str | None = None) -> None:
        names = tuple(self._page.moments) or (NO_MOMENT,)
        self.moment_choice.options = names
        self.moment_choice.value = chosen if chosen in names else names[-1]

    def complain(self, words: str) -> None:
        """Show what went wrong."""
        self.status.content = f"**{plain(words)}**"

    # ------------------------------------------------------------------------------------------------ wishes

    def _follow(self, on: bool) -> None:
        page = self._page
        page.follow.set(page.viewer.path_of(page.robot.base_link) if on else None)

    def _set_up(self) -> None:
        self.status.content = "Setting up ..."
        setup = {"scene": self.scene_choice.value, "robot": self.robot_choice.value}
        self._check_offered(setup)
        self._page.set_up(setup)

    def _check_offered(self, setup: Mapping[str, Any]) -> None:
        """What a page sends may be anything: only scenes and robots on offer are loaded, never a path.

        Raises:
            ConfigError: it names another.
        """
        for key, choice in (("scene", self.scene_choice), ("robot", self.robot_choice)):
            if setup.get(key) not in choice.options:
                raise ConfigError(unknown_name(key, str(setup.get(key)), list(choice.options)))

    def _film(self, client: Any) -> None:
        page = self._page
        if page.filming.film is None:
            page.start_film(ending=self.ending_choice.value)
            return
        path = page.stop_film()
        if path is None:
            self.film_text.content = "Nothing was filmed."
            return
        self.film_text.content = f"Wrote {plain(str(path))}"
        if client is not None:
            client.send_file_download(path.name, path.read_bytes())

    def _save(self) -> None:
        self._show_moments(self._page.save_moment())

    def _restore(self) -> None:
        if self.moment_choice.value in self._page.moments:
            self._page.load_moment(self._page.moments[self.moment_choice.value])

    def _keep(self, client: Any) -> None:
        page = self._page
        if self.moment_choice.value not in page.moments:
            self._save()
        stem = f"{page.stage.setup['robot']}-{page.stage.scene.name}-moment"
        path = page.moments[self.moment_choice.value].save(free_file(page.folder, stem, "npz"))
        self.moment_text.content = f"Wrote {plain(str(path))}"
        if client is not None:
            client.send_file_download(path.name, path.read_bytes())

    def _take_in(self, data: bytes) -> None:
        """A file that a page sent; it is read as untrusted plain arrays."""
        if len(data) > MOST_UPLOADED:
            raise ConfigError(f"a state log of {len(data) / 2**20:.0f} MiB is too large for the page")
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "upload.npz"
            file.write_bytes(data)
            log = read_moment(file)
        self._check_offered(log.setup)
        self._page.load_moment(log)


def _with(names: list[str], chosen: str) -> tuple[str, ...]:
    """The names, and the chosen one in any case."""
    return tuple(dict.fromkeys([*names, chosen]))
