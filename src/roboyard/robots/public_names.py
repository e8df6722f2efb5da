"""Robots by the names that the package `robot_descriptions` knows, where it is installed.

That package keeps public repositories in a cache of its own and fetches those that are missing. A robot is
named as its module there, with or without `_description`: `go2`, `ur5e`, `go2_mj`.
"""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Mapping
from dataclasses import dataclass, field
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path

from roboyard.errors import ConfigError

PACKAGE = "robot_descriptions"
_ENDING = "_description"
_FILES = ("URDF_PATH", "XACRO_PATH", "MJCF_PATH")


@dataclass(frozen=True, kw_only=True)
class PublicRobot:
    """A robot file, and what its format needs beside it."""

    file: Path
    packages: Mapping[str, Path] = field(default_factory=dict)
    """ROS package name to folder."""
    xacro_args: Mapping[str, str] = field(default_factory=dict)


def public_names() -> Mapping[str, str]:
    """Return the short names of robots to their modules; empty where the package is not installed."""
    try:
        known = import_module(PACKAGE).DESCRIPTIONS if find_spec(PACKAGE) is not None else {}
    except (ImportError, AttributeError, ValueError):  # another package of that name
        return {}
    return {str(module).removesuffix(_ENDING): str(module) for module in known}


def find_public_robot(name: str) -> PublicRobot | None:
    """Return the files of a robot, fetched where they are missing; None for an unknown name.

    Args:
        name: a short name, or a module's. `go2` is the URDF; where there is only an MJCF, that.

    Raises:
        ConfigError: the files cannot be fetched, or the module names none that Roboyard reads.
    """
    known = public_names()
    wanted = name.lower().removesuffix(_ENDING)
    module = known.get(wanted) or known.get(f"{wanted}_mj")
    if module is None:
        return None
    try:
        with contextlib.redirect_stdout(sys.stderr):  # it reports its progress
            loaded = import_module(f"{PACKAGE}.{module}")
    except Exception as error:  # of git, of the network, of the operating system
        reason = " ".join(str(error).split())[:300] or type(error).__name__
        raise ConfigError(
            f"{name}: {PACKAGE} cannot fetch it ({reason}); connect to the network, or set "
            "ROBOT_DESCRIPTIONS_CACHE to a folder that holds it"
        ) from error
    values = vars(loaded)
    file = next((Path(values[key]) for key in _FILES if isinstance(values.get(key), str)), None)
    if file is None:
        file = next((Path(v) for k, v in values.items() if k.startswith(_FILES) and isinstance(v, str)), None)
    if file is None:
        raise ConfigError(f"{name}: {PACKAGE}.{module} names no URDF, xacro or MJCF; give another robot")
    arguments = values.get("XACRO_ARGS")
    return PublicRobot(
        file=file,
        packages=_packages(values),
        xacro_args={str(k): str(v) for k, v in arguments.items()} if isinstance(arguments, dict) else {},
    )


def _packages(values: Mapping[str, object]) -> dict[str, Path]:
    """Return the packages that a module names, by the names of their folders."""
    found = {}
    listed = values.get("XACRO_PACKAGE_PATHS")
    if isinstance(listed, Mapping):
        found |= {str(name): Path(str(path)) for name, path in listed.items()}
    for key in ("PACKAGE_PATH", "REPOSITORY_PATH"):
        path = values.get(key)
        if isinstance(path, str) and Path(path).is_dir():
            found.setdefault(Path(path).name, Path(path))
    return found
