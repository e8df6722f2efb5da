"""`roboyard infer`: write the source configuration of a robot from its description alone."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer

from roboyard.cli.missing_meshes import MissingMeshesOption
from roboyard.cli.packages import PackageOption
from roboyard.cli.robot_argument import RobotArgument, given_robot
from roboyard.cli.xacro_args import XacroArgOption
from roboyard.untrusted.text import json_text, say

EXAMPLES = """
Examples:

\b
  roboyard infer my_robot.urdf > config.yaml
  roboyard infer my_robot.urdf --out config.yaml && roboyard import config.yaml
  roboyard infer my_robot.urdf --json            conclusions, evidence and confidence
"""


def infer(
    robot: RobotArgument,
    out: Annotated[
        Path | None, typer.Option("--out", help="Write the configuration here.", show_default=False)
    ] = None,
    name: Annotated[str | None, typer.Option("--name", help="Name of the robot.", show_default=False)] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the conclusions as JSON.")] = False,
    package: PackageOption = None,
    xacro_arg: XacroArgOption = None,
    missing_meshes: MissingMeshesOption = None,
) -> None:
    """Write the source configuration of a robot, with the reasons for each value.

    Kind, base, wheels, limbs, grippers and sensors are inferred from the description and the files beside it.
    Each value has its evidence and confidence in a comment; an import of the file, unchanged, gives the
    package that the description alone gives.
    """
    from roboyard.cli.missing_meshes import read_missing_meshes
    from roboyard.importer.infer import infer_config

    given = given_robot(robot, package, xacro_arg)
    found = infer_config(
        given.file,
        name=name,
        packages=given.packages,
        xacro_args=given.xacro_args,
        missing_meshes=read_missing_meshes(missing_meshes),
        relative_to=None if out is None else out.absolute().parent,
    )
    if as_json:
        from roboyard.description.understanding import conclusions, understanding

        data = {"understanding": understanding(found.semantic), "conclusions": conclusions(found.semantic)}
        print(json_text(data))
        return
    if out is None:
        sys.stdout.write(found.text)
        return
    out.write_text(found.text, encoding="utf-8", errors="backslashreplace")
    say(f"{out}: {len(found.semantic.conclusions)} conclusions")
