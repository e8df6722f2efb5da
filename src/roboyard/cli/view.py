"""`roboyard view`: a robot on a web page, with everything there is to check."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from roboyard.cli.completion import viewed_names
from roboyard.cli.packages import PackageOption

EXAMPLES = """
Examples:

\b
  roboyard view arm7            a bundled robot
  roboyard view my_robot.urdf   yours
  roboyard view mine            one that you imported
"""


def view(
    robot: Annotated[
        str,
        typer.Argument(
            help="A URDF, or the name of a robot.",
            metavar="ROBOT",
            show_default=False,
            autocompletion=viewed_names,
        ),
    ],
    host: Annotated[str, typer.Option(help="Address to listen at.")] = "127.0.0.1",
    port: Annotated[int, typer.Option(help="First port to try; the next free one is taken.")] = 8080,
    free: Annotated[bool, typer.Option("--free", help="Do not bolt the base to the world.")] = False,
    self_collision: Annotated[
        bool, typer.Option("--self-collision", help="Let links of the robot touch one another.")
    ] = False,
    spheres: Annotated[
        Path | None,
        typer.Option(help="Planner's YAML with collision_spheres to show.", show_default=False),
    ] = None,
    config: Annotated[
        Path | None,
        typer.Option(help="Import configuration that edits go into.", show_default=False),
    ] = None,
    package: PackageOption = None,
    open_browser: Annotated[
        bool, typer.Option("--open/--no-open", help="Open a browser where there is a display.")
    ] = True,
) -> None:
    """Look a robot over on a web page.

    Shapes, inertias, frames, joints, sensors, findings, and checks of all these; runs until Ctrl-C.
    Whoever can reach the port can move the robot on the page, so keep it on this machine (the default).
    """
    from roboyard.cli.packages import read_packages
    from roboyard.viewer.inspector import Inspector, find_robot
    from roboyard.viewer.page.browser import open_page
    from roboyard.viewer.page.server import load_viser

    load_viser()
    inspector = Inspector(
        find_robot(robot, spheres, config),
        host=host,
        port=port,
        fixed_base=not free,
        self_collision=self_collision,
        packages=read_packages(package or []),
    )
    try:
        if open_browser:
            open_page(inspector.viewer.url)
        inspector.run()
    finally:
        inspector.close()
