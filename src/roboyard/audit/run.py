"""Run every check over a file."""

from __future__ import annotations

import functools
import math
import os
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import ParamSpec, TypeVar

import numpy as np

from roboyard.audit import checks as checks
from roboyard.audit.findings import ERROR, Audit, Facts, Finding
from roboyard.audit.registry import CHECKS, Fault, Faults, check
from roboyard.description.files.resolver import Resolver
from roboyard.description.loader import load_description
from roboyard.description.urdf.elements import UrdfElements
from roboyard.description.urdf.parse_elements import parse_elements, refused
from roboyard.description.urdf.xml import read_xml
from roboyard.errors import DescriptionError

P = ParamSpec("P")
R = TypeVar("R")


@check(
    "not-loadable",
    ERROR,
    remedy="mend what the message names",
    example="(anything the reader refuses that no other check found)",
)
def not_loadable(draft: UrdfElements) -> Faults:
    """The reader refuses the file for a reason that no other check names."""
    resolver = draft.resolver
    try:
        load_description(
            draft.file,
            packages=resolver.packages,
            search_paths=resolver.search_paths,
            missing_meshes="note",
        )
    except DescriptionError as error:
        for problem in error.problems[:20]:
            yield Fault(message=problem, line=error.line)


def audit_urdf(
    path: Path | str, *, packages: Mapping[str, Path] | None = None, search_paths: Sequence[Path] = ()
) -> Audit:
    """The report card of a URDF file: everything that is wrong with it, worst first.

    Nothing is written (but facts about meshes, to the user's cache folder), and nothing outside the robot's
    folders is read. A file that cannot be read is a finding, not an exception.

    Args:
        path: the URDF.
        packages: ROS package name to folder, for `package://` and `model://`.
        search_paths: more folders in which to look for packages and files; see
        `roboyard.description.files.resolver`.
    """
    draft, blocked = open_elements(path, packages=packages, search_paths=search_paths)
    return audit_elements(draft, blocked=blocked)


def quietly(function: Callable[P, R]) -> Callable[P, R]:
    """Numbers of a broken file may overflow; what comes of it is judged, not warned about."""

    @functools.wraps(function)
    def quiet(*args: P.args, **kwargs: P.kwargs) -> R:
        with np.errstate(all="ignore"):
            return function(*args, **kwargs)

    return quiet


@quietly
def open_elements(
    path: Path | str, *, packages: Mapping[str, Path] | None = None, search_paths: Sequence[Path] = ()
) -> tuple[UrdfElements, bool]:
    """The draft of a file, and True where there is nothing in it to look at."""
    file = Path(path)
    base = Path(os.path.abspath(file)).parent  # noqa: PTH100
    resolver = Resolver(
        base=base,
        real_base=_real_base(file),
        packages={name: Path(folder) for name, folder in (packages or {}).items()},
        search_paths=[Path(folder) for folder in search_paths],
    )
    try:
        root, notes = read_xml(file)
    except DescriptionError as error:
        return refused(file, error, resolver), True
    shell = UrdfElements(
        file=file,
        root=root,
        xml_notes=notes,
        links=(),
        joints=(),
        materials=(),
        number_faults=(),
        resolver=resolver,
    )
    if any(finding.severity == ERROR for finding in _findings(shell, only_file=True)):
        return shell, True
    return parse_elements(file, root, notes, resolver), False


def _real_base(file: Path) -> Path | None:
    """Folder of the file that a symbolic link leads to."""
    try:
        return file.resolve().parent if file.is_symlink() else None
    except (OSError, RuntimeError):  # links in a ring
        return None


@quietly
def audit_elements(draft: UrdfElements, *, blocked: bool = False) -> Audit:
    """The audit of a draft; `blocked` where only the checks of the file as such make sense."""
    findings = _findings(draft, only_file=blocked)
    if not blocked and not any(finding.severity == ERROR for finding in findings):
        last = CHECKS["not-loadable"]
        findings += [last.finding(fault) for fault in last.run(draft)]
    order = {code: k for k, code in enumerate(CHECKS)}
    findings.sort(key=lambda f: (f.severity, f.line or 0, order[f.code]))
    return Audit(
        file=draft.file,
        robot=draft.name,
        findings=tuple(findings),
        facts=Facts() if blocked else _facts(draft),
    )


def _findings(draft: UrdfElements, *, only_file: bool) -> list[Finding]:
    found: list[Finding] = []
    for each in CHECKS.values():
        if each.code == "not-loadable" or (only_file and each.topic != "file"):
            continue
        found += [each.finding(fault) for fault in each.run(draft)]
    return found


def _facts(draft: UrdfElements) -> Facts:
    masses = [link.inertial.mass for link in draft.links if link.inertial is not None]
    known = [mass for mass in masses if mass is not None and math.isfinite(mass)]
    shapes = list(draft.shapes)
    triangles = {
        shape.mesh.found.path: shape.mesh.facts.triangles
        for shape in shapes
        if shape.mesh is not None and shape.mesh.facts is not None
    }
    return Facts(
        links=len(draft.links),
        joints=len(draft.joints),
        moving_joints=sum(1 for _ in draft.moving_joints),
        mimic_joints=sum(joint.mimic is not None for joint in draft.joints),
        visuals=sum(shape.kind == "visual" for shape in shapes),
        collisions=sum(shape.kind == "collision" for shape in shapes),
        mesh_files=len({shape.mesh.found.path for shape in shapes if shape.mesh and shape.mesh.found.path}),
        triangles=sum(triangles.values()),
        mass=sum(known) if known else None,
    )
