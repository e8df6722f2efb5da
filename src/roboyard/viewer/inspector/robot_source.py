"""Find the files of a robot named on the command line."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from roboyard.errors import RoboyardError, unknown_name
from roboyard.viewer.inspector.edits.planner_spheres import Spheres, read_spheres

PLANNER_FILES = "**/*_curobo_default.yaml"


@dataclass(frozen=True, kw_only=True, slots=True)
class RobotSource:
    """The files of a robot."""

    name: str
    urdf: Path
    planner_file: Path | None = None
    """Planner file with its planning spheres."""
    config: Path | None = None
    """Its import configuration."""
    definition: Path | None = None
    """Its definition file."""
    cameras: Path | None = None
    """File that names its cameras (the MJCF of an import)."""
    folder: Path | None = None
    """Its package, `<data>/<dataset>/models/<name>`."""
    is_bundled: bool = False
    """Whether it belongs to Roboyard; its files are never written."""

    def spheres(self) -> Mapping[str, Spheres]:
        """Return link name to planning spheres.

        Raises:
            ConfigError: the planner file is invalid.
        """
        return {} if self.planner_file is None else read_spheres(self.planner_file)

    @property
    def config_target(self) -> Path:
        """Default file for the edits of the configuration."""
        if self.config is not None and not self.is_bundled:
            return self.config
        return Path(f"{self.name}_import.yaml")


def find_robot(name: str, planner_file: Path | None = None, config: Path | None = None) -> RobotSource:
    """Return the files of a URDF by path, of a registered robot, or of a bundled robot or object by name.

    Args:
        name: path or name.
        planner_file: a planner's YAML with `collision_spheres`; by default the registered robot's own.
        config: its import configuration; by default that of the registered robot.

    Raises:
        RoboyardError: no such file or name; the message lists the nearest names.
    """
    path = Path(name)
    if path.is_file():
        return RobotSource(name=path.stem, urdf=path, planner_file=planner_file, config=config)
    if path.suffix or len(path.parts) > 1:
        raise RoboyardError(f"there is no file {name!r}")
    from roboyard.assets import OBJECTS, ROBOTS, asset_path
    from roboyard.robots.registry import REGISTERED_ROBOTS

    if name in REGISTERED_ROBOTS:
        return _registered(name, planner_file, config)
    bundled = ROBOTS | OBJECTS
    if name in bundled:
        return RobotSource(
            name=name, urdf=asset_path(name), planner_file=planner_file, config=config, is_bundled=True
        )
    raise RoboyardError(unknown_name("file or robot", name, [*REGISTERED_ROBOTS, *bundled]))


def _registered(name: str, planner_file: Path | None, config: Path | None) -> RobotSource:
    """Return the files of a registered robot."""
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
    """Return the files of a robot package in any folder."""
    planner_files = sorted(folder.glob(PLANNER_FILES))
    mjcf = folder / "mjcf" / f"{name}.xml"
    return RobotSource(
        name=name,
        urdf=folder / "urdf" / f"{name}.urdf",
        planner_file=planner_files[0] if planner_files else None,
        config=config or _imported_with(folder, name),
        definition=folder / f"{name}.yaml",
        cameras=mjcf if mjcf.is_file() else None,
        folder=folder,
    )


def _imported_with(folder: Path, name: str) -> Path | None:
    """Return the configuration of an import if it is in the working folder; its log holds the file's name."""
    from roboyard.config.yaml_lines import read_yaml
    from roboyard.errors import ConfigError
    from roboyard.untrusted.json_reading import read_json

    try:
        said = read_json(folder / "import_log.json", 64 << 20).get("configuration")
    except (OSError, ValueError, AttributeError):
        return None
    file = Path(Path(said).name) if isinstance(said, str) and said else None
    if file is None or not file.is_file():
        return None
    try:
        data = read_yaml(file).data
    except ConfigError:
        return None
    return file if isinstance(data, dict) and data.get("name") == name else None
