"""`roboyard view`: inspect a robot in the browser."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from roboyard.cli.completion import viewed_names
from roboyard.cli.packages import PackageOption
from roboyard.cli.xacro_args import XacroArgOption

if TYPE_CHECKING:
    from roboyard.description.model import RobotDescription

EXAMPLES = """
Examples:

\b
  roboyard view arm7            a bundled robot
  roboyard view my_robot.urdf   your robot file
  roboyard view mine            an imported robot
  roboyard view mine --export mine.html   one file that opens anywhere
"""


def view(
    robot: Annotated[
        str,
        typer.Argument(
            help="A robot file, or the name of a robot.",
            metavar="ROBOT",
            show_default=False,
            autocompletion=viewed_names,
        ),
    ],
    host: Annotated[str, typer.Option(help="Address to listen on.")] = "127.0.0.1",
    port: Annotated[int, typer.Option(help="First port to try; the next free port is used.")] = 8080,
    free: Annotated[bool, typer.Option("--free", help="Do not fix the base to the world.")] = False,
    self_collision: Annotated[
        bool, typer.Option("--self-collision", help="Let links of the robot collide with each other.")
    ] = False,
    spheres: Annotated[
        Path | None,
        typer.Option(help="Planner file (YAML) with collision_spheres to show.", show_default=False),
    ] = None,
    config: Annotated[
        Path | None,
        typer.Option(help="Import configuration to save edits to.", show_default=False),
    ] = None,
    package: PackageOption = None,
    xacro_arg: XacroArgOption = None,
    export: Annotated[
        Path | None,
        typer.Option(
            "--export",
            help="Write one HTML file with the robot, its joints and layers, and stop.",
            show_default=False,
        ),
    ] = None,
    open_browser: Annotated[
        bool, typer.Option("--open/--no-open", help="Open a browser if there is a display.")
    ] = True,
) -> None:
    """Inspect a robot in the browser, or write it as one file with --export.

    Shows shapes, inertias, frames, joints, sensors, findings and checks; runs until Ctrl-C. Every computer
    that can reach the port can move the robot on the page, so keep the default address unless the network is
    trusted.
    """
    from roboyard.cli.robot_argument import given_robot
    from roboyard.viewer.inspector import Inspector, find_robot
    from roboyard.viewer.inspector.read_robot import read_robot
    from roboyard.viewer.page.browser import open_page
    from roboyard.viewer.page.server import load_viser

    given = given_robot(robot, package, xacro_arg)
    if export is not None:
        source = find_robot(given.robot, spheres, config)
        _export(export, read_robot(source, given.packages, given.xacro_args).description)
        return
    load_viser()
    inspector = Inspector(
        find_robot(given.robot, spheres, config),
        host=host,
        port=port,
        fixed_base=not free,
        self_collision=self_collision,
        packages=given.packages,
        xacro_args=given.xacro_args,
        on_open=open_page if open_browser else None,
    )
    try:
        inspector.run()
    finally:
        inspector.close()


def _export(file: Path, description: RobotDescription) -> None:
    """Write a robot as one HTML file.

    Raises:
        ConfigError: the file cannot be written.
    """
    from roboyard.errors import ConfigError
    from roboyard.reports.robot_page import robot_page
    from roboyard.untrusted.text import say

    if file.suffix.lower() not in (".html", ".htm"):
        raise ConfigError(f"--export {file}: must end in .html")
    if not file.parent.is_dir():
        raise ConfigError(f"--export {file}: there is no folder {file.parent}; create it first")
    try:
        file.write_text(robot_page(description), encoding="utf-8", errors="backslashreplace")
    except OSError as error:
        raise ConfigError(f"--export {file}: cannot be written ({error.strerror})") from error
    say(f"wrote {file} ({file.stat().st_size / 1e6:.1f} MB)")
