"""Build a robot's package: from a robot file or a configuration to files in every format."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

from roboyard.description.model import Mesh, RobotDescription
from roboyard.description.robot_model import RobotModel
from roboyard.description.urdf.parse import parse_urdf
from roboyard.importer.context import ImportContext
from roboyard.importer.import_log import Decision, ImportLog, ProgressCallback
from roboyard.importer.inferred_config import with_inferred_settings
from roboyard.importer.package import PackageFolders, building
from roboyard.importer.source import ConfigSource, Source, load_source, source_file
from roboyard.importer.steps.canonical_frame import move_root_frame
from roboyard.importer.steps.collision import make_collision_shapes
from roboyard.importer.steps.drives import add_drives
from roboyard.importer.steps.file_frame import restore_file_frame
from roboyard.importer.steps.holonomic_base import add_virtual_joints
from roboyard.importer.steps.merge_fixed import merge_fixed_links
from roboyard.importer.steps.metadata import measure_size
from roboyard.importer.steps.mounted_sensors import mount_sensors
from roboyard.importer.steps.planning import add_planning_data
from roboyard.importer.steps.positive_scale import mirror_meshes
from roboyard.importer.steps.repair_and_copy import repair_and_copy_files
from roboyard.importer.steps.semantics import add_semantics
from roboyard.importer.steps.sensors import add_sensors
from roboyard.importer.steps.sphere_wheels import mark_wheels
from roboyard.importer.verify.quality import measure_quality
from roboyard.paths import writable_data_folder

Step = Callable[[RobotModel, ImportContext], RobotModel]
Begin = Callable[[ImportContext], None]
Finish = Callable[[RobotModel, ImportContext], None]

STEPS: tuple[Step, ...] = (
    mirror_meshes,
    make_collision_shapes,
    merge_fixed_links,
    add_sensors,
    mark_wheels,
    move_root_frame,
    add_virtual_joints,
    add_drives,
    measure_size,
    add_semantics,
    mount_sensors,
    add_planning_data,
    measure_quality,
    restore_file_frame,
)
"""Steps in order, after `repair_and_copy_files`, which makes the first `RobotModel`."""


@dataclass(frozen=True, kw_only=True, slots=True)
class PackageResult:
    """A package in the data folder, with the decisions made on the way."""

    name: str
    folder: Path
    """`<out>/<dataset>/objects/robot/<name>`"""
    model_folder: Path
    """`<out>/<dataset>/models/<name>`"""
    robot: RobotModel
    """As it was written; its meshes are in `folder`."""
    decisions: tuple[Decision, ...]
    seconds: Mapping[str, float]
    """Step to its duration (s)."""
    facts: Mapping[str, Any]
    """Plain data of the steps, as in `import_log.json`."""

    @property
    def definition(self) -> Path:
        """Path of the robot definition."""
        return self.model_folder / f"{self.name}.yaml"

    @property
    def warnings(self) -> tuple[Decision, ...]:
        """The decisions that the user should check."""
        return tuple(decision for decision in self.decisions if decision.level == "warning")

    def to_json(self) -> dict[str, Any]:
        """Return plain data for JSON."""
        return {
            "name": self.name,
            "folder": str(self.folder),
            "model_folder": str(self.model_folder),
            "definition": str(self.definition),
            "seconds": dict(self.seconds),
            "warnings": [f"{d.element}: {d.message}" if d.element else d.message for d in self.warnings],
            "fixes": self.facts.get("fixes", []),
            "read_back": self.facts.get("read_back", {}),
        }


def build_package(
    source: Source | None = None,
    *,
    config: ConfigSource | None = None,
    name: str | None = None,
    out: Path | str | None = None,
    dataset: str | None = None,
    overwrite: bool | None = None,
    packages: Mapping[str, Path] | None = None,
    xacro_args: Mapping[str, str] | None = None,
    missing_meshes: Literal["warn", "error"] | None = None,
    progress: ProgressCallback | None = None,
    begin: Begin | None = None,
    repaired: Finish | None = None,
    planned: Finish | None = None,
    finish: Finish | None = None,
) -> PackageResult:
    """Build a robot's package and move it into the data folder.

    `roboyard.import_robot` does this too, then validates the robot and writes a report.

    Args:
        source: a robot file (URDF or xacro), a `RobotDescription`, or a source configuration (a YAML file,
            its data, or an `ImportConfig`). May be omitted where `config` names the URDF.
        config: the source configuration that goes with a robot file, whose `urdf_path` the source replaces.
            Without any configuration the robot keeps its root frame and its base; wheels, grippers and
            planning data are detected.
        name: robot name, lower-cased; the configuration's or the file's by default.
        out: data folder; see `roboyard.paths.data_folder`.
        dataset: dataset folder below `out`; `omnigibson-robot-assets` by default.
        overwrite: whether to replace an import of this name; as the configuration says by default, else
            False.
        packages: ROS package name to folder.
        xacro_args: values of `<xacro:arg>` by name, where the robot file is a xacro file.
        missing_meshes: "warn" omits shapes whose mesh file is missing, "error" refuses them; by default
            visual shapes are omitted and collision shapes refused.
        progress: called with each step and its progress.
        begin: called once the source was read.
        repaired: called with the repaired robot; its meshes are in the build folder.
        planned: called with the robot before its files are written; its meshes are in the build folder.
        finish: called with the robot after its files are written and before they are moved in; it may add
            files to the package and facts to its log.

    Returns:
        The package and the decisions made.

    Raises:
        ConfigError: the configuration is wrong (every problem is listed), or the robot exists already.
        DescriptionError: the URDF cannot be used.
    """
    with source_file(source) as file_or_config:
        loaded = load_source(
            file_or_config,
            config,
            {
                "name": name,
                "dataset_name": dataset,
                "overwrite": overwrite,
                "xacro_args": dict(xacro_args) if xacro_args else None,
                "missing_meshes": missing_meshes,
            },
            packages or {},
        )
        folders = PackageFolders(
            data=writable_data_folder(out).absolute(),
            dataset=loaded.config.dataset_name,
            name=loaded.config.name,
        )
        log = ImportLog(progress=progress)
        if loaded.file is not None:
            log.facts["configuration"] = loaded.file.name
        for note in loaded.notes:
            log.warn(note)
        with building(folders, overwrite=loaded.config.overwrite) as build:
            context = ImportContext(
                config=loaded.config,
                urdf=loaded.urdf,
                source=loaded.elements
                or parse_urdf(loaded.urdf, packages=packages, xacro_args=loaded.config.xacro_args),
                build=build / "object",
                log=log,
                has_config=loaded.has_config,
                packages=packages or {},
            )
            if begin is not None:
                begin(context)
            robot = _build(context, repaired, planned, finish)
            _copy_to_model_folder(build, robot.name)
            final = rebased(robot, context.build, folders.object)
    return PackageResult(
        name=robot.name,
        folder=folders.object,
        model_folder=folders.model,
        robot=final,
        decisions=tuple(log.decisions),
        seconds=dict(log.seconds),
        facts=dict(log.facts),
    )


def _build(
    context: ImportContext, repaired: Finish | None, planned: Finish | None, finish: Finish | None
) -> RobotModel:
    from roboyard.importer.resolved_findings import mark_resolved
    from roboyard.importer.verify.read_back import check_files
    from roboyard.importer.write_formats import write_package

    log = context.log
    with log.step("stage_and_clean"):
        robot = repair_and_copy_files(context)
    if repaired is not None:
        repaired(robot, context)
    context = with_inferred_settings(context, robot)
    for step in STEPS:
        with log.step(step.__module__.rpartition(".")[2]):
            robot = step(robot, context)
    if planned is not None:
        planned(robot, context)
    with log.step("write"):
        write_package(robot, context)
    with log.step("read_back"):
        written = parse_urdf(context.urdf_folder / f"{robot.name}.urdf")
        check_files(robot, context, written)
        mark_resolved(robot, context, written)
    if finish is not None:
        finish(robot, context)
    log.write(context.build / "import_log.json", context.portable)
    return robot


def _copy_to_model_folder(build: Path, name: str) -> None:
    """Copy the import to the registered model's folder, and move the definition there."""
    shutil.copytree(build / "object", build / "model", dirs_exist_ok=True)
    (build / "object" / f"{name}.yaml").unlink()


def rebased(robot: RobotModel, old: Path, new: Path) -> RobotModel:
    """Return the robot with its files below `new` instead of `old`."""

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
