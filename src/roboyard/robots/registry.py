"""The registered robots: those of the data folder and the bundled ones, found at each access.

    <data>/<dataset>/models/<name>/<name>.yaml      registered as <name>
    <package>/assets/<name>/<name>.yaml             bundled; a robot of the data folder overrides it

A file is registered only if its stem is its folder's name. An invalid one is listed with its problem and
raises an error only when it is loaded.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from roboyard.assets import assets_root
from roboyard.description.model import RobotDescription
from roboyard.errors import ConfigError, RoboyardError, unknown_name
from roboyard.paths import data_folder
from roboyard.robots.definition.load import load_definition
from roboyard.robots.definition.schema import RobotDefinition
from roboyard.untrusted.files import read_file
from roboyard.whole_moves import finish_moves

PICTURES = ("preview.png", "thumbnail.png", "picture.png")


@dataclass(frozen=True, kw_only=True, slots=True)
class RegisteredRobot:
    """One definition file, loaded at its first use."""

    name: str
    file: Path
    """The definition file."""
    dataset: Path
    """Folder that the definition's paths are relative to."""
    bundled: bool = False
    """Whether the robot is part of Roboyard."""
    _read: dict[tuple[Path, bytes], RobotDescription] = field(
        default_factory=dict, init=False, repr=False, compare=False
    )
    """The description of the URDF as it was when it was last read."""

    @property
    def folder(self) -> Path:
        """Folder of the model."""
        return self.file.parent

    @property
    def definition(self) -> RobotDefinition:
        """The loaded definition.

        Raises:
            ConfigError: it is invalid; one line for each problem.
        """
        return load_definition(self.file)

    @property
    def problem(self) -> str | None:
        """Problem of the definition or its URDF; None for a valid one."""
        try:
            self.urdf_of(self.definition)
        except RoboyardError as error:
            return str(error)
        return None

    @property
    def picture(self) -> Path | None:
        """Picture file of the robot; None where there is none."""
        named = (*PICTURES, f"{self.name}.png")
        for path in (folder / name for folder in (self.folder, self.folder / "misc") for name in named):
            if path.is_file():
                return path
        return None

    def urdf_of(self, definition: RobotDefinition) -> Path:
        """Return the URDF that the definition belongs to.

        Raises:
            ConfigError: there is no such file.
        """
        if definition.urdf_path is not None:
            given = Path(definition.urdf_path)
            if given.is_absolute() or ".." in given.parts:
                raise ConfigError(
                    f"{self.file.name}: urdf_path: must be a path inside the dataset, got "
                    f"{definition.urdf_path!r}"
                )
            found = self.dataset / given
            if not found.is_file():
                raise ConfigError(
                    f"{self.file.name}: urdf_path: there is no file {definition.urdf_path!r} in the "
                    f"dataset; check it"
                )
            return found
        found = self.folder / "urdf" / f"{self.name}.urdf"
        if not found.is_file():
            raise ConfigError(
                f"{self.file.name}: there is no urdf/{self.name}.urdf beside it; copy the import there"
                f" (roboyard import --name {self.name} does), or give urdf_path"
            )
        return found

    def description(self, definition: RobotDefinition) -> RobotDescription:
        """Return the description of the robot's URDF.

        Raises:
            ConfigError: there is no URDF.
            DescriptionError: it cannot be loaded.
        """
        from roboyard.description import load_description
        from roboyard.description.urdf.xml import MAX_BYTES

        file = self.urdf_of(definition)
        key = (file, read_file(file, MAX_BYTES))
        found = self._read.get(key)
        if found is None:
            found = load_description(file)
            self._read.clear()
            self._read[key] = found
        return found

    @property
    def sensors(self) -> Path | None:
        """MJCF of the import, which has the frames of cameras and lidars; None where there is none."""
        found = self.folder / "mjcf" / f"{self.name}.xml"
        return found if found.is_file() else None


DEFINITION_SUFFIXES = (".yaml", ".yml")


def is_definition_file(robot: str | Path) -> bool:
    """Return whether a text is the path of a robot's definition, by its ending."""
    return Path(robot).suffix.lower() in DEFINITION_SUFFIXES


def packaged_robot(file: Path | str) -> RegisteredRobot:
    """Return the robot of a definition file in any folder.

    Args:
        file: `<dataset>/models/<name>/<name>.yaml`, as `roboyard import` writes it.

    Raises:
        ConfigError: there is no such file, or it is not named after its folder.
    """
    path = Path(file).absolute()
    if not path.is_file():
        raise ConfigError(f"{file}: there is no such definition file; check the path")
    if path.stem != path.parent.name:
        raise ConfigError(
            f"{file}: a robot's definition is named after its folder, as in models/mine/mine.yaml; "
            "for an import configuration use `roboyard import` first"
        )
    models = path.parents[1]
    return RegisteredRobot(
        name=path.stem, file=path, dataset=models.parent if models.name == "models" else models
    )


class Registry(Mapping[str, RegisteredRobot]):
    """Name to robot; files that are added or removed appear at the next access."""

    def __init__(self, data: Path | str | None = None, *, with_bundled: bool = True) -> None:
        """Create a registry of a data folder (see `roboyard.paths.data_folder`), with the bundled robots."""
        self._data = data
        self._with_bundled = with_bundled

    @property
    def data(self) -> Path:
        """The data folder."""
        return data_folder(self._data)

    def _found(self) -> dict[str, RegisteredRobot]:
        found: dict[str, RegisteredRobot] = {}
        if self._with_bundled:
            root = assets_root()
            for file in sorted(root.glob("*/*.yaml")):
                if file.stem == file.parent.name:
                    found[file.stem] = RegisteredRobot(name=file.stem, file=file, dataset=root, bundled=True)
        finish_moves(self.data)
        own: dict[str, RegisteredRobot] = {}
        for file in sorted(self.data.glob("*/models/*/*.yaml")):
            name = file.stem
            if name == file.parent.name and name not in own:
                own[name] = RegisteredRobot(name=name, file=file, dataset=file.parents[2])
        return dict(sorted({**found, **own}.items()))

    def __getitem__(self, name: str) -> RegisteredRobot:
        return self._found()[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._found())

    def __len__(self) -> int:
        return len(self._found())

    def find(self, name: str) -> RegisteredRobot:
        """Return the robot of this name; upper and lower case are equal.

        Raises:
            ConfigError: there is none; the message lists the nearest.
        """
        found = self._found()
        for key in (name, name.lower()):
            if key in found:
                return found[key]
        if name.lower().endswith((".urdf", ".xacro", ".xml")):
            raise ConfigError(
                f"{name} is a file, not a robot's name; import it: roboyard import {name} --name NAME"
            )
        raise ConfigError(
            f"{unknown_name('robot', name, found)}; registered robots are in {self.data}/*/models, "
            "where `roboyard import` writes them"
        )

    def problems(self) -> dict[str, str]:
        """Return the problem of every invalid robot by name."""
        return {
            name: problem for name, robot in self._found().items() if (problem := robot.problem) is not None
        }


REGISTERED_ROBOTS = Registry()
"""All robots of the data folder (see `roboyard.paths.data_folder`) and the bundled ones."""


def list_robots() -> tuple[str, ...]:
    """Return the names of all registered robots, sorted; `add_robot(world, name)` adds one."""
    return tuple(REGISTERED_ROBOTS)
