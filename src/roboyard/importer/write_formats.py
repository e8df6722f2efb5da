"""Write the files of a package in every format."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from roboyard.description.robot_model import RobotModel
from roboyard.errors import MissingExtraError
from roboyard.export.export_result import ExportResult
from roboyard.importer.context import ImportContext
from roboyard.importer.steps.metadata import write_metadata, write_understanding


def write_package(robot: RobotModel, context: ImportContext) -> dict[str, ExportResult]:
    """Write the robot in every format into `context.build`; returns format name to result."""
    from roboyard.export import curobo, definition, mjcf, moveit, python_configs, sdf, urdf, usd, xrdf

    build, name = context.build, robot.name
    tasks: tuple[tuple[str, Callable[[], ExportResult]], ...] = (
        ("urdf", lambda: urdf.write(robot, build / "urdf")),
        ("usd", lambda: usd.write(robot, build / "usd" / f"{name}.usda", textures=build / "material")),
        ("mjcf", lambda: mjcf.write(robot, build / "mjcf" / f"{name}.xml")),
        ("sdf", lambda: sdf.write(robot, build / "sdf" / f"{name}.sdf", shared=build)),
        ("python", lambda: python_configs.write(robot, build)),
        ("curobo", lambda: curobo.write(robot, build / "curobo")),
        ("xrdf", lambda: xrdf.write(robot, build / "curobo" / f"{name}.xrdf")),
        ("moveit", lambda: moveit.write(robot, build / "moveit")),
        ("definition", lambda: definition.write(robot, build / f"{name}.yaml")),
    )
    written: dict[str, ExportResult] = {}
    for index, (kind, task) in enumerate(tasks):
        context.log.report_progress(index / len(tasks), kind)
        try:
            written[kind] = task()
        except MissingExtraError as error:
            context.log.warn(f"{kind} skipped: {error}")
            continue
        for note in written[kind].notes:
            context.log.note(f"{kind}: {note}")
    write_metadata(robot, build / "misc" / "metadata.json")
    write_understanding(robot, build / "understanding.json")
    context.log.facts["files"] = {
        kind: [relative(path, build) for path in result.files[:1]] for kind, result in written.items()
    }
    return written


def relative(path: Path, folder: Path) -> str:
    """Return a path relative to a folder, with `/`."""
    return path.relative_to(folder).as_posix() if path.is_relative_to(folder) else path.name
