"""`roboyard view`: inspect a robot in the browser."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from roboyard.cli.completion import viewed_names
from roboyard.cli.packages import PackageOption
from roboyard.cli.xacro_args import XacroArgOption

EXAMPLES = """
Examples:

\b
  roboyard view arm7            a bundled robot
  roboyard view my_robot.urdf   your robot file
  roboyard view mine            an imported robot
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
    open_browser: Annotated[
        bool, typer.Option("--open/--no-open", help="Open a browser if there is a display.")
    ] = True,
) -> None:
    """Inspect a robot in the browser.

    Shows shapes, inertias, frames, joints, sensors, findings and checks; runs until Ctrl-C. Every computer
    that can reach the port can move the robot on the page, so keep the default address unless the network is
    trusted.
    """
    from roboyard.cli.robot_argument import given_robot
    from roboyard.viewer.inspector import Inspector, find_robot
    from roboyard.viewer.page.browser import open_page
    from roboyard.viewer.page.server import load_viser

    load_viser()
    given = given_robot(robot, package, xacro_arg)
    inspector = Inspector(
        find_robot(given.robot, spheres, config),
        host=host,
        port=port,
        fixed_base=not free,
        self_collision=self_collision,
        packages=given.packages,
        xacro_args=given.xacro_args,
    )
    try:
        if open_browser:
            open_page(inspector.viewer.url)
        inspector.run()
    finally:
        inspector.close()
