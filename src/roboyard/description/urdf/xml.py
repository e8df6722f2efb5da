"""Read an untrusted XML file into elements with line numbers.

No DTD, no entity of the file's own, nothing external; size, depth and number of elements are bounded, and no
step recurses. Prefixes are kept as written (`xacro:macro`), declared or not. Files that vendors ship although
they are not well-formed are corrected where the meaning is plain (see `xml_repair`), with a note each.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from pathlib import Path
from xml.parsers import expat

from roboyard._lazy import paused_collection
from roboyard.description.urdf.undeclared_world import with_declared_world
from roboyard.description.urdf.xacro_calls import without_left_calls
from roboyard.description.urdf.xml_repair import REPAIRS, decode
from roboyard.errors import DescriptionError
from roboyard.untrusted.files import read_file

MAX_BYTES = 64 * 1024 * 1024
MAX_DEPTH = 100
MAX_ELEMENTS = 500_000


class OmittedNote(str):
    """A note on what a file of another format holds and a robot description does not."""

    __slots__ = ()


class LocatedElement(ET.Element):
    """An element that remembers the line of its start tag."""

    __slots__ = ("line",)

    line: int | None


def line_of(element: ET.Element) -> int | None:
    """1-based line of an element's start tag; None for an element made in memory."""
    return getattr(element, "line", None)


def is_xacro(element: ET.Element) -> bool:
    """Return whether an element is of xacro, with or without its namespace."""
    tag = element.tag
    return isinstance(tag, str) and (
        tag.startswith("xacro:") or (tag.startswith("{") and "xacro" in tag.partition("}")[0])
    )


def xacro_colours(root: ET.Element) -> list[ET.Element]:
    """Return the unexpanded macros without arguments of visual shapes with a geometry: their colours."""
    return [
        child
        for visual in root.iter("visual")
        if visual.find("geometry") is not None
        for child in visual
        if is_xacro(child) and not child.attrib and not len(child)
    ]


def copy_tree(root: ET.Element) -> ET.Element:
    """Return a deep copy of a tree, with the lines of its elements; does not recurse."""
    copied = _copy_element(root)
    stack = [(root, copied)]
    while stack:
        original, copy = stack.pop()
        for child in original:
            new = _copy_element(child)
            copy.append(new)
            stack.append((child, new))
    return copied


def _copy_element(element: ET.Element) -> ET.Element:
    """A copy without children; comments keep their tag, which is a function."""
    copy = LocatedElement(element.tag, dict(element.attrib))
    copy.text, copy.tail, copy.line = element.text, element.tail, line_of(element)
    return copy


def read_xml(source: Path | str, *, max_depth: int = MAX_DEPTH) -> tuple[ET.Element, tuple[str, ...]]:
    """Return the root element of a file (`Path`) or of XML text (`str`), and notes on each correction.

    Args:
        source: a file or text.
        max_depth: levels of elements that are accepted.

    Raises:
        DescriptionError: the file cannot be read, is no XML, declares a DTD or entities, or is beyond the
            bounds of this module (64 MiB, 100 levels, 500,000 elements).
    """
    file = source if isinstance(source, Path) else None
    data = _read_bytes(source) if isinstance(source, Path) else source.encode("utf-8", "surrogatepass")
    if len(data) > MAX_BYTES:
        raise DescriptionError(
            f"{len(data) / 2**20:.0f} MiB is too large for a robot description (at most 64 MiB)", file=file
        )
    if not data.strip():
        raise DescriptionError(
            f"the file is empty ({len(data)} bytes); a URDF starts with a <robot> element", file=file
        )
    try:
        root = _parse(data, file, max_depth)
        return root, _corrected(root, data)
    except _NotWellFormed as error:
        repaired = _repair(data, file, max_depth)
        if repaired is None:
            raise DescriptionError(
                f"not well-formed XML, column {error.column}: {error.reason}; correct the file at this place",
                file=file,
                line=error.line,
            ) from None
        return repaired


def _corrected(root: ET.Element, data: bytes) -> tuple[str, ...]:
    """Correct, in place, what has one meaning only; a note on each correction."""
    return (*without_left_calls(root, data), *with_declared_world(root))


class _NotWellFormed(Exception):
    def __init__(self, reason: str, line: int, column: int) -> None:
        super().__init__(reason)
        self.reason, self.line, self.column = reason, line, column


def _read_bytes(file: Path) -> bytes:
    try:
        return read_file(file, MAX_BYTES)
    except IsADirectoryError:
        raise DescriptionError(f"{file} is a folder; give the URDF file in it", file=file) from None
    except FileNotFoundError:
        raise DescriptionError(f"no such file in {file.parent}; check the path", file=file) from None
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise DescriptionError(f"cannot be read: {reason}", file=file) from None


def _repair(data: bytes, file: Path | None, max_depth: int) -> tuple[ET.Element, tuple[str, ...]] | None:
    """Parse again after each repair that changes the text; None where none of them helps."""
    text, note = decode(data)
    notes = [note] if note else []
    for repair in (None, *REPAIRS):
        if repair is not None:
            repaired, what = repair(text)
            if repaired == text:
                continue
            text = repaired
            notes.append(what)
        try:
            root = _parse(text.encode("utf-8", "replace"), file, max_depth, "utf-8")
            return root, (*notes, *_corrected(root, data))
        except _NotWellFormed:
            continue
    return None


def _parse(data: bytes, file: Path | None, max_depth: int, encoding: str | None = None) -> ET.Element:
    builder = _Builder(file, encoding, max_depth)
    return builder.parse(data)


class _Builder:
    """Expat's events turned into located elements, within bounds."""

    def __init__(self, file: Path | None, encoding: str | None, max_depth: int) -> None:
        self.file = file
        self.max_depth = max_depth
        self.root: LocatedElement | None = None
        self.open: list[LocatedElement] = []
        self.last: LocatedElement | None = None
        self.count = 0
        self.chunks: list[str] = []
        parser = expat.ParserCreate(encoding)
        parser.buffer_text = True
        parser.SetParamEntityParsing(expat.XML_PARAM_ENTITY_PARSING_NEVER)
        parser.StartElementHandler = self.start
        parser.EndElementHandler = self.end
        parser.CharacterDataHandler = self.chunks.append
        parser.StartDoctypeDeclHandler = self.refuse_doctype
        parser.EntityDeclHandler = self.refuse_doctype
        parser.ExternalEntityRefHandler = self.refuse_doctype
        self.parser = parser

    def parse(self, data: bytes) -> ET.Element:
        try:
            with paused_collection(makes_old=False):
                self.parser.Parse(data, True)
        except expat.ExpatError as error:
            reason = expat.ErrorString(error.code)
            raise _NotWellFormed(reason, error.lineno, error.offset + 1) from None
        except (LookupError, ValueError) as error:  # an encoding Python does not know, or cannot map
            raise _NotWellFormed(f"encoding: {error}", 1, 1) from None
        if self.root is None:
            raise _NotWellFormed("no element found", 1, 1)
        return self.root

    def start(self, tag: str, attributes: dict[str, str]) -> None:
        self.flush()
        element = LocatedElement(tag, attributes)
        element.line = self.parser.CurrentLineNumber
        self.count += 1
        if self.count > MAX_ELEMENTS:
            raise self.error(f"more than {MAX_ELEMENTS} elements; this is no robot description")
        if len(self.open) >= self.max_depth:
            raise self.error(f"elements nested more than {self.max_depth} deep; this is no robot description")
        if self.open:
            self.open[-1].append(element)
        else:
            self.root = element
        self.open.append(element)
        self.last = None

    def end(self, tag: str) -> None:
        self.flush()
        self.last = self.open.pop()

    def flush(self) -> None:
        """Assign the text read since the last tag to its element."""
        if not self.chunks:
            return
        text = "".join(self.chunks)
        self.chunks.clear()
        if self.last is not None:
            self.last.tail = text
        elif self.open:
            self.open[-1].text = text

    def refuse_doctype(self, *_: object) -> int:
        raise self.error("a DOCTYPE (DTD, entity declarations) is not accepted; remove it")

    def error(self, message: str) -> DescriptionError:
        return DescriptionError(message, file=self.file, line=self.parser.CurrentLineNumber)
