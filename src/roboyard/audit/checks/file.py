"""Faults of the file as a whole, after which no other check runs."""

from __future__ import annotations

from roboyard.audit.findings import ERROR, INFO
from roboyard.audit.registry import Fault, Faults, check
from roboyard.description.urdf.numbers import Location
from roboyard.description.urdf.parse import UrdfElements
from roboyard.description.urdf.xml import OmittedNote

MAX_LINKS = 10_000
_UNREADABLE = ("no such file in ", "is a folder", "cannot be read:", "too large for a robot description")
_UNSAFE = ("DOCTYPE", "nested more than", "elements; this is no robot")
_SYNTAX = ("not well-formed", "the file is empty")


def _refusal(urdf: UrdfElements, *words: str, others: bool = False) -> Faults:
    """The reader's refusal as a fault, where it contains one of the texts; or where it contains none."""
    error = urdf.refusal
    if error is None:
        return
    text = error.problems[0]
    if any(word in text for word in words) == others:
        return
    where = f"{urdf.path.name}:{error.line}: " if error.line else f"{urdf.path.name}: "
    message, _, remedy = text.removeprefix(where).rpartition("; ")
    yield Fault(message=message or remedy, remedy=remedy if message else None, line=error.line)


@check(
    "file-unreadable",
    ERROR,
    remedy="give a URDF file of at most 64 MiB that can be read",
    example="(a path that does not exist)",
)
def file_unreadable(urdf: UrdfElements) -> Faults:
    """The file does not exist, is a folder, may not be read or is larger than 64 MiB."""
    yield from _refusal(urdf, *_UNREADABLE)


@check(
    "xml-unsafe",
    ERROR,
    remedy="remove the DOCTYPE; a URDF needs none",
    example='<!DOCTYPE robot [<!ENTITY x SYSTEM "other.txt">]>',
)
def xml_unsafe(urdf: UrdfElements) -> Faults:
    """The file declares a DTD or entities, or is nested or long beyond any robot description."""
    yield from _refusal(urdf, *_UNSAFE)


@check(
    "xml-syntax",
    ERROR,
    remedy="correct the XML at this line",
    example='<robot name="arm"><link name="base"></robot>',
)
def xml_syntax(urdf: UrdfElements) -> Faults:
    """The file is not well-formed XML, and its meaning is not clear."""
    yield from _refusal(urdf, *_SYNTAX)


@check(
    "xml-tolerated",
    INFO,
    remedy="write the file as plain UTF-8 XML",
    fixable=True,
    example='(a blank line before <?xml version="1.0"?>)',
)
def xml_tolerated(urdf: UrdfElements) -> Faults:
    """The file is not well-formed XML, but can be read only one way (blank lines before the declaration)."""
    for note in urdf.xml_notes:
        if isinstance(note, OmittedNote):
            continue
        yield Fault(message=note if note.startswith("<") else f"not well-formed XML: {note}")


@check(
    "format-refused",
    ERROR,
    remedy="correct the file at this place",
    example='<sdf version="1.7"/>',
)
def format_refused(urdf: UrdfElements) -> Faults:
    """A xacro, MJCF, SDF or USD file cannot be turned into a robot description."""
    yield from _refusal(urdf, *_UNREADABLE, *_UNSAFE, *_SYNTAX, others=True)


@check(
    "format-omitted",
    INFO,
    remedy="nothing to do where the robot does not depend on it",
    example="(an MJCF file with a tendon)",
)
def format_omitted(urdf: UrdfElements) -> Faults:
    """A file of another format holds something that a robot description does not."""
    for note in urdf.xml_notes:
        if isinstance(note, OmittedNote):
            yield Fault(message=str(note))


@check(
    "root-not-robot",
    ERROR,
    remedy="give a URDF, whose root element is <robot>",
    example='<model name="arm">...</model>',
)
def root_not_robot(urdf: UrdfElements) -> Faults:
    """The root element is not `<robot>`."""
    if urdf.root.tag != "robot":
        tag = str(urdf.root.tag)
        place = Location(who="", line=getattr(urdf.root, "line", None))
        yield Fault(at=place, message=f"the root element is <{tag[:60]}>, not <robot>")


@check(
    "too-many-links",
    ERROR,
    remedy="split the description; simulators end far below this",
    example="(100,000 links in a chain)",
)
def too_many_links(urdf: UrdfElements) -> Faults:
    """There are more than 10,000 links or joints."""
    for tag in ("link", "joint"):
        count = sum(1 for _ in urdf.root.iterfind(tag))
        if count > MAX_LINKS:
            yield Fault(message=f"{count} <{tag}> elements are more than any robot has (at most {MAX_LINKS})")
