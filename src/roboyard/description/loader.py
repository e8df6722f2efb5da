"""Load a robot description file of any format that Roboyard reads; today these are URDF, also written as
xacro, MJCF, SDF and USD.

An XML format is one entry of `FORMATS`: its root element and the function that reads it, or the remedy to
name where Roboyard does not read it. The content decides, not the ending: a URDF called `robot.xml` loads.
USD alone is known by the ending of its files (`description.usd`).
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from roboyard._records import dataclass
from roboyard.description.files.resolver import Resolver
from roboyard.description.model import RobotDescription
from roboyard.description.urdf.build import build_description
from roboyard.description.urdf.build_context import MissingMeshes
from roboyard.description.urdf.parse import UrdfElements
from roboyard.description.urdf.xml import line_of, read_xml
from roboyard.description.xacro.expand import USD_SUFFIXES, read_robot_xml
from roboyard.errors import DescriptionError


@dataclass(frozen=True, kw_only=True, slots=True)
class LoadOptions:
    """Options of `load_description`, for readers."""

    packages: Mapping[str, Path] | None = None
    search_paths: Sequence[Path] = ()
    readable: Sequence[Path] = ()
    missing_meshes: MissingMeshes = "error"
    strict: bool = False
    words_are_zero: bool = False
    xacro_args: Mapping[str, str] | None = None


@dataclass(frozen=True, kw_only=True, slots=True)
class XmlSource:
    """A parsed XML file."""

    root: ET.Element
    file: Path | None = None
    """None for XML made in memory."""
    notes: tuple[str, ...] = ()
    """Corrections that made the file well-formed."""


Reader = Callable[[XmlSource, LoadOptions], RobotDescription]


@dataclass(frozen=True, kw_only=True, slots=True)
class Format:
    """A format of robot description files."""

    name: str
    root: str | None
    """Tag of the XML root element; None for USD, which is known by the ending of its files."""
    suffixes: tuple[str, ...]
    """Usual endings of its files, in lower case."""
    read: Reader | None = None
    """None where Roboyard does not read the format yet."""
    remedy: str = ""
    """For a format that is not read yet: the action to take."""


def _resolver(file: Path | None, options: LoadOptions) -> Resolver:
    return Resolver.of_file(
        file, packages=options.packages, search_paths=options.search_paths, readable=options.readable
    )


def _read_urdf(source: XmlSource, options: LoadOptions) -> RobotDescription:
    elements = UrdfElements(
        file=source.file,
        root=source.root,
        xml_notes=source.notes,
        words_are_zero=options.words_are_zero,
        resolver=_resolver(source.file, options),
    )
    return build_description(elements, missing_meshes=options.missing_meshes, strict=options.strict)


def _read_sdf(source: XmlSource, options: LoadOptions) -> RobotDescription:
    from roboyard.description.sdf.build import read_sdf

    resolver = _resolver(source.file, options)
    root, notes = read_sdf(source.root, source.file, resolver)
    return _read_urdf(XmlSource(root=root, file=source.file, notes=(*source.notes, *notes)), options)


FORMATS: tuple[Format, ...] = (
    Format(name="URDF", root="robot", suffixes=(".urdf", ".xacro", ".xml"), read=_read_urdf),
    Format(name="SDF", root="sdf", suffixes=(".sdf", ".world"), read=_read_sdf),
    Format(
        name="MJCF",
        root="mujoco",
        suffixes=(".xml", ".mjcf"),
        remedy="save it in a file",
    ),
    Format(name="USD", root=None, suffixes=USD_SUFFIXES),
)


def load_description(
    source: Path | str | ET.ElementTree | ET.Element | UrdfElements,
    *,
    packages: Mapping[str, Path] | None = None,
    search_paths: Sequence[Path] = (),
    readable: Sequence[Path] = (),
    missing_meshes: MissingMeshes = "error",
    strict: bool = False,
    words_are_zero: bool = False,
    xacro_args: Mapping[str, str] | None = None,
) -> RobotDescription:
    """Load a robot description; mesh files are located but not opened.

    Args:
        source: a robot file; or XML text (a string that starts with `<`); or a parsed tree; or the elements
            that `parse_urdf` returned, for which `packages`, `search_paths` and `words_are_zero` are ignored.
        packages: ROS package name to folder, for `package://` and `model://`.
        search_paths: more folders to search for packages and files; see
            `roboyard.description.files.resolver`.
        readable: folders whose files may be read by absolute paths and links; nothing is searched there.
        missing_meshes: "error", or "note" to keep such shapes with `Mesh.path` None.
        strict: raise an error for everything that would otherwise be corrected and noted.
        words_are_zero: read every word among numbers as 0, as Bullet does; only files called `.xacro` are
            then expanded.
        xacro_args: values of `<xacro:arg>` by name, for a xacro file.

    Returns:
        The description; its `notes` list each correction. Masses, inertias and limits are as written, even
        impossible ones; axes are scaled to unit length; an absent `<limit>` is None.

    Raises:
        DescriptionError: the file cannot be used; `problems` lists everything that is wrong with it.
    """
    if isinstance(source, UrdfElements):
        return build_description(source, missing_meshes=missing_meshes, strict=strict)
    options = LoadOptions(
        packages=packages,
        search_paths=search_paths,
        readable=readable,
        missing_meshes=missing_meshes,
        strict=strict,
        words_are_zero=words_are_zero,
        xacro_args=xacro_args,
    )
    xml = _xml_source(source, options)
    return _reader(xml)(xml, options)


def _xml_source(source: Path | str | ET.ElementTree | ET.Element, options: LoadOptions) -> XmlSource:
    if isinstance(source, ET.Element):
        return XmlSource(root=source)
    if isinstance(source, ET.ElementTree):
        root = source.getroot()
        if root is None:
            raise DescriptionError(f"the tree is empty ({source!r}); a URDF starts with a <robot> element")
        return XmlSource(root=root)
    if isinstance(source, str) and source.lstrip("\ufeff \t\r\n").startswith("<"):
        root, notes = read_xml(source)
        return XmlSource(root=root, notes=notes)
    file = Path(source)
    resolver = _resolver(file, options)
    root, notes = read_robot_xml(file, resolver, options.xacro_args, expand=not options.words_are_zero)
    return XmlSource(root=root, file=file, notes=notes)


def _reader(source: XmlSource) -> Reader:
    """The function that reads files with this root element."""
    root = source.root
    known = next((each for each in FORMATS if each.root == root.tag), None)
    if known is not None and known.read is not None:
        return known.read
    tag = root.tag if len(root.tag) <= 60 else root.tag[:57] + "..."
    what = "give a URDF" if known is None else f"{known.name} is not read yet; {known.remedy}"
    raise DescriptionError(
        f"the root element is <{tag}>, not <robot>; {what}", file=source.file, line=line_of(root)
    )
