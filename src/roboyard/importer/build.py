"""Build a robot's package: a configuration or a bare URDF in, files in every format out."""

from __future__ import annotations

import re
import shutil
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from roboyard.description.model import Mesh, RobotDescription
from roboyard.description.robot_model import RobotModel
from roboyard.errors import ConfigError
from roboyard.importer.config.load import LoadedConfig, check_data, load_config
from roboyard.importer.config.schema import ImportConfig, checked_dataset, checked_name
from roboyard.importer.context import ImportContext
from roboyard.importer.import_log import Decision, ImportLog, ProgressCallback
from roboyard.importer.package import PackageFolders, building
from roboyard.importer.steps.canonical_frame import canonical_frame
from roboyard.importer.steps.collision import collision
from roboyard.importer.steps.drives import drives
from roboyard.importer.steps.holonomic_base import holonomic_base
from roboyard.importer.steps.merge_fixed import merge_fixed
from roboyard.importer.steps.metadata import metadata
from roboyard.importer.steps.planning import planning
from roboyard.importer.steps.positive_scale import positive_scale
from roboyard.importer.steps.repair_and_copy import repair_and_copy_files
from roboyard.importer.steps.sensors import sensors
from roboyard.importer.steps.sphere_wheels import sphere_wheels
from roboyard.importer.verify.quality import quality
from roboyard.paths import data_folder

Step = Callable[[RobotModel, ImportContext], RobotModel]
Finish = Callable[[RobotModel, ImportContext], None]

STEPS: tuple[Step, ...] = (
    positive_scale,
    collision,
    merge_fixed,
    sensors,
    sphere_wheels,
    canonical_frame,
    holonomic_base,
    drives,
    metadata,
    planning,
    quality,
)
"""After `repair_and_copy_files`, which makes the robot."""


@dataclass(frozen=True, kw_only=True, slots=True)
class ImportResult:
    """A finished import."""

    name: str
    folder: Path
    """`<data>/<dataset>/objects/robot/<name>`"""
    model_folder: Path
    """`<data>/<dataset>/models/<name>`"""
    robot: RobotModel
    """As it was written; its meshes lie in `folder`."""
    decisions: tuple[Decision, ...]
    seconds: Mapping[str, float]
    facts: Mapping[str, Any]

    @property
    def definition(self) -> Path:
        """The RobotDefinition."""
        return self.model_folder / f"{self.name}.yaml"

    @property
    def warnings(self) -> tuple[Decision, ...]:
        """What to look at."""
        return tuple(decision for decision in self.decisions if decision.level == "warning")

    def to_json(self) -> dict[str, Any]:
        """Plain data for JSON."""
        return {
            "name": self.name,
            "folder": str(self.folder),
            "model_folder": str(self.model_folder),
            "definition": str(self.definition),
            "seconds": dict(self.seconds),
            "warnings": [f"{d.element}: {d.message}" if d.element else d.message for d in self.warnings],
            "mends": self.facts.get("mends", []),
            "read_back": self.facts.get("read_back", {}),
        }


def build_package(
    config: Path | str | Mapping[str, Any] | ImportConfig | None = None,
    *,
    urdf: Path | str | None = None,
    name: str | None = None,
    data: Path | str | None = None,
    dataset: str | None = None,
    overwrite: bool | None = None,
    packages: Mapping[str, Path] | None = None,
    progress: ProgressCallback | None = None,
    finish: Finish | None = None,
) -> ImportResult:
    """Build a robot's package and move it into the data folder; `roboyard.import_robot` also tries it out.

    Args:
        config: a source configuration: a YAML file, its data, or a checked model. Without one the robot keeps
            its root frame and its base, and everything a planner needs is worked out.
        urdf: the URDF, where there is no configuration (or instead of the one it names).
        name: the robot's name (or instead of the configuration's); lower-cased.
        data: the data folder; see `roboyard.paths.data_folder`.
        dataset: dataset folder; `omnigibson-robot-assets` by default.
        overwrite: replace an import of this name; as the configuration says (else no) by default.
        packages: ROS package name to folder.
        progress: told of every step.
        finish: called with the robot once its files are written and before they are moved in; it may add
            files to the package and facts to its log.

    Returns:
        What was written and decided.

    Raises:
        ConfigError: the configuration is wrong (every problem is named), or the robot exists already.
        DescriptionError: the URDF cannot be used.
    """
    overrides: dict[str, Any] = {}
    given = {"urdf_path": urdf, "name": name, "dataset_name": dataset, "overwrite": overwrite}
    for key, value in given.items():
        if value is not None:
            overrides[key] = str(Path(value).absolute()) if key == "urdf_path" else value
    loaded = _loaded(config, overrides, packages or {})
    place = PackageFolders(
        data=data_folder(data).absolute(), dataset=loaded.config.dataset_name, name=loaded.config.name
    )
    log = ImportLog(progress=progress)
    if isinstance(config, Path | str):
        log.facts["configuration"] = str(Path(config).absolute())
    for note in loaded.notes:
        log.warn(note)
    with building(place, overwrite=loaded.config.overwrite) as build:
        context = ImportContext(
            config=loaded.config,
            urdf=loaded.urdf,
            build=build / "object",
            log=log,
            has_config=config is not None,
            packages=packages or {},
        )
        robot = _build(context, finish)
        _make_model(build, robot.name)
        final = rebased(robot, context.build, place.object)
    return ImportResult(
        name=robot.name,
        folder=place.object,
        model_folder=place.model,
        robot=final,
        decisions=tuple(log.decisions),
        seconds=dict(log.seconds),
        facts=dict(log.facts),
    )


def _build(context: ImportContext, finish: Finish | None) -> RobotModel:
    from roboyard.importer.resolved_findings import mark_resolved
    from roboyard.importer.verify.read_back import read_back
    from roboyard.importer.write_formats import write_formats

    log = context.log
    with log.step("stage_and_clean"):
        robot = repair_and_copy_files(context)
    for step in STEPS:
        with log.step(step.__name__):
            robot = step(robot, context)
    with log.step("write"):
        write_formats(robot, context)
    with log.step("read_back"):
        read_back(robot, context)
        mark_resolved(robot, context)
    if finish is not None:
        finish(robot, context)
    log.write(context.build / "import_log.json")
    return robot


def _make_model(build: Path, name: str) -> None:
    """The registered copy: everything of the import, and the definition beside it."""
    shutil.copytree(build / "object", build / "model", dirs_exist_ok=True)
    (build / "object" / f"{name}.yaml").unlink()


def _loaded(
    config: Path | str | Mapping[str, Any] | ImportConfig | None,
    overrides: dict[str, Any],
    packages: Mapping[str, Path],
) -> LoadedConfig:
    if isinstance(config, Path | str):
        return load_config(config, packages=packages, overrides=overrides)
    if config is None:
        return _without_config(overrides)
    data = config.model_dump() if isinstance(config, ImportConfig) else dict(config)
    return check_data({**data, **overrides}, packages=packages)


def _without_config(overrides: dict[str, Any]) -> LoadedConfig:
    """Defaults for a bare URDF: its frames, joints and names stay as they are."""
    if "urdf_path" not in overrides:
        raise ConfigError("there is nothing to import; give a URDF or a configuration")
    file = Path(overrides["urdf_path"])
    if not file.exists():
        raise ConfigError(f"{file.name}: there is no file {str(file)!r}; check the path")
    name = overrides.get("name") or _name_of(file)
    flags = (
        ("--name", name, checked_name),
        ("--dataset-name", overrides.get("dataset_name", "x"), checked_dataset),
    )
    problems = []
    for flag, value, check in flags:
        try:
            check(value)
        except ValueError as error:
            problems.append(f"{flag}: {error}")
    if problems:
        raise ConfigError("\n".join(problems))
    config = ImportConfig.model_validate({**overrides, "name": name, "canonical_frame": False})
    return LoadedConfig(config=config, urdf=file)


def _name_of(file: Path) -> str:
    text = re.sub(r"[^A-Za-z0-9_]", "_", file.stem).lower()
    return f"_{text}" if text[:1].isdigit() else text or "robot"


def rebased(robot: RobotModel, old: Path, new: Path) -> RobotModel:
    """The robot with its files looked for below `new` instead of `old`."""

    def moved(path: Path | None) -> Path | None:
        return new / path.relative_to(old) if path is not None and path.is_relative_to(old) else path

    def shape(item: Any) -> Any:
        if isinstance(item.geometry, Mesh):
            item = replace(item, geometry=replace(item.geometry, path=moved(item.geometry.path)))
        material = getattr(item, "material", None)
        if material is not None and material.texture is not None:
            item = replace(item, material=replace(material, texture=moved(material.texture)))
        return item

    def description(given: RobotDescription) -> RobotDescription:
        return replace(
            given,
            links=tuple(
                replace(
                    link,
                    visuals=tuple(shape(v) for v in link.visuals),
                    collisions=tuple(shape(c) for c in link.collisions),
                )
                for link in given.links
            ),
        )

    return replace(
        robot,
        description=description(robot.description),
        solids={name: tuple(shape(s) for s in shapes) for name, shapes in robot.solids.items()},
    )
