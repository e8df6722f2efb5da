"""Import a robot: build its package, validate the robot, and write the HTML report.

`build_package` makes the files, `roboyard.validation` runs the gates, `roboyard.importer.report` makes the
page.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from roboyard._second_process import Part, SecondProcess
from roboyard.importer.build import PackageResult, build_package

if TYPE_CHECKING:
    from roboyard.description.robot_model import RobotModel
    from roboyard.importer.context import ImportContext
    from roboyard.importer.import_log import ProgressCallback
    from roboyard.importer.report.page import RobotSections
    from roboyard.importer.source import ConfigSource, Source
    from roboyard.validation import ValidationReport

LINKS = 8
"""Links from which a second process pays: an import of fewer is over before it would be ready."""


@dataclass(frozen=True, kw_only=True, slots=True)
class ImportResult(PackageResult):
    """A finished import with its validation."""

    validation: ValidationReport | None = None
    """None where it was not requested, or could not run (a warning gives the reason)."""

    @property
    def report(self) -> Path:
        """Path of the HTML report."""
        return self.folder / "import_report.html"

    def to_json(self) -> dict[str, Any]:
        """Return plain data for JSON."""
        return {
            **PackageResult.to_json(self),
            "report": str(self.report),
            "validation": None if self.validation is None else self.validation.to_json(),
        }


def import_robot(
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
    validate: bool = True,
    report: bool = True,
) -> ImportResult:
    """Import a robot into the data folder, validate it and write a report.

    The package does not depend on the validation: a failed gate is a warning.

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
        validate: whether to run `roboyard.validation` on the package.
        report: whether to write `import_report.html`.

    Returns:
        The package, the decisions made, and the validation.

    Raises:
        ConfigError: the configuration is wrong (every problem is listed), or the robot exists already.
        DescriptionError: the URDF cannot be used.
    """
    found: list[ValidationReport] = []
    before: list[Part[list[str]]] = []
    drawing: list[Part[RobotSections]] = []

    with SecondProcess() as second:

        def begin(context: ImportContext) -> None:
            if (validate or report) and len(context.source.links) >= LINKS:
                second.begin()
                second.call(get_ready)

        # pictures take no part in what follows
        def draw_source(robot: RobotModel, context: ImportContext) -> None:
            from roboyard.importer.report.page import source_pictures
            from roboyard.importer.report.pictures import prepare_visuals

            if report:
                before.append(second.call(source_pictures, context.source))
                second.call(prepare_visuals, robot.description)

        def draw(robot: RobotModel, context: ImportContext) -> None:
            from roboyard.importer.report.page import robot_sections

            if report:
                drawing.append(second.call(robot_sections, robot, context.log.facts))

        def finish(robot: RobotModel, context: ImportContext) -> None:
            from roboyard.importer.report.page import write_import_page

            if validate:
                with context.log.step("validation"):
                    found.extend(_validation(robot, context, second))
            for source_part, part in zip(before, drawing, strict=True):
                with context.log.step("report"):
                    pictures = source_part.result()
                    write_import_page(robot, context, found[0] if found else None, pictures, part.result())

        built = build_package(
            source,
            config=config,
            name=name,
            out=out,
            dataset=dataset,
            overwrite=overwrite,
            packages=packages,
            xacro_args=xacro_args,
            missing_meshes=missing_meshes,
            progress=progress,
            begin=begin,
            repaired=draw_source,
            planned=draw,
            finish=finish,
        )
    values = {field.name: getattr(built, field.name) for field in fields(built)}
    return ImportResult(**values, validation=found[0] if found else None)


def get_ready() -> None:
    """Load what the second process needs: modules, and the loops that draw."""
    from roboyard.importer.report.pictures import warm_up
    from roboyard.validation import gates

    assert gates.GATES
    warm_up()


def _validation(robot: RobotModel, context: ImportContext, second: SecondProcess) -> list[ValidationReport]:
    """Run the gates on the package in the build folder; return an empty list where they cannot run."""
    from roboyard.robots import RegisteredRobot
    from roboyard.validation import validate

    log = context.log
    definition = context.build / f"{robot.name}.yaml"
    try:
        report = validate(
            RegisteredRobot(name=robot.name, file=definition, dataset=context.build),
            progress=lambda gate, share: log.report_progress(share, gate.replace("_", " ")),
            second=second,
        )
    except Exception as error:  # the package is complete; a validation that cannot run must not lose it
        cause = " ".join(str(error).split())[:300]
        log.warn(f"validation could not run: {type(error).__name__}: {cause}")
        return []
    log.facts["validation"] = report.to_json()
    for gate in report.failed:
        findings = "; ".join(gate.findings[:3])
        log.warn(f"{gate.title}: no ({findings or gate.detail}); {gate.advice}", f'gate "{gate.name}"')
    for gate in report.gates:
        for text in gate.warnings:
            log.warn(text, f'gate "{gate.name}"')
    return [report]
