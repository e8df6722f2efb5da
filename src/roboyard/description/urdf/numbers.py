"""Numbers in XML attributes, read as forgivingly as their meaning is plain, and no more."""

from __future__ import annotations

import math
import re
import xml.etree.ElementTree as ET

from roboyard.description.model import INERTIA_KEYS
from roboyard.description.urdf.problems import Problems

_PREFIX = re.compile(r"[-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]+)?")
_NOT_FINITE = re.compile(r"[-+]?(?:nan|inf(?:inity)?)", re.IGNORECASE)
_OPTENV = re.compile(r"^\$\(\s*optenv\s+\S+\s*(.*?)\s*\)$", re.S)
_XACRO = re.compile(r"\$\{|\$\(")
_STRAY = re.compile(r"[.;]*")
"""What may stand behind a number and mean nothing. Anything else (`0x10`, `1d5`, `10mm`) may mean much."""
LARGEST = 1e9
"""In SI units; nothing of a robot is larger, and MuJoCo takes 1e10 for a simulation that exploded."""
BEYOND = "which is beyond any robot"
_ENDLESS = {
    ("axis", "xyz"),  # directions, of any length
    ("origin", "quat_xyzw"),
    ("plane", "normal"),
    *((tag, key) for tag in ("limit", "stiffness", "damping") for key in ("lower", "upper", "value")),
    ("limit", "effort"),
    ("limit", "velocity"),
    ("mass", "value"),  # kept as written; the audit judges them
    *(("inertia", key) for key in INERTIA_KEYS),
}
"""Element and attribute of numbers of any size; a huge limit is the custom for none."""
_SHOWN = 60
"""Characters of an attribute that a message repeats."""


class _NotANumber(ValueError):
    pass


def read_number(element: ET.Element, key: str, who: str, problems: Problems) -> float | None:
    """One attribute as a finite number; None where it is absent, blank, or wrong (and reported)."""
    text = element.get(key)
    if text is None:
        return None
    if not text.strip():
        problems.note(element, who, f'<{element.tag} {key}=""> is blank; read as not given')
        return None
    values = _read(text, 1, element, key, who, problems)
    if values is None:
        return None
    if len(values) != 1:
        problems.note(
            element, who, f"{_shown(element, key)} holds {len(values)} numbers; the first one is taken"
        )
    return values[0]


def read_vector(
    element: ET.Element, key: str, size: int, who: str, problems: Problems
) -> tuple[float, ...] | None:
    """One attribute as `size` finite numbers; None where it is absent, blank, or wrong (and reported)."""
    text = element.get(key)
    if text is None:
        return None
    if not text.strip():
        problems.note(element, who, f'<{element.tag} {key}=""> is blank; read as not given')
        return None
    values = _read(text, size, element, key, who, problems)
    if values is None:
        return None
    if len(values) < size:
        problems.error(
            element, who, f"{_shown(element, key)} holds {len(values)} of {size} numbers; give {size} numbers"
        )
        return None
    if len(values) > size:
        problems.note(
            element, who, f"{_shown(element, key)} holds {len(values)} numbers; the first {size} are taken"
        )
    return values[:size]


def _shown(element: ET.Element, key: str) -> str:
    return f'<{element.tag} {key}="{_clipped(" ".join((element.get(key) or "").split()))}">'


def _clipped(text: str) -> str:
    return text if len(text) <= _SHOWN else text[: _SHOWN - 3] + "..."


def _read(
    text: str, size: int, element: ET.Element, key: str, who: str, problems: Problems
) -> tuple[float, ...] | None:
    values = _read_any(text, size, element, key, who, problems)
    if values is None or problems.words_are_zero or (element.tag, key) in _ENDLESS:
        return values
    largest = max(values, key=abs, default=0.0)
    if abs(largest) <= LARGEST:
        return values
    message = f"{_shown(element, key)} holds {largest:g}, {BEYOND}; give it in metres, kilograms and radians"
    problems.error(element, who, message)
    return None


def _read_any(
    text: str, size: int, element: ET.Element, key: str, who: str, problems: Problems
) -> tuple[float, ...] | None:
    if problems.words_are_zero:
        return tuple(_leading(token) or 0.0 for token in text.split())
    default = _OPTENV.match(text.strip())
    if default is not None:
        problems.note(element, who, f"{_shown(element, key)} was left by xacro; its default is taken")
        text = default[1]
    elif _XACRO.search(text):
        problems.error(
            element, who, f"{_shown(element, key)} is unexpanded xacro; run: xacro FILE.xacro > FILE.urdf"
        )
        return None
    tokens = text.split()
    try:
        return tuple(_exact(token) for token in tokens)
    except _NotANumber:
        pass
    # commas between numbers ("0.1,0,0.2") separate them; one at the end of a number ("0.07,") is ignored
    tokens = text.replace(",", " ").split()
    values = [_prefix(token) for token in tokens]
    if not values or any(value is None for value in values):
        wrong = next((token for token, value in zip(tokens, values, strict=True) if value is None), text)
        number = _PREFIX.fullmatch(wrong.rstrip(".;"))
        infinite = _NOT_FINITE.fullmatch(wrong) or number
        what = "is not finite" if infinite else "is not a number"
        said = repr(_clipped(wrong))
        problems.error(element, who, f"{_shown(element, key)}: {said} {what}; give a finite number")
        return None
    if "," in text and len(values) > size:  # as many numbers as are wanted, or decimal commas?
        few = f"{size} numbers" if size > 1 else "one number"
        problems.error(
            element,
            who,
            f"{_shown(element, key)}: commas make it {len(values)} numbers; give {few} with decimal points",
        )
        return None
    read = tuple(value for value in values if value is not None)
    shown = " ".join(f"{value:g}" for value in read)
    problems.note(element, who, f"{_shown(element, key)} is sloppy; read as {shown}")
    return read


def _exact(token: str) -> float:
    match = _PREFIX.fullmatch(token)
    value = float(token) if match else math.nan
    if not math.isfinite(value):
        raise _NotANumber(token)
    return value


def _prefix(token: str) -> float | None:
    """The number that a token starts with, where nothing that may mean anything follows it."""
    match = _PREFIX.match(token)
    return _leading(token) if match and _STRAY.fullmatch(token, match.end()) else None


def _leading(token: str) -> float | None:
    """The number that a token starts with, whatever follows it, as C's strtod reads it."""
    match = _PREFIX.match(token)
    value = float(match[0]) if match else math.nan
    return value if math.isfinite(value) else None
