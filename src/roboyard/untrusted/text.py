"""Text from any source, for a terminal: control characters are shown instead of sent."""

from __future__ import annotations

import re

_CONTROL = re.compile(
    "[\x00-\x08\x0b-\x1f\x7f-\x9f\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069\ufeff\ud800-\udfff]"
)
_CONTROL_OR_BREAK = re.compile(
    "[\x00-\x1f\x7f-\x9f\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069\ufeff\ud800-\udfff]"
)


def printable(text: str) -> str:
    r"""Return text whose control characters are escaped (`\x1b`, `\u202e`); line breaks and tabs stay."""
    return _CONTROL.sub(_escaped, text)


def one_line(text: str) -> str:
    r"""Return text in one line: as `printable`, line breaks and tabs escaped as well (`\n`)."""
    return _CONTROL_OR_BREAK.sub(_escaped, text)


def _escaped(match: re.Match[str]) -> str:
    return ascii(match[0])[1:-1]
