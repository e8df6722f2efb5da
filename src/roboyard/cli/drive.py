"""`roboyard drive`: control a robot in a scene by keyboard, browser or random actions."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from roboyard.cli.completion import robot_names, scene_names
from roboyard.untrusted.text import say

if TYPE_CHECKING:
    from roboyard.viewer.driving import DrivingPage

EXAMPLES = """
Examples:

\b
  roboyard drive --quickstart                r1 in the scene home, by keyboard
  roboyard drive r1 --scene home --browser   in the browser
  roboyard drive r1 --scene home --control-mode random --short-exec --record a.gif
  roboyard drive --policy walk.json --browser   a trained policy in its task
"""


class Mode(StrEnum):
    """Source of the robot's actions."""

    RANDOM = "random"
    TELEOP = "teleop"


def _page(
    robot: str, scene: str, host: str, port: int, *, record: Path | None, log: Path | None
) -> DrivingPage:
    from roboyard.recording import Recorder
    from roboyard.viewer.driving import DrivingPage
    from roboyard.viewer.page.server import load_viser

    load_viser()
    page = DrivingPage({"scene": scene, "robot": robot}, host=host, port=port)
    try:
        if record is not None:
            page.start_video(record)
        if log is not None:
            page.recorder = Recorder(page.world, setup=page.scene_setup.setup)
    except BaseException:
        page.close()
        raise
    return page


def _serve(page: DrivingPage, log: Path | None, *, most: int | None, open_browser: bool) -> None:
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
        for file in (video.path if video is not None else None, log):
            if file is not None and file.is_file():
                say(f"wrote {file}")


def drive(
    robot: Annotated[
        str | None,
        typer.Argument(
            help="A robot of `roboyard robots`.",
            metavar="ROBOT",
            show_default=False,
            autocompletion=robot_names,
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
) -> None:
    """Control a robot by keyboard, browser or random actions.

    Asks for robot, scene, controllers and mode if no option gives them.
    """
    from roboyard.errors import ConfigError
    from roboyard.teleop.loop import SHORT

    if log is not None and (log.suffix != ".npz" or not log.parent.is_dir()):
        raise ConfigError(f"--log {log}: must be a .npz file in an existing folder")
    if policy is not None:
        if robot is not None or scene is not None or control_mode is not None or log is not None:
            raise ConfigError(
                "--policy brings its own robot, scene and actions; remove ROBOT, --scene, --control-mode and "
                f"--log, got {robot=}, {scene=}, {control_mode=}, {log=}"
            )
        _run_policy(
            policy,
            steps=SHORT if short_exec else None,
            seed=seed or 0,
            record=record,
            browser=browser,
            host=host,
            port=port,
            open_browser=open_browser,
        )
        return
    if browser:
        if control_mode is Mode.RANDOM or seed is not None:
            raise ConfigError(
                f"--browser cannot be combined with --control-mode random or --seed, got {seed=}; "
                "remove one of the options"
            )
        page = _page(robot or "r1", scene or "home", host, port, record=record, log=log)
        _serve(page, log, most=SHORT if short_exec else None, open_browser=open_browser)
        return
    if quickstart:
        robot, scene, control_mode = robot or "r1", scene or "home", control_mode or Mode.TELEOP
    _run_in_terminal(robot, scene, control_mode, short=short_exec, record=record, log=log, seed=seed)


EPISODES = 5
"""Episodes of a policy without a page."""


def _run_policy(
    file: Path,
    *,
    steps: int | None,
    seed: int,
    record: Path | None,
    browser: bool,
    host: str,
    port: int,
    open_browser: bool,
) -> None:
    """Run a policy and print the result of each episode."""
    from roboyard.envs.play import play
    from roboyard.envs.policy import load_policy

    policy = load_policy(file)
    say(f"{policy.task}" + "".join(f", {key} {value}" for key, value in policy.options.items()))
    episodes = play(
        policy,
        steps=steps,
        seed=seed,
        record=record,
        viewer=browser,
        host=host,
        port=port,
        open_browser=open_browser,
    )
    try:
        for episode in episodes:
            goal = "" if episode.success is None else ", goal " + ("reached" if episode.success else "missed")
            say(
                f"episode {episode.number}: {episode.steps} steps, reward {episode.reward:.1f}, "
                f"end: {episode.end}{goal}"
            )
            if not browser and episode.number == EPISODES:
                break
    except KeyboardInterrupt:
        pass
    finally:
        episodes.close()
    if record is not None and record.is_file():
        say(f"wrote {record}")


def _run_in_terminal(
    robot: str | None,
    scene: str | None,
    control_mode: Mode | None,
    *,
    short: bool,
    record: Path | None,
    log: Path | None,
    seed: int | None,
) -> None:
    """Ask for missing choices, and drive the robot by keys or at random."""
    from roboyard.recording import set_up
    from roboyard.robots import REGISTERED_ROBOTS
    from roboyard.scenes import SCENES
    from roboyard.teleop import drive as run
    from roboyard.teleop.choices import choose

    asks = robot is None or scene is None or control_mode is None
    if scene is None:
        scene = choose("Scene?", list(SCENES), "home")
    if robot is None:
        robot = choose("Robot?", list(REGISTERED_ROBOTS), "r1")
    found = REGISTERED_ROBOTS.find(robot)
    controllers: dict[str, str] = {}
    if asks:
        usual = found.definition.controller_names()
        for group, allowed in found.definition.allowed_controllers().items():
            if group in usual:
                controllers[group] = choose(f"Controller of {group}?", sorted(allowed), usual[group])
    if control_mode is None:
        control_mode = Mode(choose("Control mode?", [m.value for m in Mode], Mode.TELEOP.value))
    scene_setup = set_up({"scene": scene, "robot": robot, "controllers": controllers})
    count = run(scene_setup, control_mode.value, short=short, record=record, log=log, seed=seed)
    say(f"{robot} in {scene_setup.scene.name}: {count} actions")
    for file in (record, log):
        if file is not None and file.is_file():
            say(f"wrote {file}")
