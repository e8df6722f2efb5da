"""The source of an import: a robot file, a description, or a source configuration."""

from __future__ import annotations

import re
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from roboyard.description.model import RobotDescription
from roboyard.description.xacro.expand import robot_stem
from roboyard.errors import ConfigError
from roboyard.importer.config.load import LoadedConfig, check_data, load_config
from roboyard.importer.config.schema import ImportConfig, checked_dataset, checked_name

ConfigSource = Path | str | Mapping[str, Any] | ImportConfig
"""A source configuration: a YAML file, its data, or the checked model."""
Source = ConfigSource | RobotDescription
"""A robot file, a description, or a source configuration; YAML suffixes mark a configuration."""
CONFIG_SUFFIXES = (".yaml", ".yml")


@contextmanager
def source_file(source: Source | None) -> Iterator[ConfigSource | None]:
    """Yield the source; a `RobotDescription` is written as URDF into a temporary folder first."""
    if not isinstance(source, RobotDescription):
        yield source
        return
    from roboyard.description.robot_model import RobotModel
    from roboyard.description.semantic import SemanticDescription
    from roboyard.export import urdf

    name = name_from_text(source.name)
    with tempfile.TemporaryDirectory(prefix="roboyard-source-") as folder:
        semantic = SemanticDescription(base_link=source.root.name)
        robot = RobotModel(name=name, description=source, semantic=semantic)
        urdf.write(robot, folder)
        yield Path(folder, f"{name}.urdf")


def is_configuration(source: ConfigSource) -> bool:
    """Return whether a source is a configuration rather than a robot file."""
    if isinstance(source, Path | str):
        return Path(source).suffix.lower() in CONFIG_SUFFIXES
    return True


def load_source(
    source: ConfigSource | None,
    config: ConfigSource | None,
    overrides: Mapping[str, Any],
    packages: Mapping[str, Path],
) -> LoadedConfig:
    """Load and check the configuration of an import; defaults where the source is only a robot file.

    Args:
        source: a robot file or a configuration.
        config: the configuration that goes with a robot file.
        overrides: top-level keys that replace the configuration's where they are not None.
        packages: ROS package name to folder.

    Raises:
        ConfigError: there is no source, there are two configurations, or the configuration is wrong.
    """
    given = {key: value for key, value in overrides.items() if value is not None}
    if source is not None and is_configuration(source):
        if config is not None:
            shown = source if isinstance(source, Path | str) else type(source).__name__
            raise ConfigError(f"the source ({shown}) is a configuration already; omit config")
        source, config = None, source
    if source is not None:
        given["urdf_path"] = str(Path(str(source)).absolute())
    if isinstance(config, Path | str):
        return load_config(config, packages=packages, overrides=given)
    if config is not None:
        data = config.model_dump() if isinstance(config, ImportConfig) else dict(config)
        return check_data({**data, **given}, packages=packages)
    if source is None:
        raise ConfigError("there is no source; give a robot file (URDF) or a configuration")
    return _defaults(Path(str(source)), given)


def _defaults(file: Path, overrides: Mapping[str, Any]) -> LoadedConfig:
    """Return the configuration of a robot file alone: its frames, joints and names stay as they are."""
    if not file.exists():
        raise ConfigError(f"{file.name}: there is no file {str(file)!r}; check the path")
    name = overrides.get("name") or name_from_text(robot_stem(file))
    options = (
        ("name", name, checked_name),
        ("dataset", overrides.get("dataset_name", "x"), checked_dataset),
    )
    problems = []
    for option, value, check in options:
        try:
            check(value)
        except ValueError as error:
            problems.append(f"--{option}: {error}")
    if problems:
        raise ConfigError("\n".join(problems))
    config = ImportConfig.model_validate({**overrides, "name": name, "canonical_frame": False})
    return LoadedConfig(config=config, urdf=Path(config.urdf_path), has_config=False)


def name_from_text(text: str) -> str:
    """Return a robot name made from a file's stem or a description's name."""
    name = re.sub(r"[^A-Za-z0-9_]", "_", text).lower()
    return f"_{name}" if name[:1].isdigit() else name or "robot"
