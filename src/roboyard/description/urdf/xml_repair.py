"""Repair XML that is not well-formed but whose meaning is plain, as the tolerant parsers of robot tools do.

Each repair takes the text and returns the repaired text and a note. Repairs never add or remove a
line break, so that line numbers stay those of the file, and change nothing in well-formed text.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from contextlib import suppress
from xml.parsers import expat

from roboyard._lazy import lazy_pattern

ZERO_NOTE = "zero byte after the end of the root element removed, and all behind it"
TEXT_NOTE = "text after the end of the root element removed"
CLOSING_TAG_NOTE = "closing tag after the end of the root element removed, and all behind it"
ELEMENTS_NOTE = "elements after the end of the root element ignored"

Repair = Callable[[str], tuple[str, str]]

_AMPERSAND = lazy_pattern(r"&(?!(?:amp|lt|gt|quot|apos|#[0-9]+|#x[0-9a-fA-F]+);)")
_START_TAG = lazy_pattern(r"<[A-Za-z_][^\s/<>]*+(?:\s+[^\s=<>/]+\s*=\s*(?:\"[^\"<]*\"|'[^'<]*'))+\s*/?>")
_ATTRIBUTE = lazy_pattern(r"\s+([^\s=<>/]+)\s*=\s*(?:\"[^\"<]*\"|'[^'<]*')")
# what XML 1.0 forbids anywhere in a document
_FORBIDDEN = lazy_pattern("[\x00-\x08\x0b\x0c\x0e-\x1f\ufffe\uffff\ud800-\udfff]")


def decode(data: bytes) -> tuple[str, str]:
    """Text of a file in its declared encoding, or else UTF-8, or else Windows-1252, and a note if guessed."""
    for mark, encoding in ((b"\xef\xbb\xbf", "utf-8-sig"), (b"\xff\xfe", "utf-16"), (b"\xfe\xff", "utf-16")):
        if data.startswith(mark):
            return data.decode(encoding, "replace"), ""
    try:
        return data.decode("utf-8"), ""
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        note = f"line {line}: bytes that are not valid UTF-8; read as Windows-1252"
        return data.decode("cp1252", "replace"), note


def _blank(text: str) -> str:
    """The line breaks of `text` alone."""
    return "".join(re.findall(r"\r\n|\n|\r", text))


def _nothing(part: str) -> str:
    return ""


def _replaced(text: str, start: str, end: str, change: Callable[[str], str], count: int = -1) -> str:
    """Text in which each part from `start` to the next `end` is changed; reads the text once."""
    done: list[str] = []
    at = 0
    while count:
        first = text.find(start, at)
        last = -1 if first < 0 else text.find(end, first + len(start))
        if last < 0:
            break
        done += [text[at:first], change(text[first : last + len(end)])]
        at = last + len(end)
        count -= 1
    return "".join(done) + text[at:]


def leading_junk(text: str) -> tuple[str, str]:
    """Text before the XML declaration or the root element; the declaration itself is then not needed."""
    start = re.search(r"<\?xml\b|<!--|<!DOCTYPE|<[A-Za-z_]", text)
    if start is None or start.start() == 0:
        return text, ""
    head, rest = text[: start.start()], text[start.start() :]
    what = "blank space" if not head.strip() else "text"
    if rest.startswith("<?xml"):
        rest = _replaced(rest, "<?xml", "?>", _blank, count=1)
        return _blank(head) + rest, f"{what} before the XML declaration removed"
    return _blank(head) + rest, f"{what} before the root element removed"


def misplaced_declaration(text: str) -> tuple[str, str]:
    """XML declarations anywhere but at the very start."""
    repaired = text[:1] + _replaced(text[1:], "<?xml", "?>", _blank)
    return repaired, "XML declaration that is not at the start removed"


def comments(text: str) -> tuple[str, str]:
    """`--` inside comments."""

    def repair(comment: str) -> str:
        inside = comment[4:-3]
        return f"<!--{_blank(inside)}-->" if "--" in inside or inside.endswith("-") else comment

    return _replaced(text, "<!--", "-->", repair), 'comments that hold "--" removed'


def trailing_junk(text: str) -> tuple[str, str]:
    """Content behind the root element: text alone, a closing tag too many, or well-formed elements."""
    end = _root_end(text)
    if end is None:
        return text, ""
    behind, zero, _ = text[end:].partition("\0")  # at a zero byte the text ends, as for programs in C
    rest = _replaced(_replaced(behind, "<!--", "-->", _nothing), "<?", "?>", _nothing).strip()
    if not rest:
        return (text[:end] + behind, ZERO_NOTE) if zero else (text, "")
    if rest.startswith("</"):
        note = CLOSING_TAG_NOTE
    elif rest.startswith("<"):
        if _root_end(f"<all>{behind}</all>") is None:
            return text, ""
        note = ELEMENTS_NOTE
    elif re.search(r"<[A-Za-z_]", rest):
        return text, ""
    else:
        note = TEXT_NOTE
    return text[:end] + _blank(text[end:]), note


def _root_end(text: str) -> int | None:
    """Index behind the root element, or None where it is not well-formed."""
    data, found, depth, content = text.encode("utf-8", "replace"), [], 0, 0
    parser = expat.ParserCreate("utf-8")

    def start(*_: object) -> None:
        nonlocal depth, content
        depth += 1
        content += depth > 1

    def characters(_: str) -> None:
        nonlocal content
        content += 1

    def end(_: str) -> None:
        nonlocal depth
        depth -= 1
        if depth == 0 and not found:
            at = parser.CurrentByteIndex  # of an empty element's tag the end, of a closing tag the start
            closed = not content and data[at - 2 : at] == b"/>"
            found.append(at if closed else data.index(b">", at) + 1)

    parser.StartElementHandler, parser.EndElementHandler = start, end
    parser.CharacterDataHandler = characters
    with suppress(expat.ExpatError):  # behind the root
        parser.Parse(data, True)
    return len(data[: found[0]].decode()) if found else None


def control_characters(text: str) -> tuple[str, str]:
    """Characters that XML forbids; the file is refused where there are too many for a text file."""
    found = _FORBIDDEN.findall(text)
    if len(found) > 16:
        return text, ""
    return _FORBIDDEN.sub("", text), f"{len(found)} control characters removed"


def ampersands(text: str) -> tuple[str, str]:
    """`&` that starts no entity known to XML."""
    return _AMPERSAND.sub("&amp;", text), 'bare "&" read as itself'


def duplicate_attributes(text: str) -> tuple[str, str]:
    """Attributes given twice in one tag: the first one counts."""
    names: list[str] = []
    counted, line = 0, 1

    def repair_tag(tag: re.Match[str]) -> str:
        nonlocal counted, line
        seen: set[str] = set()
        line += text.count("\n", counted, tag.start())
        counted = tag.start()

        def keep_first(attribute: re.Match[str]) -> str:
            if attribute[1] in seen:
                names.append(f"line {line}: {attribute[1]}")
                return _blank(attribute[0])
            seen.add(attribute[1])
            return attribute[0]

        return _ATTRIBUTE.sub(keep_first, tag[0])

    repaired = _START_TAG.sub(repair_tag, text)
    return repaired, f"attributes given twice, the first one counts ({', '.join(names[:4])})"


REPAIRS: tuple[Repair, ...] = (
    leading_junk,
    misplaced_declaration,
    trailing_junk,
    comments,
    control_characters,
    ampersands,
    duplicate_attributes,
)
