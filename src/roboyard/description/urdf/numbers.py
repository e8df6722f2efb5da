"""Parse the numbers in XML attributes: leniently where the meaning is plain, and only there."""

from __future__ import annotations

import math
import re
import xml.etree.ElementTree as ET
from collections.abc import Sequence
from typing import Literal, cast

from roboyard._lazy import lazy_pattern
from roboyard._records import dataclass
from roboyard.description.model import INERTIA_KEYS, Quaternion
from roboyard.description.urdf.xml import line_of

FaultKind = Literal["sloppy", "wrong", "not finite", "huge", "xacro"]
"""`sloppy` numbers are read; all others are not."""

_PREFIX = re.compile(r"[-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]+)?")
_NOT_FINITE = lazy_pattern(r"[-+]?(?:nan|inf(?:inity)?)", re.IGNORECASE)
_OPTENV = lazy_pattern(r"\$\(\s*optenv\s")
_XACRO = lazy_pattern(r"\$\{|\$\(")
_STRAY = lazy_pattern(r"[.;]*")
"""Characters after a number that mean nothing. Any others (`0x10`, `1d5`, `10mm`) may have a meaning."""
LARGEST = 1e9
"""In SI units; no robot has a larger number, and MuJoCo reports a diverged simulation from 1e10."""
BEYOND = "which is beyond any robot"
UNIT_TOLERANCE = 1e-3
"""Deviation from length 1 up to which an axis or a quaternion is scaled to length 1 without a note."""
_UNBOUNDED = {
    ("axis", "xyz"),  # directions, of any length
    ("origin", "quat_xyzw"),
    ("plane", "normal"),
    *((tag, key) for tag in ("limit", "stiffness", "damping") for key in ("lower", "upper", "value")),
    ("limit", "effort"),
    ("limit", "velocity"),
    ("mass", "value"),  # kept as written; the audit checks them
    *(("inertia", key) for key in INERTIA_KEYS),
}
"""Element and attribute of numbers of any size; a huge limit is the usual way to write no limit."""
_SHOWN = 60
"""Characters of an attribute that a message repeats."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Location:
    """An element that a finding points at."""

    who: str
    """As in `joint "elbow"`."""
    line: int | None
    """1-based line in the file."""
    link_names: tuple[str, ...] = ()
    """Links that a picture of the finding shows."""


@dataclass(frozen=True, kw_only=True, slots=True)
class NumberFault:
    """A number that could not be read, or only by being lenient."""

    element: ET.Element
    key: str
    """Name of the attribute."""
    at: Location
    kind: FaultKind
    message: str
    remedy: str = ""
    """Empty for sloppy numbers."""

    @property
    def is_error(self) -> bool:
        """True where the number could not be read."""
        return self.kind != "sloppy"

    @property
    def text(self) -> str:
        """Message and remedy in one sentence."""
        return f"{self.message}; {self.remedy}" if self.remedy else self.message


class NumberParser:
    """Parses numbers and records their faults, in the order in which they are read.

    Args:
        words_are_zero: read every word among numbers as 0, as C's strtod does, instead of recording a fault.
    """

    def __init__(self, *, words_are_zero: bool = False) -> None:
        self.words_are_zero = words_are_zero
        self.faults: list[NumberFault] = []
        self._who = ""
        self._link_names: tuple[str, ...] = ()

    def enter(self, who: str, *link_names: str) -> None:
        """Record the faults that follow for this element, as in `joint "elbow"`."""
        self._who, self._link_names = who, link_names

    def record(self, element: ET.Element, key: str, kind: FaultKind, message: str, remedy: str = "") -> None:
        """Record a fault of an attribute."""
        at = Location(who=self._who, line=line_of(element), link_names=self._link_names)
        self.faults.append(
            NumberFault(element=element, key=key, at=at, kind=kind, message=message, remedy=remedy)
        )

    def number(self, element: ET.Element | None, key: str) -> float | None:
        """Return one attribute as a finite number; None where it is absent, blank or wrong (recorded)."""
        values = self.vector(element, key, 1)
        return None if values is None else values[0]

    def vector(self, element: ET.Element | None, key: str, size: int) -> tuple[float, ...] | None:
        """Return one attribute as `size` finite numbers; None where absent, blank or wrong (recorded)."""
        text = None if element is None else element.get(key)
        if element is None or text is None:
            return None
        if not text.strip():
            self.record(element, key, "sloppy", f'<{element.tag} {key}=""> is blank; read as not given')
            return None
        values = self._bounded(text, size, element, key)
        if values is None or len(values) == size:
            return values
        shown = _shown(element, key)
        if len(values) < size:
            remedy = f"give {size} numbers" if size > 1 else "give one number"
            self.record(element, key, "wrong", f"{shown} holds {len(values)} of {size} numbers", remedy)
            return None
        read = f"the first {size} are taken" if size > 1 else "the first one is taken"
        self.record(element, key, "sloppy", f"{shown} holds {len(values)} numbers; {read}")
        return values[:size]

    def _bounded(self, text: str, size: int, element: ET.Element, key: str) -> tuple[float, ...] | None:
        """The numbers of a text, none of them beyond any robot."""
        values = self._numbers(text, size, element, key)
        if values is None or self.words_are_zero or (element.tag, key) in _UNBOUNDED:
            return values
        largest = max(values, key=abs, default=0.0)
        if abs(largest) <= LARGEST:
            return values
        message = f"{_shown(element, key)} holds {largest:g}, {BEYOND}"
        self.record(element, key, "huge", message, "give it in metres, kilograms and radians")
        return None

    def _numbers(self, text: str, size: int, element: ET.Element, key: str) -> tuple[float, ...] | None:
        """The numbers of a text that is not blank, however many they are."""
        if self.words_are_zero:
            return tuple(_leading(token) or 0.0 for token in text.split())
        default = _optenv_default(text.strip())
        if default is not None:
            message = f"{_shown(element, key)} was left by xacro; its default is taken"
            self.record(element, key, "sloppy", message)
            text = default
        elif _XACRO.search(text):
            message = f"{_shown(element, key)} is unexpanded xacro"
            self.record(element, key, "xacro", message, "run: xacro FILE.xacro > FILE.urdf")
            return None
        exact = tuple(_exact(token) for token in text.split())
        if None not in exact:
            return cast(tuple[float, ...], exact)
        return self._lenient(text, size, element, key)

    def _lenient(self, text: str, size: int, element: ET.Element, key: str) -> tuple[float, ...] | None:
        """The numbers of a text with commas between them ("0.1,0,0.2") or a stray character ("0.07,")."""
        shown = _shown(element, key)
        tokens = text.replace(",", " ").split()
        values = [_prefix(token) for token in tokens]
        if not values or None in values:
            wrong = next((token for token, value in zip(tokens, values, strict=True) if value is None), text)
            too_large = _NOT_FINITE.fullmatch(wrong) or _PREFIX.fullmatch(wrong.rstrip(".;"))
            kind: FaultKind = "not finite" if too_large else "wrong"
            what = "is not finite" if too_large else "is not a number"
            message = f"{shown}: {_clipped(wrong)!r} {what}"
            self.record(element, key, kind, message, "give a finite number")
            return None
        read = cast(list[float], values)
        if "," in text and len(read) > size:  # separators, or decimal commas?
            few = f"{size} numbers" if size > 1 else "one number"
            message = f"{shown}: commas make it {len(read)} numbers"
            self.record(element, key, "wrong", message, f"give {few} with decimal points")
            return None
        plain = " ".join(f"{value:g}" for value in read)
        self.record(element, key, "sloppy", f"{shown} is sloppy; read as {plain}")
        return tuple(read)


def _optenv_default(text: str) -> str | None:
    """The default in `$(optenv NAME default)`; None for any other text."""
    if not text.endswith(")") or not _OPTENV.match(text):
        return None
    words = text[2:-1].split(None, 2)
    return words[2].strip() if len(words) == 3 else "" if len(words) == 2 else None


def unit_quaternion(quaternion: Sequence[float]) -> Quaternion | None:
    """Return (4,) numbers scaled to length 1, however large they are; None for a length under 1e-12."""
    largest = max(map(abs, quaternion))
    if largest < 1e-12:
        return None
    scaled = [number / largest for number in quaternion]
    length = math.hypot(*scaled)
    return cast(Quaternion, tuple(number / length for number in scaled))


def _shown(element: ET.Element, key: str) -> str:
    """The attribute as a message repeats it."""
    return f'<{element.tag} {key}="{_clipped(" ".join((element.get(key) or "").split()))}">'


def _clipped(text: str) -> str:
    return text if len(text) <= _SHOWN else text[: _SHOWN - 3] + "..."


def _exact(token: str) -> float | None:
    """The number that a token is; None where it is anything else."""
    value = float(token) if _PREFIX.fullmatch(token) else math.nan
    return value if math.isfinite(value) else None


def _prefix(token: str) -> float | None:
    """The number that a token starts with, where only meaningless characters follow it."""
    match = _PREFIX.match(token)
    return _leading(token) if match and _STRAY.fullmatch(token, match.end()) else None


def _leading(token: str) -> float | None:
    """The number that a token starts with, with any text after it, as C's strtod reads it."""
    match = _PREFIX.match(token)
    value = float(match[0]) if match else math.nan
    return value if math.isfinite(value) else None
