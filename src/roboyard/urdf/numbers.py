"""Numbers in XML attributes, read as forgivingly as C's strtod reads them, and no more."""

from __future__ import annotations

import math
import re
import xml.etree.ElementTree as ET

from roboyard.urdf.problems import Problems

_PREFIX = re.compile(r"[-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]+)?")
_NOT_FINITE = re.compile(r"[-+]?(?:nan|inf(?:inity)?)", re.IGNORECASE)
_OPTENV = re.compile(r"^\$\(\s*optenv\s+\S+\s*(.*?)\s*\)$", re.S)
_XACRO = re.compile(r"\$\{|\$\(")


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
    values = _read(text, element, key, who, problems)
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
    values = _read(text, element, key, who, problems)
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
    text = " ".join((element.get(key) or "").split())
    return f'<{element.tag} {key}="{text if len(text) <= 60 else text[:57] + "..."}">'


def _read(text: str, element: ET.Element, key: str, who: str, problems: Problems) -> tuple[float, ...] | None:
    if problems.words_are_zero:
        return tuple(_prefix(token) or 0.0 for token in text.split())
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
        infinite = _NOT_FINITE.match(wrong) or wrong.lstrip("+-")[:1].isdigit()
        what = "is not finite" if infinite else "is not a number"
        problems.error(element, who, f"{_shown(element, key)}: {wrong!r} {what}; give a finite number")
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
    match = _PREFIX.match(token)
    value = float(match[0]) if match else math.nan
    return value if math.isfinite(value) else None
