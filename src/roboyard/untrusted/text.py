"""Text from any source, for a terminal: control characters are shown instead of sent."""

from __future__ import annotations

import json
import re
import sys

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


def say(*lines: str, to_errors: bool = False) -> None:
    """Print lines, each as `one_line`, to standard output or standard error."""
    stream = sys.stderr if to_errors else sys.stdout
    if stream is not None and lines:  # None where the program was started without the stream
        print(*map(one_line, lines), sep="\n", file=stream, flush=to_errors)


def json_text(data: object) -> str:
    """Return indented JSON whose characters can be printed on any terminal."""
    text = json.dumps(data, indent=2, ensure_ascii=False)
    return _CONTROL.sub(lambda match: f"\\u{ord(match[0]):04x}", text)


def _escaped(match: re.Match[str]) -> str:
    return ascii(match[0])[1:-1]
