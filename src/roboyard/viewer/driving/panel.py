"""The panel of a page that drives a robot."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from roboyard.errors import ConfigError, unknown_name
from roboyard.robots import REGISTERED_ROBOTS
from roboyard.scenes import SCENES
from roboyard.viewer.driving.action_source import DEFAULT_SPEED, HELP
from roboyard.viewer.driving.session import DrivingSession
from roboyard.viewer.driving.video import endings, free_file, read_moment
from roboyard.viewer.page.callbacks import in_order, of_pages
from roboyard.viewer.page.markdown import plain
from roboyard.viewer.scene.scans import lidars_of

NO_MOMENT = "(none saved)"
MAX_UPLOAD = 50 * 2**20
"""Size of the largest state log that a page may upload (bytes)."""


class DrivingPanel:
    """Buttons, choices and texts of a `DrivingSession`."""

    def __init__(self, gui: Any, session: DrivingSession) -> None:
        """Add the elements to a `viser` panel; their callbacks put requests into the session's queue."""
        self._session, self._gui = session, gui
        self._of_robot: list[Any] = []
        self.status = gui.add_markdown("")
        self.follow_box = gui.add_checkbox("camera follows the robot", True)
        self.through_box = gui.add_checkbox(
            "see through walls", True, hint="walls and furniture between the camera and the robot fade"
        )
        self.handles_box = gui.add_checkbox(
            "end effector handles", True, hint="drag a handle; the arm moves its end effector there"
        )
        self.plan_box = gui.add_checkbox(
            "plan around obstacles", False, hint="an arm moves when its handle is let go, on a planned way"
        )
        self.scans_box = gui.add_checkbox("lidar scans", False, hint="points hit by the robot's lidars")
        self.speed_slider = gui.add_slider(
            "speed",
            min=0.05,
            max=1.0,
            step=0.05,
            initial_value=DEFAULT_SPEED,
            hint="fraction of the maximum speed of the base and of planned motions",
        )
        tabs = gui.add_tab_group()
        with tabs.add_tab("Grippers"):
            self._grippers = gui.add_folder("Grippers")
        with tabs.add_tab("Keys"):
            gui.add_markdown(HELP)
        with tabs.add_tab("Setup"):
            self._add_set_up(gui)
        with tabs.add_tab("Video"):
            self._add_video(gui)
        with tabs.add_tab("Moments"):
            self._add_moments(gui)
        do = session.requests.do
        for element, change in (
            (self.follow_box, session.set_follow),
            (self.through_box, session.set_see_through),
            (self.handles_box, lambda on: session.ik_handles.show(on)),
            (self.plan_box, session.set_planning),
            (self.speed_slider, session.set_speed),
        ):
            element.on_update(
                in_order(lambda event, change=change: do(lambda now=event.target.value: change(now)))
            )

    def _add_set_up(self, gui: Any) -> None:
        setup = self._session.scene_setup.setup
        scene, robot = str(setup["scene"]), str(setup["robot"])
        self.scene_choice = gui.add_dropdown("scene", _with(list(SCENES), scene), initial_value=scene)
        self.robot_choice = gui.add_dropdown(
            "robot", _with(list(REGISTERED_ROBOTS), robot), initial_value=robot
        )
        self.load_button = gui.add_button("Load", hint="loads the scene and spawns the robot")
        self._controllers = gui.add_folder("Controllers")
        self.load_button.on_click(in_order(lambda _: self._session.requests.do(self._set_up)))

    def _add_video(self, gui: Any) -> None:
        do = self._session.requests.do
        self.ending_choice = gui.add_dropdown("format", endings(), initial_value=endings()[0])
        self.video_button = gui.add_button("Record", color="red", hint="records the view of this page")
        self.video_text = gui.add_markdown("")
        self.video_button.on_click(in_order(lambda event: do(lambda: self._record(event.client))))

    def _add_moments(self, gui: Any) -> None:
        do = self._session.requests.do
        self.save_button = gui.add_button("Save this moment")
        self.moment_choice = gui.add_dropdown("moment", (NO_MOMENT,), initial_value=NO_MOMENT)
        self.restore_button = gui.add_button("Restore it")
        self.keep_button = gui.add_button("Write it to a file", hint="to load here or with `roboyard replay`")
        self.upload_button = gui.add_upload_button("Load a file", mime_type=".npz")
        self.moment_text = gui.add_markdown("")
        self.save_button.on_click(in_order(lambda _: do(self._save)))
        self.restore_button.on_click(in_order(lambda _: do(self._restore)))
        self.keep_button.on_click(in_order(lambda event: do(lambda: self._keep(event.client))))
        self.upload_button.on_upload(
            lambda event: do(lambda data=event.target.value.content: self._load_upload(data))
        )

    # ---------------------------------------------------------------------------------------------- display

    @property
    def follows_robot(self) -> bool:
        """Whether the camera follows the robot."""
        return bool(self.follow_box.value)

    @property
    def sees_through(self) -> bool:
        """Whether walls and furniture that hide the robot fade in pages."""
        return bool(self.through_box.value)

    @property
    def plans_moves(self) -> bool:
        """Whether arms move to their handles on planned ways."""
        return bool(self.plan_box.value)

    def show_robot(self) -> None:
        """Show the buttons and choices of the session's robot."""
        for handle in self._of_robot:
            handle.remove()
        self._of_robot.clear()
        session, robot, bindings = (
            self._session,
            self._session.robot,
            self._session.action_source.key_bindings,
        )
        with self._grippers:
            for index, (group, _) in enumerate(bindings.grippers):
                buttons = self._gui.add_button_group(group.removeprefix("gripper_"), ("open", "close"))
                buttons.on_click(
                    in_order(
                        lambda event, k=index: session.requests.do(
                            lambda on=event.target.value == "open": bindings.set_gripper(k, is_open=on)
                        )
                    )
                )
                self._of_robot.append(buttons)
            if not bindings.grippers:
                self._of_robot.append(self._gui.add_markdown("No gripper that opens and closes."))
        with self._controllers:
            for group, allowed in robot.definition.allowed_controllers().items():
                if group in robot.controllers:
                    self._of_robot.append(self._controller_choice(group, allowed))
        self.handles_box.visible = self.plan_box.visible = bool(session.ik_handles.handles)
        self.scans_box.visible = bool(lidars_of(robot))
        self.speed_slider.visible = bool(session.action_source.joysticks or session.ik_handles.handles)
        session.ik_handles.show(self.handles_box.value)
        self.scene_choice.value = str(session.scene_setup.setup["scene"])
        self.robot_choice.value = str(session.scene_setup.setup["robot"])
        self._show_moments()

    def _controller_choice(self, group: str, allowed: Any) -> Any:
        session = self._session
        now = type(session.robot.controllers[group]).__name__
        choice = self._gui.add_dropdown(group, _with(list(allowed), now), initial_value=now)

        def choose(event: Any) -> None:
            chosen = {group: str(event.target.value)}
            session.requests.do(lambda: session.set_controllers(chosen))

        choice.on_update(of_pages(choose))
        return choice

    def show_recording(self, path: Path | None) -> None:
        """Show which video is being recorded; None: none."""
        self.video_button.label = "Record" if path is None else "Stop"
        if path is not None:
            self.video_text.content = f"Recording {plain(path.name)} ..."

    def show_status(self, text: str) -> None:
        """Show the status line (Markdown)."""
        self.status.content = text

    def show_error(self, message: str) -> None:
        """Show an error message (plain text)."""
        self.status.content = f"**{plain(message)}**"

    def _show_moments(self, chosen: str | None = None) -> None:
        names = tuple(self._session.moments) or (NO_MOMENT,)
        self.moment_choice.options = names
        self.moment_choice.value = chosen if chosen in names else names[-1]

    # --------------------------------------------------------------------------------------------- requests

    def _set_up(self) -> None:
        self.status.content = "Loading ..."
        setup = {"scene": self.scene_choice.value, "robot": self.robot_choice.value}
        self._check_offered(setup)
        self._session.set_up(setup)

    def _check_offered(self, setup: Mapping[str, Any]) -> None:
        """Accept only offered scenes and robots, never a path: pages are untrusted.

        Raises:
            ConfigError: `setup` names another scene or robot.
        """
        for key, choice in (("scene", self.scene_choice), ("robot", self.robot_choice)):
            if setup.get(key) not in choice.options:
                raise ConfigError(unknown_name(key, str(setup.get(key)), list(choice.options)))

    def _record(self, client: Any) -> None:
        session = self._session
        if session.recording.writer is None:
            session.start_video(ending=self.ending_choice.value, client=client.client_id)
            return
        path = session.stop_video()
        if path is None:
            self.video_text.content = "No frame was recorded."
            return
        self.video_text.content = f"Wrote {plain(str(path))}"
        _send_file(client, path)

    def _save(self) -> None:
        self._show_moments(self._session.save_moment())

    def _restore(self) -> None:
        if self.moment_choice.value in self._session.moments:
            self._session.load_moment(self._session.moments[self.moment_choice.value])

    def _keep(self, client: Any) -> None:
        session = self._session
        if self.moment_choice.value not in session.moments:
            self._save()
        file = free_file(session.folder, f"{session.file_stem}-moment", "npz")
        path = session.moments[self.moment_choice.value].save(file)
        self.moment_text.content = f"Wrote {plain(str(path))}"
        _send_file(client, path)

    def _load_upload(self, data: bytes) -> None:
        """Restore an uploaded state log, which is untrusted and read as plain arrays."""
        if len(data) > MAX_UPLOAD:
            raise ConfigError(
                f"the state log has {len(data) / 2**20:.0f} MiB; a page accepts {MAX_UPLOAD // 2**20} MiB"
            )
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "upload.npz"
            file.write_bytes(data)
            log = read_moment(file)
        self._check_offered(log.setup)
        self._session.load_moment(log)


def _send_file(client: Any, path: Path) -> None:
    """Let a page download a file; `client` None: no page asked for it."""
    if client is not None:
        client.send_file_download(path.name, path.read_bytes())


def _with(names: list[str], chosen: str) -> tuple[str, ...]:
    """Return the names and the chosen one, each once."""
    return tuple(dict.fromkeys([*names, chosen]))
