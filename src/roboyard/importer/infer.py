"""Infer the source configuration of a robot, as an expert would write it, without importing the robot."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from roboyard.description.semantic import SemanticDescription
from roboyard.description.urdf.parse import parse_urdf
from roboyard.importer.config.schema import ImportConfig
from roboyard.importer.config.write import config_text
from roboyard.importer.context import ImportContext
from roboyard.importer.import_log import ImportLog
from roboyard.importer.inferred_config import with_inferred_settings
from roboyard.importer.source import load_source
from roboyard.importer.steps.repair_and_copy import repair_and_copy_files


@dataclass(frozen=True, kw_only=True, slots=True)
class InferredConfig:
    """A configuration that states everything that was understood about a robot."""

    config: ImportConfig
    semantic: SemanticDescription
    """With a conclusion, its evidence and its confidence for each value."""
    text: str
    """The configuration as YAML, with the reasons as comments."""


def infer_config(
    source: Path | str,
    *,
    name: str | None = None,
    packages: Mapping[str, Path] | None = None,
    xacro_args: Mapping[str, str] | None = None,
    missing_meshes: Literal["warn", "error"] | None = None,
    relative_to: Path | None = None,
) -> InferredConfig:
    """Infer the source configuration of a robot file; importing it gives the package of the file alone.

    Args:
        source: a robot file (URDF or xacro).
        name: robot name; the file's by default.
        packages: ROS package name to folder.
        xacro_args: values of `<xacro:arg>` by name, where the robot file is a xacro file.
        missing_meshes: as for `roboyard.import_robot`.
        relative_to: folder of the configuration, from which the path of the robot file is written; without it
            the path is absolute.

    Raises:
        ConfigError: the name is not usable, or there is no such file.
        DescriptionError: the file cannot be used.
    """
    overrides = {
        "name": name,
        "xacro_args": dict(xacro_args) if xacro_args else None,
        "missing_meshes": missing_meshes,
    }
    loaded = load_source(str(source), None, overrides, packages or {})
    with tempfile.TemporaryDirectory(prefix="roboyard-infer-") as folder:
        context = ImportContext(
            config=loaded.config,
            urdf=loaded.urdf,
            source=parse_urdf(loaded.urdf, packages=packages, xacro_args=loaded.config.xacro_args),
            build=Path(folder) / "object",
            log=ImportLog(),
            has_config=False,
            packages=packages or {},
        )
        context.build.mkdir()
        robot = repair_and_copy_files(context)
        config = with_inferred_settings(context, robot).config
    path = loaded.urdf.absolute()
    if relative_to is not None and path.is_relative_to(relative_to.absolute()):
        path = path.relative_to(relative_to.absolute())
    return InferredConfig(
        config=config, semantic=robot.semantic, text=config_text(config, robot.semantic, path)
    )
