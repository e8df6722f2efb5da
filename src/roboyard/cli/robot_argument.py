"""The argument ROBOT, shared by all commands: a robot file, or the name of a robot."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from roboyard.cli.completion import viewed_names
from roboyard.cli.packages import read_packages
from roboyard.cli.xacro_args import read_xacro_args
from roboyard.untrusted.text import say

if TYPE_CHECKING:
    from roboyard.description.model import RobotDescription
    from roboyard.robots.public_names import PublicRobot

_LISTED = 10
"""Robots of a folder that an error lists."""
RobotArgument = Annotated[
    str,
    typer.Argument(
        help="A robot file, a folder with robots, or the name of a robot.",
        metavar="ROBOT",
        show_default=False,
        autocompletion=viewed_names,
    ),
]


@dataclass(frozen=True, kw_only=True)
class GivenRobot:
    """A robot file, and what its format needs beside it."""

    file: Path
    robot: str
    """As given where it is a file or a name that Roboyard knows itself; else the file."""
    packages: dict[str, Path]
    """ROS package name to folder, those of `--package` first."""
    xacro_args: dict[str, str]
    """Argument to value, those of `--xacro-arg` first."""
    name: str | None = None
    """Of a public robot, whose file may be that of many."""


def given_robot(
    robot: str, package: Sequence[str] | None = None, xacro_arg: Sequence[str] | None = None
) -> GivenRobot:
    """Return the file of a robot: a path, a folder with robots, a robot's name, a public robot's name.

    Of a folder with several robots one is asked for, where there is a terminal to ask on.

    Args:
        robot: what the user gave.
        package: values of `--package`.
        xacro_arg: values of `--xacro-arg`.

    Raises:
        ConfigError: it is neither a path nor a known name, a public robot cannot be fetched, or a folder
            has no robot, or several and there is no terminal.
    """
    from roboyard.demo.load import find_source
    from roboyard.importer.source import name_from_text

    packages, xacro_args = read_packages(package or []), read_xacro_args(xacro_arg or [])
    public = robot_elsewhere(robot)
    if public is None:
        file = find_source(robot)[0]
        return GivenRobot(file=file, robot=robot, packages=packages, xacro_args=xacro_args)
    return GivenRobot(
        file=public.file,
        robot=str(public.file),
        packages={**public.packages, **packages},
        xacro_args={**public.xacro_args, **xacro_args},
        name=None if Path(robot).is_dir() else name_from_text(robot),
    )


def robot_elsewhere(robot: str) -> PublicRobot | None:
    """Return a robot of a folder or a public one; None for files and for names that Roboyard knows itself."""
    path = Path(robot)
    if path.is_file():
        return None
    from roboyard.assets import OBJECTS, ROBOTS
    from roboyard.robots.public_names import PublicRobot, find_public_robot  # loads all of robots/

    if named_robot(robot) is not None or robot in ROBOTS | OBJECTS:
        return None
    if path.is_dir():
        return PublicRobot(file=_robot_of(path))
    if path.suffix or len(path.parts) != 1:
        return None
    return find_public_robot(robot)


def _robot_of(folder: Path) -> Path:
    """Return the robot file of a folder; of several the one that the user chooses."""
    from roboyard.description.files.robot_files import robot_files
    from roboyard.errors import ConfigError
    from roboyard.teleop.choices import choose, has_terminal

    found = {str(file.relative_to(folder)): file for file in robot_files(folder)}
    if not found:
        raise ConfigError(f"{folder}: there is no robot file in this folder; give the path of one")
    if len(found) == 1:
        return next(iter(found.values()))
    if has_terminal():
        return found[choose(f"{len(found)} robots in {folder}. Which?", list(found), next(iter(found)))]
    shown = "\n".join(f"  {folder / name}" for name in list(found)[:_LISTED])
    more = f"\n  ... and {len(found) - _LISTED} more" if len(found) > _LISTED else ""
    raise ConfigError(f"{folder}: there are {len(found)} robots in this folder; name one of\n{shown}{more}")


def named_robot(robot: str) -> str | None:
    """Return a registered name or a definition file as `add_robot` takes it; None for other robots."""
    from roboyard.robots.registry import REGISTERED_ROBOTS, is_definition_file

    if is_definition_file(robot):
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

    given = given_robot(robot, package, xacro_arg)
    return load_description(given.file, packages=given.packages, xacro_args=given.xacro_args)


@contextmanager
def imported_robot(robot: str, given: GivenRobot) -> Iterator[str]:
    """Import a robot file into a temporary folder, give the path of its definition, and delete the folder.

    Args:
        robot: what the user gave, for the message.
        given: its file.

    Raises:
        DescriptionError: the file cannot be imported.
    """
    from tempfile import TemporaryDirectory

    from roboyard.importer.pipeline import import_robot

    with TemporaryDirectory(prefix="roboyard-drive-") as folder:
        say(f"importing {given.file.name} for this run; `roboyard import {robot}` keeps it", to_errors=True)
        made = import_robot(
            given.file,
            out=folder,
            packages=given.packages,
            xacro_args=given.xacro_args,
            validate=False,
            report=False,
        )
        yield str(made.definition)
