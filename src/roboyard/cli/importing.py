"""`roboyard import`: turn a vendor's robot file, with or without a source configuration, into a package."""

from __future__ import annotations

from inspect import cleandoc
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from roboyard.cli.completion import viewed_names
from roboyard.cli.missing_meshes import MissingMeshesOption
from roboyard.cli.packages import PackageOption
from roboyard.cli.xacro_args import XacroArgOption
from roboyard.untrusted.text import json_text, say

if TYPE_CHECKING:
    from roboyard.importer.pipeline import ImportResult
    from roboyard.validation import ValidationReport

EXAMPLES = """
Examples:

\b
  roboyard import my_robot.urdf --name mine
  roboyard import my_config.yaml --overwrite
  roboyard import my_robot.urdf --config my_config.yaml --out data
"""

CONFIGURATION = """
A source configuration, here the bundled R1's (only urdf_path and name are required):

\b
urdf_path: r1_pro_source.urdf     # the vendor's URDF, beside this file or absolute
name: r1                          # of the package; a letter, then letters, digits, _
overwrite: false                  # replace an import of this name
merge_fixed_joints: false         # join links behind fixed joints, inertias combined
base_motion:
  wheel_links: [wheel_link1, wheel_link2, wheel_link3]
  wheel_joints: [servo_joint1, servo_joint2, servo_joint3, wheel_joint1, wheel_joint2, wheel_joint3]
  use_sphere_wheels: true         # wheels collide as spheres
  use_holonomic_joints: true      # wheels are fixed, six virtual joints move the base
collision:
  decompose_method: coacd         # coacd, convex or null
  hull_count: 8                   # at most so many parts for a mesh
  coacd_links: []                 # convex decomposition
  convex_links: [base_link]       # one convex hull
  no_decompose_links: []          # collision shapes unchanged
  no_collision_links: [servo_link1, servo_link2, servo_link3]
eef_vis_links:                    # markers; same keys as camera_links and lidar_links
  - link: left_eef_link           # made new under parent_link, or an existing one
    parent_link: left_arm_link6
    offset: {position: [0, 0, 0.06], orientation: [0, 0, 0, 1]}
camera_links:
  - link: eyes
    parent_link: torso_link4
    offset: {position: [0.0732, 0, 0.4525], orientation: [0.4056, -0.4056, -0.5792, 0.5792]}
lidar_links: []
curobo:                           # for motion planning; missing keys are computed
  eef_to_gripper_info:
    left_eef_link:
      links: [left_gripper_link1, left_gripper_link2]
      joints: [left_gripper_axis1, left_gripper_axis2]
  lock_joints: {}                 # joint: position at which it is locked
  self_collision_ignore: {}       # link: [links it may touch]
  collision_spheres: {}           # link: [{center: [x, y, z], radius: r}]; fitted where missing
"""


def importing(
    source: Annotated[
        str | None,
        typer.Argument(
            help="A robot file, the name of a robot, or a source configuration (YAML).",
            metavar="[ROBOT]",
            show_default=False,
            autocompletion=viewed_names,
        ),
    ] = None,
    config: Annotated[
        Path | None,
        typer.Option(
            "--config",
            help="A source configuration (YAML), as above. ROBOT then replaces its urdf_path.",
            show_default=False,
        ),
    ] = None,
    name: Annotated[str | None, typer.Option("--name", help="Name of the robot.", show_default=False)] = None,
    out: Annotated[
        Path | None,
        typer.Option(
            "--out",
            "--data",
            help="Data folder; ROBOYARD_DATA or the platform's user data folder by default.",
            show_default=False,
        ),
    ] = None,
    dataset: Annotated[
        str | None,
        typer.Option("--dataset", "--dataset-name", help="Folder below the data folder.", show_default=False),
    ] = None,
    headless: Annotated[
        bool, typer.Option("--headless", help="Accepted for OmniGibson's sake: imports never open a window.")
    ] = False,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace an import of this name.")] = False,
    package: PackageOption = None,
    xacro_arg: XacroArgOption = None,
    missing_meshes: MissingMeshesOption = None,
    validate: Annotated[
        bool,
        typer.Option("--validate/--no-validate", help="Test the robot, as `roboyard validate` does."),
    ] = True,
    report: Annotated[
        bool, typer.Option("--report/--no-report", help="Write import_report.html, with pictures.")
    ] = True,
    as_json: Annotated[bool, typer.Option("--json", help="Print the result as JSON.")] = False,
) -> None:
    """Turn a robot file into clean URDF, USD, MJCF and planner files.

    They come with fitted collision shapes and spheres, a definition and a report, in one folder.

    At the end the robot is tested in simulation. A failed test is a warning; the package is written either
    way.
    """
    del headless
    from roboyard.cli.missing_meshes import read_missing_meshes
    from roboyard.cli.packages import read_packages
    from roboyard.cli.robot_argument import given_robot
    from roboyard.cli.xacro_args import read_xacro_args
    from roboyard.errors import ConfigError
    from roboyard.importer.pipeline import import_robot

    if source is None and config is None:
        raise ConfigError("give a ROBOT or --config FILE; roboyard import --help shows an example")
    given = None if source is None else given_robot(source, package, xacro_arg)
    if given is not None and config is None:
        name = name or given.name
    with _progress_bar(quiet=as_json) as progress:
        result = import_robot(
            None if given is None else given.file,
            config=config,
            name=name,
            out=out,
            dataset=dataset,
            overwrite=True if overwrite else None,
            packages=read_packages(package or []) if given is None else given.packages,
            xacro_args=read_xacro_args(xacro_arg or []) if given is None else given.xacro_args,
            missing_meshes=read_missing_meshes(missing_meshes),
            progress=progress,
            validate=validate,
            report=report,
        )
    _print_result(result, as_json=as_json, report=report)


importing.__doc__ = f"{cleandoc(importing.__doc__ or '')}\n{CONFIGURATION}"


def _print_result(result: ImportResult, *, as_json: bool, report: bool) -> None:
    """Print what an import found and wrote, for people or as JSON."""
    from roboyard.importer.import_log import unique_warnings

    if as_json:
        print(json_text(result.to_json()))
        return
    for line in _finding_lines(result.facts.get("source", {}).get("findings", [])):
        say(line)
    for message, elements in unique_warnings(result.warnings):
        named = [element for element in elements if element]
        who = ", ".join(named[:3]) + (f" and {len(named) - 3} more" if len(named) > 3 else "")
        say(f"warning: {f'{who}: ' if who else ''}{message}")
    if result.validation is not None:
        say(*_validation_lines(result.validation))
    say(f"{result.name}: {len(result.robot.description.links)} links, imported into {result.folder}")
    say(f"definition: {result.definition}")
    if report:
        say(f"report: {result.report}")


def _validation_lines(report: ValidationReport) -> list[str]:
    """Return a summary line, and one line for each failed gate."""
    gates = [gate for gate in report.gates if not gate.skipped]
    passed = sum(gate.passed for gate in gates)
    lines = [f"validation: {passed} of {len(gates)} gates passed in {report.seconds:.1f} s"]
    return lines + [gate.line() for gate in report.failed]


def _finding_lines(findings: list[dict[str, Any]]) -> list[str]:
    """Return the audit's findings on the vendor's file: a line for each kind, the first of its kind in full.

    Names that only USD forbids are skipped: an import keeps them.
    """
    from roboyard.importer.steps.repair_and_copy import KEPT

    by_code: dict[str, list[dict[str, Any]]] = {}
    for finding in (f for f in findings if f["code"] not in KEPT):
        by_code.setdefault(str(finding["code"]), []).append(finding)
    lines = []
    for same in by_code.values():
        first = same[0]
        where = f"line {first['line']}: " if first.get("line") else ""
        element = f"{first['element']}: " if first.get("element") else ""
        more = f" (and {len(same) - 1} more like this)" if len(same) > 1 else ""
        lines.append(f"info: {where}{element}{first['message']}{more} [{first['code']}]")
    return lines


def _progress_bar(*, quiet: bool):
    """Return a context manager that shows the import's steps on a terminal, and nothing in a pipe."""
    import sys
    from contextlib import contextmanager, nullcontext

    if quiet or not sys.stderr.isatty():
        return nullcontext(None)

    @contextmanager
    def shown():
        from rich.console import Console
        from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

        columns = (TextColumn("{task.description:<18}"), BarColumn(), TimeElapsedColumn())
        with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
            task = bar.add_task("import", total=1.0)

            def update(step: str, share: float, detail: str) -> None:
                bar.update(task, description=step.replace("_", " "), completed=share)

            yield update

    return shown()
