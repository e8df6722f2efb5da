"""The argument ROBOT, shared by all commands: a robot file, or the name of a robot."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from roboyard.cli.completion import viewed_names
from roboyard.cli.packages import read_packages
from roboyard.cli.xacro_args import read_xacro_args
from roboyard.untrusted.text import say

if TYPE_CHECKING:
    from roboyard.description.model import RobotDescription

RobotArgument = Annotated[
    str,
    typer.Argument(
        help="A robot file, or the name of a robot.",
        metavar="ROBOT",
        show_default=False,
        autocompletion=viewed_names,
    ),
]


def robot_file(robot: str) -> Path:
    """Return the file of a robot that is given by path or by name.

    Raises:
        ConfigError: it is neither a path nor a known name; the message lists the nearest names.
    """
    from roboyard.demo.load import find_source

    return find_source(robot)[0]


def named_robot(robot: str) -> str | None:
    """Return a registered name or a definition file as `add_robot` takes it; None for other robots."""
    from roboyard.robots import REGISTERED_ROBOTS

    if Path(robot).suffix.lower() in (".yaml", ".yml"):
        return robot
    return next((name for name in (robot, robot.lower()) if name in REGISTERED_ROBOTS), None)


def robot_source(
    robot: str, package: Sequence[str] | None = None, xacro_arg: Sequence[str] | None = None
) -> str | RobotDescription:
    """Return what `roboyard.robots.add_robot` takes: a registered name, a definition file, or a description.

    Args:
        robot: a name, a definition file or a robot file.
        package: values of `--package`, for a robot file.
        xacro_arg: values of `--xacro-arg`, for a robot file.

    Raises:
        ConfigError: `robot` is neither a path nor a known name; the message lists the nearest names.
        DescriptionError: the file cannot be loaded.
    """
    name = named_robot(robot)
    if name is not None:
        return name
    from roboyard.description import load_description

    packages, xacro_args = read_packages(package or []), read_xacro_args(xacro_arg or [])
    return load_description(robot_file(robot), packages=packages, xacro_args=xacro_args)


@contextmanager
def driven_robot(
    robot: str, package: Sequence[str] | None = None, xacro_arg: Sequence[str] | None = None
) -> Iterator[str]:
    """Give a robot that can be driven, as `roboyard.recording.set_up` takes it; arguments as `robot_source`.

    A robot file is imported into a temporary folder, which is deleted at the end.

    Raises:
        ConfigError: the name is unknown.
        DescriptionError: the file cannot be imported.
    """
    name = named_robot(robot)
    if name is not None:
        yield name
        return
    from tempfile import TemporaryDirectory

    from roboyard.importer.pipeline import import_robot

    file = robot_file(robot)
    with TemporaryDirectory(prefix="roboyard-drive-") as folder:
        say(f"importing {file.name} for this run; `roboyard import {robot}` keeps it", to_errors=True)
        made = import_robot(
            file,
            out=folder,
            packages=read_packages(package or []),
            xacro_args=read_xacro_args(xacro_arg or []),
            validate=False,
            report=False,
        )
        yield str(made.definition)
