"""Load a robot description file of any format that Roboyard reads; today that is URDF.

A format is one entry of `FORMATS`: its root element and file suffixes, and the function that reads it, or the
remedy to name where Roboyard does not read it. The content decides, not the suffix: a URDF called `robot.xml`
loads.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from roboyard.description.files.resolver import Resolver
from roboyard.description.model import RobotDescription
from roboyard.description.urdf.build import read_urdf
from roboyard.description.urdf.build_context import Context
from roboyard.description.urdf.problems import Problems
from roboyard.description.urdf.xml import line_of, read_xml
from roboyard.errors import DescriptionError

MissingMeshes = Literal["error", "note"]
Reader = Callable[[ET.Element, Context], RobotDescription]


@dataclass(frozen=True, kw_only=True, slots=True)
class Format:
    """A format of robot description files."""

    name: str
    root: str | None
    """Tag of the XML root element; None for a format that is not XML."""
    suffixes: tuple[str, ...]
    """File suffixes, in lower case; they only decide for formats that are not XML."""
    read: Reader | None = None
    """Function that reads the root element; None where Roboyard does not read the format yet."""
    remedy: str = ""
    """For a format that is not read yet: the action to take."""


FORMATS: tuple[Format, ...] = (
    Format(name="URDF", root="robot", suffixes=(".urdf", ".xml"), read=read_urdf),
    Format(name="SDF", root="sdf", suffixes=(".sdf", ".world"), remedy="export the robot as URDF"),
    Format(
        name="MJCF",
        root="mujoco",
        suffixes=(".xml", ".mjcf"),
        remedy="add it to a world with World.add_mjcf, or export the robot as URDF",
    ),
    Format(
        name="USD",
        root=None,
        suffixes=(".usd", ".usda", ".usdc", ".usdz"),
        remedy="export the robot as URDF",
    ),
)


def load_description(
    source: Path | str | ET.ElementTree | ET.Element,
    *,
    packages: Mapping[str, Path] | None = None,
    search_paths: Sequence[Path] = (),
    missing_meshes: MissingMeshes = "error",
    strict: bool = False,
    words_are_zero: bool = False,
) -> RobotDescription:
    """Load a robot description; mesh files are located but not opened.

    Args:
        source: a robot file; or XML text (a string that starts with `<`); or a parsed tree.
        packages: ROS package name to folder, for `package://` and `model://`.
        search_paths: more folders to search for packages and files; see
            `roboyard.description.files.resolver`.
        missing_meshes: "error", or "note" to keep such shapes with `Mesh.path` None.
        strict: raise an error for everything that would otherwise be corrected and noted.
        words_are_zero: read every word among numbers as 0, as Bullet does, unexpanded xacro included.

    Returns:
        The description; its `notes` list each correction. Masses, inertias and limits are as written, even
        impossible ones; axes are scaled to unit length; an absent `<limit>` is None.

    Raises:
        DescriptionError: the file cannot be used; `problems` lists everything that is wrong with it.
    """
    root, file, notes = _root_element(source)
    problems = Problems(file, strict=strict, words_are_zero=words_are_zero)
    for note in notes:
        problems.note(None, "", note)
    read = _reader(root, file)
    base = None if file is None else Path(file).absolute().parent
    real_base = None if file is None or not file.is_symlink() else file.resolve().parent
    context = Context(
        problems=problems,
        resolver=Resolver(
            base=base,
            real_base=real_base,
            packages={name: Path(folder) for name, folder in (packages or {}).items()},
            search_paths=[Path(folder) for folder in search_paths],
        ),
        missing_meshes=missing_meshes,
    )
    return read(root, context)


def _root_element(
    source: Path | str | ET.ElementTree | ET.Element,
) -> tuple[ET.Element, Path | None, tuple[str, ...]]:
    """Root element of a source, its file if it has one, and notes on corrections of the XML."""
    if isinstance(source, ET.Element):
        return source, None, ()
    if isinstance(source, ET.ElementTree):
        root = source.getroot()
        if root is None:
            raise DescriptionError("the tree is empty; a URDF starts with a <robot> element")
        return root, None, ()
    if isinstance(source, str) and source.lstrip("\ufeff \t\r\n").startswith("<"):
        root, notes = read_xml(source)
        return root, None, notes
    file = Path(source)
    for each in FORMATS:
        if each.root is None and file.suffix.lower() in each.suffixes:
            raise DescriptionError(f"{each.name} is not read yet; {each.remedy}", file=file)
    root, notes = read_xml(file)
    return root, file, notes


def _reader(root: ET.Element, file: Path | None) -> Reader:
    """The function that reads files with this root element."""
    known = next((each for each in FORMATS if each.root == root.tag), None)
    if known is not None and known.read is not None:
        return known.read
    tag = root.tag if len(root.tag) <= 60 else root.tag[:57] + "..."
    what = "give a URDF" if known is None else f"{known.name} is not read yet; {known.remedy}"
    raise DescriptionError(
        f"the root element is <{tag}>, not <robot>; {what}",
        file=file,
        line=line_of(root),
    )
