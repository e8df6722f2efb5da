"""Import a robot: build its package, try the robot out in a scene, and write the page to look at.

The package is built by `roboyard.importer`; what is tried is in `roboyard.validation`; the page is made by
`roboyard.reports`. This is where the three meet, and what `roboyard import` calls.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

from roboyard.importer.build import ImportResult, build_package

if TYPE_CHECKING:
    from roboyard.description.robot_model import RobotModel
    from roboyard.importer.config.schema import ImportConfig
    from roboyard.importer.context import ImportContext
    from roboyard.importer.import_log import ProgressCallback
    from roboyard.validation import ValidationReport


@dataclass(frozen=True, kw_only=True, slots=True)
class RobotImport(ImportResult):
    """A finished import, and how the robot did when it was tried."""

    validation: ValidationReport | None = None
    """None where it was not asked for, or could not be run (a warning says why)."""

    @property
    def report(self) -> Path:
        """The page to look at."""
        return self.folder / "import_report.html"

    def to_json(self) -> dict[str, Any]:
        """Plain data for JSON."""
        return {
            **ImportResult.to_json(self),
            "report": str(self.report),
            "validation": None if self.validation is None else self.validation.to_json(),
        }


def import_robot(
    config: Path | str | Mapping[str, Any] | ImportConfig | None = None,
    *,
    urdf: Path | str | None = None,
    name: str | None = None,
    data: Path | str | None = None,
    dataset: str | None = None,
    overwrite: bool | None = None,
    packages: Mapping[str, Path] | None = None,
    progress: ProgressCallback | None = None,
    validate: bool = True,
    report: bool = True,
) -> RobotImport:
    """Import a robot into the data folder, try it out and write a report.

    The package is the same whatever the robot does when it is tried: a gate that fails is a warning.

    Args:
        config: a source configuration: a YAML file, its data, or a checked model. Without one the robot keeps
            its root frame and its base, and its wheels and everything a planner needs are worked out.
        urdf: the URDF, where there is no configuration (or instead of the one it names).
        name: the robot's name (or instead of the configuration's); lower-cased.
        data: the data folder; see `roboyard.paths.data_folder`.
        dataset: dataset folder; `omnigibson-robot-assets` by default.
        overwrite: replace an import of this name; as the configuration says (else no) by default.
        packages: ROS package name to folder.
        progress: told of every step.
        validate: also try the robot out (`roboyard.validation`).
        report: also write `import_report.html`.

    Returns:
        What was written, decided and found.

    Raises:
        ConfigError: the configuration is wrong (every problem is named), or the robot exists already.
        DescriptionError: the URDF cannot be used.
    """
    found: list[ValidationReport] = []

    def finish(robot: RobotModel, context: ImportContext) -> None:
        if validate:
            with context.log.step("validation"):
                found.extend(_tried(robot, context))
        if report:
            from roboyard.importer.report.page import write_import_page

            with context.log.step("report"):
                write_import_page(robot, context, found[0] if found else None)

    built = build_package(
        config,
        urdf=urdf,
        name=name,
        data=data,
        dataset=dataset,
        overwrite=overwrite,
        packages=packages,
        progress=progress,
        finish=finish,
    )
    values = {field.name: getattr(built, field.name) for field in fields(built)}
    return RobotImport(**values, validation=found[0] if found else None)


def _tried(robot: RobotModel, context: ImportContext) -> list[ValidationReport]:
    """The gates' report on the package in the build folder; nothing where they cannot be run."""
    from roboyard.robots import RegisteredRobot
    from roboyard.validation import validate

    log = context.log
    definition = context.build / f"{robot.name}.yaml"
    try:
        report = validate(
            RegisteredRobot(name=robot.name, file=definition, dataset=context.build),
            progress=lambda gate, share: log.tell(share, gate.replace("_", " ")),
        )
    except Exception as error:  # the package is whole, whatever becomes of the trial
        told = " ".join(str(error).split())[:300]
        log.warn(f"the robot could not be tried out: {type(error).__name__}: {told}")
        return []
    log.facts["validation"] = report.to_json()
    for gate in report.failed:
        findings = "; ".join(gate.findings[:3])
        log.warn(f"{gate.title}: no ({findings or gate.detail}); {gate.advice}", f'gate "{gate.name}"')
    return [report]
