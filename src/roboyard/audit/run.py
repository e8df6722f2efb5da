"""Run every check over a file."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import ParamSpec, TypeVar

import numpy as np

from roboyard._threads import thread_count
from roboyard.audit import checks as checks
from roboyard.audit.findings import ERROR, Audit, Facts, Finding
from roboyard.audit.registry import CHECKS, Fault, Faults, check
from roboyard.description.urdf.build import build_description
from roboyard.description.urdf.parse import UrdfElements, parse_urdf
from roboyard.errors import DescriptionError, MeshError
from roboyard.shapes.mesh_stats import MeshStats, mesh_stats

P = ParamSpec("P")
R = TypeVar("R")


@check(
    "not-loadable",
    ERROR,
    remedy="correct what the message names",
    example="(anything the reader refuses that no other check found)",
)
def not_loadable(urdf: UrdfElements) -> Faults:
    """The reader refuses the file for a reason that no other check names."""
    try:
        build_description(urdf, missing_meshes="note")
    except DescriptionError as error:
        for problem in error.problems[:20]:
            yield Fault(message=problem, line=error.line)


def quietly(function: Callable[P, R]) -> Callable[P, R]:
    """Silence NumPy's warnings: the numbers of a broken file may overflow, and the checks report them."""

    @functools.wraps(function)
    def quiet(*args: P.args, **kwargs: P.kwargs) -> R:
        with np.errstate(all="ignore"):
            return function(*args, **kwargs)

    return quiet


@quietly
def audit_urdf(
    source: Path | str | UrdfElements,
    *,
    packages: Mapping[str, Path] | None = None,
    search_paths: Sequence[Path] = (),
    xacro_args: Mapping[str, str] | None = None,
) -> Audit:
    """Audit a URDF: report everything that is wrong with it, worst first.

    Nothing is written but statistics of meshes, to the user's cache folder, and nothing outside the robot's
    folders is read. A file that cannot be read is a finding, not an exception.

    Args:
        source: a URDF or xacro file; or the elements that `parse_urdf` returned, for which the other
            arguments are ignored.
        packages: ROS package name to folder, for `package://` and `model://`.
        search_paths: more folders to search for packages and files; see
            `roboyard.description.files.resolver`.
        xacro_args: values of `<xacro:arg>` by name, for a xacro file.
    """
    urdf = source
    if not isinstance(urdf, UrdfElements):
        urdf = parse_urdf(urdf, packages=packages, search_paths=search_paths, xacro_args=xacro_args)
    findings = _findings(urdf, of_file=True)
    blocked = any(finding.severity == ERROR for finding in findings)
    if not blocked:
        read_mesh_stats(urdf)
        findings += _findings(urdf, of_file=False)
        if not any(finding.severity == ERROR for finding in findings):
            last = CHECKS["not-loadable"]
            findings += [last.finding(fault) for fault in last.run(urdf)]
    order = {code: k for k, code in enumerate(CHECKS)}
    findings.sort(key=lambda f: (f.severity, f.line or 0, order[f.code]))
    return Audit(
        file=urdf.path,
        robot=urdf.name,
        findings=tuple(findings),
        facts=Facts() if blocked else _facts(urdf),
    )


def read_mesh_stats(urdf: UrdfElements) -> None:
    """Read the statistics of every mesh file that was found and is not read yet, two at a time."""
    found = dict.fromkeys(mesh.found.path for _, mesh in urdf.mesh_shapes)
    paths = [path for path in found if path is not None and path not in urdf.mesh_stats]
    with ThreadPoolExecutor(max_workers=thread_count(2), thread_name_prefix="meshes") as pool:
        urdf.mesh_stats.update(zip(paths, pool.map(_mesh_stats, paths), strict=True))


@quietly
def _mesh_stats(path: Path) -> MeshStats | MeshError:
    try:
        return mesh_stats(path)
    except MeshError as error:
        return error


def _findings(urdf: UrdfElements, *, of_file: bool) -> list[Finding]:
    """Findings of the checks of the file as such, or of all others."""
    found: list[Finding] = []
    for each in CHECKS.values():
        if each.code != "not-loadable" and (each.topic == "file") == of_file:
            found += [each.finding(fault) for fault in each.run(urdf)]
    return found


def _facts(urdf: UrdfElements) -> Facts:
    masses = [link.inertial.mass for link in urdf.links if link.inertial is not None]
    known = [mass for mass in masses if mass is not None and math.isfinite(mass)]
    shapes = list(urdf.shapes)
    triangles = {
        shape.mesh.found.path: shape.mesh.stats.triangles
        for shape in shapes
        if shape.mesh is not None and shape.mesh.stats is not None
    }
    return Facts(
        links=len(urdf.links),
        joints=len(urdf.joints),
        moving_joints=sum(1 for _ in urdf.moving_joints),
        mimic_joints=sum(joint.mimic is not None for joint in urdf.joints),
        visuals=sum(shape.kind == "visual" for shape in shapes),
        collisions=sum(shape.kind == "collision" for shape in shapes),
        mesh_files=len({shape.mesh.found.path for shape in shapes if shape.mesh and shape.mesh.found.path}),
        triangles=sum(triangles.values()),
        mass=sum(known) if known else None,
    )
