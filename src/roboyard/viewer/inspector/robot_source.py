"""Which robot is meant by a word on the command line, and what lies beside it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from roboyard.errors import RoboyardError, unknown_name
from roboyard.viewer.inspector.edits.planner_spheres import Spheres, read_spheres

PLANNER_FILES = "**/*_curobo_default.yaml"


@dataclass(frozen=True, kw_only=True, slots=True)
class RobotSource:
    """A robot to look at."""

    name: str
    urdf: Path
    planner_file: Path | None = None
    """Where its planning spheres are, where it has any."""
    config: Path | None = None
    """Its import configuration, where it is known."""
    definition: Path | None = None
    cameras: Path | None = None
    """File that names its cameras (the MJCF of an import)."""
    folder: Path | None = None
    """Its package, `<data>/<dataset>/models/<name>`."""
    is_bundled: bool = False
    """It belongs to Roboyard: its files are read and never written."""

    def spheres(self) -> Mapping[str, Spheres]:
        """Link name to planning spheres.

        Raises:
            ConfigError: the planner file is wrong.
        """
        return {} if self.planner_file is None else read_spheres(self.planner_file)

    @property
    def config_target(self) -> Path:
        """Where edits of the configuration go unless someone names another file."""
        if self.config is not None and not self.is_bundled:
            return self.config
        return Path(f"{self.name}_import.yaml")


def find_robot(word: str, planner_file: Path | None = None, config: Path | None = None) -> RobotSource:
    """A URDF by its path, else a registered robot, else a bundled robot or thing by its name.

    Args:
        word: as it was typed.
        planner_file: a planner's YAML with `collision_spheres`; by default the registered robot's own.
        config: its import configuration; by default the one that the registered robot was imported with.

    Raises:
        RoboyardError: there is no such file and no such name; the message lists the nearest.
    """
    from roboyard.assets import OBJECTS, ROBOTS, asset_path
    from roboyard.robots.registry import REGISTERED_ROBOTS

    path = Path(word)
    if path.is_file():
        return RobotSource(name=path.stem, urdf=path, planner_file=planner_file, config=config)
    if path.suffix or len(path.parts) > 1:
        raise RoboyardError(f"there is no file {word!r}")
    if word in REGISTERED_ROBOTS:
        return _registered(word, planner_file, config)
    bundled = ROBOTS | OBJECTS
    if word in bundled:
        return RobotSource(
            name=word, urdf=asset_path(word), planner_file=planner_file, config=config, is_bundled=True
        )
    raise RoboyardError(unknown_name("file or robot", word, [*REGISTERED_ROBOTS, *bundled]))


def _registered(name: str, planner_file: Path | None, config: Path | None) -> RobotSource:
    from roboyard.assets import SOURCE_CONFIGS, asset_path
    from roboyard.robots.registry import REGISTERED_ROBOTS

    robot = REGISTERED_ROBOTS[name]
    if robot.bundled and name in SOURCE_CONFIGS:
        config = config or asset_path(SOURCE_CONFIGS[name])
    own = package_source(robot.folder, name, config)
    return replace(
        own,
        urdf=robot.urdf_of(robot.definition),
        planner_file=planner_file or own.planner_file,
        definition=robot.file,
        cameras=robot.sensors,
        is_bundled=robot.bundled,
    )


def package_source(folder: Path, name: str, config: Path | None = None) -> RobotSource:
    """A robot's package, wherever it lies."""
    planner_files = sorted(folder.glob(PLANNER_FILES))
    mjcf = folder / "mjcf" / f"{name}.xml"
    return RobotSource(
        name=name,
        urdf=folder / "urdf" / f"{name}.urdf",
        planner_file=planner_files[0] if planner_files else None,
        config=config or _imported_with(folder),
        definition=folder / f"{name}.yaml",
        cameras=mjcf if mjcf.is_file() else None,
        folder=folder,
    )


def _imported_with(folder: Path) -> Path | None:
    """The configuration that a package was made with, as its log remembers; None where it is gone."""
    import json

    try:
        said = json.loads((folder / "import_log.json").read_text(encoding="utf-8")).get("configuration")
    except (OSError, ValueError, AttributeError):
        return None
    return Path(said) if isinstance(said, str) and Path(said).is_file() else None
