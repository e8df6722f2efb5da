"""Fix the findings that have one safe fix, and write the result into a folder of its own."""

from __future__ import annotations

import json
import os
import tempfile
import xml.etree.ElementTree as ET
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any
from urllib.parse import unquote

from roboyard.audit.findings import ERROR, Audit, Finding
from roboyard.audit.registry import CHECKS
from roboyard.audit.run import audit_urdf, quietly
from roboyard.description.files.copy_files import FileCopier, plain_name
from roboyard.description.urdf.parse import UrdfElements, parse_urdf
from roboyard.description.xacro.expand import robot_stem
from roboyard.errors import ConfigError, DescriptionError, unknown_name
from roboyard.repair import fixes as fixes
from roboyard.repair.registry import FIXES, RepairContext
from roboyard.repair.text_diff import unified_diff

LOG_NAME, RENAMES_NAME, DIFF_NAME = "repair_log.json", "renames.json", "repair.diff"


@dataclass(frozen=True, kw_only=True, slots=True)
class Fix:
    """One change to the robot description."""

    code: str
    element: str
    """As in `joint "elbow"`, by its old name."""
    line: int | None
    """In the original file."""
    before: str
    after: str

    def to_json(self) -> dict[str, Any]:
        """Plain data for JSON."""
        return {name: getattr(self, name) for name in self.__slots__}


@dataclass(frozen=True, kw_only=True, slots=True)
class Repair:
    """Result of a repair."""

    urdf: Path
    """The repaired file."""
    elements: UrdfElements
    """The repaired file, parsed: `load_description` builds the robot from it without reading it again."""
    fixes: tuple[Fix, ...]
    """In the order in which they were made."""
    renames: Mapping[str, Mapping[str, str]]
    """`links` and `joints`: old name to new name."""
    staged: Mapping[str, str]
    """Source file to its copy, relative to the repaired file."""
    diff: str
    """Unified diff of the description, both sides in the same plain layout."""
    before: Audit
    after: Audit

    @property
    def left(self) -> tuple[Finding, ...]:
        """Findings that remain."""
        return self.after.findings

    def to_json(self) -> dict[str, Any]:
        """Plain data for JSON."""
        return {
            "urdf": str(self.urdf),
            "fixes": [fix.to_json() for fix in self.fixes],
            "renames": {kind: dict(names) for kind, names in self.renames.items()},
            "staged": dict(self.staged),
            "left": [finding.to_json() for finding in self.left],
            "status": self.after.status,
            "usable": self.after.is_usable,
        }


@quietly
def repair_urdf(
    source: Path | str | UrdfElements,
    out: Path | str,
    *,
    only: Collection[str] = (),
    keep: Collection[str] = (),
    packages: Mapping[str, Path] | None = None,
    search_paths: Sequence[Path] = (),
    xacro_args: Mapping[str, str] | None = None,
) -> Repair:
    """Fix the findings that have one safe fix, and write the repaired robot into the folder `out`.

    Writes `<name>.urdf`, copies of its meshes and images (`meshes/`, `textures/`) named by relative paths,
    `renames.json`, `repair_log.json` (each fix with before and after) and `repair.diff`. Forward kinematics
    and the order of links and joints do not change; comments are not kept. Fixes are made in the order of
    `FIXES`; repairing the result changes nothing. Findings that need a guess are reported and not changed.

    Args:
        source: a URDF or xacro file; or the elements that `parse_urdf` returned, which are not changed and
            for which `packages`, `search_paths` and `xacro_args` are ignored.
        out: folder to write; files of an earlier repair in it are replaced, others stay.
        only: codes to fix; all by default.
        keep: codes that are not fixed.
        packages: ROS package name to folder.
        search_paths: more folders to search for packages and files.
        xacro_args: values of `<xacro:arg>` by name, for a xacro file.

    Raises:
        DescriptionError: the file cannot be read at all.
        ConfigError: a code has no fix, or `out` is the robot's own folder.
    """
    folder = Path(out)
    codes = _chosen(only, keep)
    original = source
    if not isinstance(original, UrdfElements):
        original = parse_urdf(original, packages=packages, search_paths=search_paths, xacro_args=xacro_args)
    before, file = audit_urdf(original), original.path
    if any(CHECKS[finding.code].topic == "file" and finding.severity == ERROR for finding in before.findings):
        first = before.findings[0]
        raise DescriptionError(f"{first.message}; {first.remedy}", file=file, line=first.line)
    _refuse_own_folder(file, folder)
    folder.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix=f".{folder.name}.", dir=folder.parent) as partial:
        work = Path(partial)
        name = plain_name(f"{robot_stem(file)}.urdf")
        context = RepairContext(
            urdf=original.editable_copy(),
            copier=FileCopier(
                folder=work, plain="mesh-file-name" in codes, reserved=_missing_names(original)
            ),
            keep=frozenset(FIXES) - codes,
        )
        unchanged = _text(context.urdf.root)
        fixes = _fix_all(context, codes)
        _copy_rest(context)
        text = _text(context.urdf.root)
        (work / name).write_text(text, encoding="utf-8", errors="backslashreplace")
        written = parse_urdf(work / name)
        result = Repair(
            urdf=folder / name,
            elements=written.moved_to(folder / name),
            fixes=tuple(fixes),
            renames={"links": context.link_renames, "joints": context.joint_renames},
            staged={str(source): copy for source, copy in context.copier.staged.items()},
            diff=unified_diff(unchanged, text, file.name, name),
            before=before,
            after=replace(audit_urdf(written), file=folder / name),
        )
        _write_logs(result, work)
        _publish(work, folder)
    return result


def _write_logs(result: Repair, folder: Path) -> None:
    (folder / RENAMES_NAME).write_text(_json(result.renames), encoding="utf-8", errors="backslashreplace")
    (folder / LOG_NAME).write_text(_json(result.to_json()), encoding="utf-8", errors="backslashreplace")
    (folder / DIFF_NAME).write_text(result.diff, encoding="utf-8", errors="backslashreplace")


def _chosen(only: Collection[str], keep: Collection[str]) -> frozenset[str]:
    for code in (*only, *keep):
        if code not in CHECKS:
            raise ConfigError(unknown_name("code", code, FIXES))
        if code not in FIXES:
            raise ConfigError(f"{code} is not fixed by repair; it fixes {', '.join(FIXES)}")
    return frozenset(only or FIXES) - frozenset(keep)


def _refuse_own_folder(source: Path, folder: Path) -> None:
    own, target = source.resolve().parent, folder.resolve()
    if target == own or own.is_relative_to(target):
        raise ConfigError(f"{folder} holds the robot itself; give another folder, so that the original stays")
    if folder.exists() and not folder.is_dir():
        raise ConfigError(f"{folder} is a file; give a folder")


def _fix_all(context: RepairContext, codes: frozenset[str]) -> list[Fix]:
    done: list[Fix] = []
    for code, function in FIXES.items():
        if code not in codes:
            continue
        check = CHECKS[code]
        faults = [fault for fault in check.run(context.urdf) if check.finding(fault).fixable]
        if not faults:
            continue
        for made in function(context, faults):
            done.append(
                Fix(code=code, element=made.element, line=made.line, before=made.before, after=made.after)
            )
        context.urdf = _again(context.urdf)
    return done


def _missing_names(urdf: UrdfElements) -> frozenset[str]:
    """Names of the files that the description names and that are not there."""
    missing = [mesh.uri for _, mesh in urdf.mesh_shapes if mesh.found.path is None]
    for material in urdf.materials:
        texture = material.element.find("texture")
        if texture is not None and (material.texture is None or material.texture.path is None):
            missing.append(texture.get("filename") or "")
    return frozenset(unquote(uri).replace("\\", "/").rpartition("/")[2].strip().casefold() for uri in missing)


def _again(urdf: UrdfElements) -> UrdfElements:
    """The urdf of the tree as it is now; mesh files are not read again."""
    return urdf.parsed_again()


def _copy_rest(context: RepairContext) -> None:
    """Copy the meshes and images that no fix has copied: relative references must hold in the new folder."""
    for _, mesh in context.urdf.mesh_shapes:
        kept = "mesh-reference" in context.keep and ("://" in mesh.uri or mesh.uri.strip().startswith("/"))
        if mesh.found.path is not None and id(mesh.element) not in context.moved and not kept:
            mesh.element.set("filename", context.copier.mesh(mesh.found.path))
    for material in context.urdf.materials:
        texture = material.element.find("texture")
        if texture is not None and material.texture is not None and material.texture.path is not None:
            texture.set("filename", context.copier.image(material.texture.path))


def _text(root: ET.Element) -> str:
    """The description in a plain layout: two blanks a level, one element a line."""
    ET.indent(root)
    return f'<?xml version="1.0" encoding="utf-8"?>\n{ET.tostring(root, encoding="unicode")}\n'


def _json(data: Any) -> str:
    return json.dumps(data, indent=2, ensure_ascii=False) + "\n"


def _publish(work: Path, folder: Path) -> None:
    """Move the finished files into place, each at once."""
    for file in sorted(work.rglob("*")):
        target = folder / file.relative_to(work)
        if file.is_dir():
            target.mkdir(parents=True, exist_ok=True)
        else:
            target.parent.mkdir(parents=True, exist_ok=True)
            os.replace(file, target)  # noqa: PTH105
