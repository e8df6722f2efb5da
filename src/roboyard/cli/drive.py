"""`roboyard drive`: control a robot in a scene by keyboard, browser or random actions."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from roboyard.cli.completion import scene_names, viewed_names
from roboyard.cli.numbers import read_numbers
from roboyard.cli.packages import PackageOption
from roboyard.cli.xacro_args import XacroArgOption
from roboyard.untrusted.text import json_text, say

if TYPE_CHECKING:
    from roboyard.cli.robot_argument import GivenRobot
    from roboyard.recording import SceneSetup
    from roboyard.viewer.driving import DrivingPage

EXAMPLES = """
Examples:

\b
  roboyard drive --quickstart                r1 in the scene home, by keyboard
  roboyard drive r1 --scene home --browser   in the browser
  roboyard drive r1 --scene home --control-mode random --short-exec --record a.gif
  roboyard drive my_robot.urdf --browser     a file, imported for this run only
  roboyard drive r1 --scene home --pose 1,0.5,1.57 --control-mode random --short-exec
  roboyard drive rover --scene empty --dataset drives --text "around the post"
  roboyard drive --policy walk.json --browser   a trained policy in its task
"""


class Mode(StrEnum):
    """Source of the robot's actions."""

    RANDOM = "random"
    TELEOP = "teleop"


def _page(
    setup: dict[str, Any], host: str, port: int, *, record: Path | None, log: Path | None, quiet: bool
) -> DrivingPage:
    from roboyard.recording import Recorder
    from roboyard.viewer.driving import DrivingPage

    page = DrivingPage(setup, host=host, port=port, quiet=quiet)
    try:
        if record is not None:
            page.start_video(record)
        if log is not None:
            page.recorder = Recorder(page.world, setup=page.scene_setup.setup)
    except BaseException:
        page.close()
        raise
    if quiet:
        say(f"the page is at {page.viewer.url}", to_errors=True)
    return page


def _serve(page: DrivingPage, log: Path | None, *, most: int | None, open_browser: bool) -> list[Path]:
    """Run the page until it ends, and return the files written."""
    from roboyard.viewer.page.browser import open_page

    recorder, video = page.recorder, page.recording.writer
    try:
        if open_browser:
            open_page(page.viewer.url)
        page.run(most)
    finally:
        page.close()
        if log is not None and recorder is not None and len(recorder):
            recorder.log().save(log)
    return [file for file in (video.path if video is not None else None, log) if file is not None]


def drive(
    robot: Annotated[
        str | None,
        typer.Argument(
            help="A robot file, or the name of a robot.",
            metavar="ROBOT",
            show_default=False,
            autocompletion=viewed_names,
        ),
    ] = None,
    scene: Annotated[
        str | None,
        typer.Option(
            "--scene",
            help="empty, tabletop, home, terrain, or a scene file.",
            show_default=False,
            autocompletion=scene_names,
        ),
    ] = None,
    control_mode: Annotated[
        Mode | None,
        typer.Option("--control-mode", help="Random actions, or the keyboard.", show_default=False),
    ] = None,
    quickstart: Annotated[
        bool, typer.Option("--quickstart", help="r1 in the scene home, by keyboard, without questions.")
    ] = False,
    short_exec: Annotated[bool, typer.Option("--short-exec", help="Stop after 100 actions.")] = False,
    record: Annotated[
        Path | None, typer.Option("--record", help="Video to write (.gif or .mp4).", show_default=False)
    ] = None,
    log: Annotated[
        Path | None,
        typer.Option("--log", help="State log to write (.npz), for `roboyard replay`.", show_default=False),
    ] = None,
    dataset: Annotated[
        Path | None,
        typer.Option(
            "--dataset",
            help="Folder to write as a dataset in LeRobot's layout; a reset begins another episode.",
            show_default=False,
        ),
    ] = None,
    text: Annotated[str, typer.Option("--text", help="Task of the dataset, in words.")] = "drive the robot",
    pose: Annotated[
        str | None,
        typer.Option(
            "--pose",
            help="Where the robot starts: x and y in m, yaw in rad.",
            metavar="X,Y[,YAW]",
            show_default=False,
        ),
    ] = None,
    seed: Annotated[
        int | None, typer.Option("--seed", help="Seed of the random actions.", show_default=False)
    ] = None,
    browser: Annotated[
        bool, typer.Option("--browser", help="Control in the browser: keys, joysticks, handles on grippers.")
    ] = False,
    policy: Annotated[
        Path | None,
        typer.Option(
            "--policy", help="Run a trained policy in its task (see docs/learning.md).", show_default=False
        ),
    ] = None,
    host: Annotated[str, typer.Option(help="Address of the page.")] = "127.0.0.1",
    port: Annotated[int, typer.Option(help="First port to try for the page.")] = 8080,
    open_browser: Annotated[
        bool, typer.Option("--open/--no-open", help="Open a browser if there is a display.")
    ] = True,
    package: PackageOption = None,
    xacro_arg: XacroArgOption = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print what was done as JSON.")] = False,
) -> None:
    """Control a robot by keyboard, browser or random actions.

    On a terminal, asks for robot, scene, controllers and mode if no option gives them. A robot file is
    imported for this run only.
    """
    from roboyard.cli.robot_argument import imported_robot
    from roboyard.errors import ConfigError
    from roboyard.teleop.loop import SHORT

    if log is not None and (log.suffix != ".npz" or not log.parent.is_dir()):
        raise ConfigError(f"--log {log}: must be a .npz file in an existing folder")
    if dataset is not None and (browser or policy is not None):
        raise ConfigError(
            f"--dataset {dataset}: records keys or random actions; remove --browser or --policy"
        )
    if policy is not None:
        given = {
            "ROBOT": robot,
            "--scene": scene,
            "--control-mode": control_mode,
            "--log": log,
            "--pose": pose,
        }
        extra = [name for name, value in given.items() if value is not None]
        if extra:
            raise ConfigError(
                f"--policy brings its own robot, scene and actions; remove {', '.join(extra)}, got "
                + ", ".join(f"{name}={given[name]!r}" for name in extra)
            )
        from roboyard.cli.drive_policy import run_policy

        run_policy(
            policy,
            steps=SHORT if short_exec else None,
            seed=seed or 0,
            record=record,
            browser=browser,
            host=host,
            port=port,
            open_browser=open_browser,
            as_json=as_json,
        )
        return
    if browser:
        if control_mode is Mode.RANDOM or seed is not None:
            raise ConfigError(
                f"--browser cannot be combined with --control-mode random or --seed, got {seed=}; "
                "remove one of the options"
            )
        from roboyard.viewer.page.server import load_viser

        load_viser()
    if quickstart or browser:
        robot, scene, control_mode = robot or "r1", scene or "home", control_mode or Mode.TELEOP
    choices = _choose(robot, scene, control_mode, package, xacro_arg)
    given = choices.file
    with nullcontext(choices.robot) if given is None else imported_robot(choices.robot, given) as ready:
        if log is not None and given is not None:
            raise ConfigError(
                f"--log {log}: a log names its robot, to be replayed; import it first: "
                f"roboyard import {choices.robot} --name NAME"
            )
        setup: dict[str, Any] = {"scene": choices.scene, "robot": ready, "controllers": choices.controllers}
        if pose is not None:
            form = "X,Y or X,Y,YAW, separated by commas, in m and rad"
            x, y, yaw = (*read_numbers("--pose", pose, (2, 3), form), 0.0)[:3]
            setup["pose"] = (x, y, yaw)
        if browser:
            page = _page(setup, host, port, record=record, log=log, quiet=as_json)
            files = _serve(page, log, most=SHORT if short_exec else None, open_browser=open_browser)
            count = None
        else:
            from roboyard.recording import set_up
            from roboyard.teleop import drive as run

            stage = set_up(setup)
            with _recorder(dataset, stage, text) as watch:
                count = run(
                    stage,
                    choices.mode.value,
                    short=short_exec,
                    record=record,
                    log=log,
                    seed=seed,
                    watch=watch,
                )
            files = [file for file in (record, log, dataset) if file is not None]
    written = [str(file) for file in files if file.exists()]
    if as_json:
        done = {
            "robot": choices.robot,
            "scene": choices.scene,
            "mode": "browser" if browser else choices.mode.value,
        }
        print(json_text({**done, "actions": count, "files": written}))
        return
    if count is not None:
        say(f"{choices.robot} in {choices.scene}: {count} actions")
    for file in written:
        say(f"wrote {file}")


def _recorder(
    folder: Path | None, stage: SceneSetup, text: str
) -> AbstractContextManager[Callable[[], None] | None]:
    """Return what writes a dataset of a robot in its scene; nothing without a folder."""
    if folder is None or stage.robot is None:
        return nullcontext()
    from roboyard.envs.datasets import RobotRecorder

    cameras = {"scene": stage.scene.camera(width=320, height=240)}
    return RobotRecorder(folder, stage.robot, text=text, cameras=cameras, source={"setup": stage.setup})


@dataclass(frozen=True, kw_only=True, slots=True)
class _Choices:
    """Robot, scene, mode and controllers; given as options, or answered on the terminal."""

    robot: str
    scene: str
    file: GivenRobot | None
    """A robot file to import; None for robots that have a definition."""
    mode: Mode
    controllers: dict[str, str]


def _choose(
    robot: str | None,
    scene: str | None,
    control_mode: Mode | None,
    package: list[str] | None,
    xacro_arg: list[str] | None,
) -> _Choices:
    """Check the given names, and ask for missing choices.

    Raises:
        ConfigError: a name is unknown, or a choice is missing and there is no terminal to ask on.
    """
    from roboyard.cli.robot_argument import given_robot, named_robot
    from roboyard.errors import ConfigError
    from roboyard.robots import REGISTERED_ROBOTS
    from roboyard.scenes import SCENES, check_scene
    from roboyard.teleop.choices import choose, has_terminal

    if scene is not None:
        check_scene(scene)
    given = None
    if robot is not None and (name := named_robot(robot)) is not None:
        robot = name
    elif robot is not None:
        given = given_robot(robot, package, xacro_arg)
        if not given.file.is_file():
            raise ConfigError(f"{robot}: there is no such file; check the path, or see `roboyard robots`")
    asks = robot is None or scene is None or control_mode is None
    if scene is None:
        scene = choose("Scene?", list(SCENES), "home")
    if robot is None:
        robot = choose("Robot?", list(REGISTERED_ROBOTS), "r1")
    controllers: dict[str, str] = {}
    if asks and has_terminal() and robot in REGISTERED_ROBOTS:
        definition = REGISTERED_ROBOTS[robot].definition
        usual = definition.controller_names()
        for group, allowed in definition.allowed_controllers().items():
            if group in usual:
                controllers[group] = choose(f"Controller of {group}?", sorted(allowed), usual[group])
    if control_mode is None:
        control_mode = Mode(choose("Control mode?", [m.value for m in Mode], Mode.TELEOP.value))
    return _Choices(robot=robot, scene=scene, file=given, mode=control_mode, controllers=controllers)
