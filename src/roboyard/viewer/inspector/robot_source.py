"""Which robot is meant by a word on the command line, and what lies beside it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from roboyard.errors import RoboyardError, unknown_name
from roboyard.viewer.inspector.spheres import Spheres, read_spheres

PLANNER_FILES = "**/*_curobo_default.yaml"


@dataclass(frozen=True, kw_only=True, slots=True)
class RobotSource:
    """A robot to look at."""

    name: str
    urdf: Path
    planner_file: Path | None = None
    """Where its planning spheres are, where it has any."""

    def spheres(self) -> Mapping[str, Spheres]:
        """Link name to planning spheres.

        Raises:
            ConfigError: the planner file is wrong.
        """
        return {} if self.planner_file is None else read_spheres(self.planner_file)


def find_robot(word: str, planner_file: Path | None = None) -> RobotSource:
    """A URDF by its path, else a registered robot, else a bundled robot or thing by its name.

    Args:
        word: as it was typed.
        planner_file: a planner's YAML with `collision_spheres`; by default the registered robot's own.

    Raises:
        RoboyardError: there is no such file and no such name; the message lists the nearest.
    """
    from roboyard.assets import ROBOTS, THINGS, asset_path
    from roboyard.robots.registry import REGISTERED_ROBOTS

    path = Path(word)
    if path.is_file():
        return RobotSource(name=path.stem, urdf=path, planner_file=planner_file)
    if path.suffix or len(path.parts) > 1:
        raise RoboyardError(f"there is no file {word!r}")
    if word in REGISTERED_ROBOTS and not (REGISTERED_ROBOTS[word].bundled and word in ROBOTS):
        robot = REGISTERED_ROBOTS[word]
        found = sorted(robot.folder.glob(PLANNER_FILES))
        own = found[0] if found else None
        return RobotSource(name=word, urdf=robot.urdf_of(robot.definition), planner_file=planner_file or own)
    bundled = ROBOTS | THINGS
    if word in bundled:
        return RobotSource(name=word, urdf=asset_path(word), planner_file=planner_file)
    raise RoboyardError(unknown_name("file or robot", word, [*REGISTERED_ROBOTS, *bundled]))
