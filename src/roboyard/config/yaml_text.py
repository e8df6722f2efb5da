"""Write readable YAML: short numbers, vectors in one line, comments beside the entries of a vector."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import yaml

if TYPE_CHECKING:
    _SafeDumper = yaml.SafeDumper
else:  # libyaml writes the same text several times faster
    _SafeDumper = getattr(yaml, "CSafeDumper", yaml.SafeDumper)

_DIGITS = 6
"""Significant digits of a number: micrometres where lengths are in metres."""


class Column(list):
    """A list that is written with one entry per line."""


class _Dumper(_SafeDumper):
    def ignore_aliases(self, data: Any) -> bool:
        return True


def _list(dumper: _Dumper, data: Sequence[Any]) -> yaml.Node:
    is_vector = all(isinstance(item, int | float) for item in data)
    return dumper.represent_sequence("tag:yaml.org,2002:seq", data, flow_style=is_vector)


def _column(dumper: _Dumper, data: Sequence[Any]) -> yaml.Node:
    return dumper.represent_sequence("tag:yaml.org,2002:seq", data, flow_style=not data)


def _dict(dumper: _Dumper, data: Mapping[str, Any]) -> yaml.Node:
    return dumper.represent_mapping("tag:yaml.org,2002:map", data, flow_style=not data)


def _float(dumper: _Dumper, data: float) -> yaml.Node:
    return dumper.represent_scalar("tag:yaml.org,2002:float", number(data))


_Dumper.add_representer(list, _list)
_Dumper.add_representer(Column, _column)
_Dumper.add_representer(dict, _dict)
_Dumper.add_representer(float, _float)


def number(value: float) -> str:
    """Return a number with six significant digits and a decimal point, as YAML 1.1 needs for floats."""
    text = f"{value + 0.0:.{_DIGITS}g}"
    if "e" in text:
        mantissa, _, exponent = text.partition("e")
        return f"{mantissa if '.' in mantissa else mantissa + '.0'}e{exponent}"
    return text if "." in text or not text.lstrip("-").isdigit() else f"{text}.0"


def dump(data: Mapping[str, Any], *, header: Sequence[str] = (), sort_keys: bool = False) -> str:
    """Return YAML text of plain data in ASCII, below comment lines `header`."""
    text = yaml.dump(dict(data), Dumper=_Dumper, sort_keys=sort_keys, width=110, default_flow_style=False)
    return "".join(f"# {line}\n" for line in header) + text


def annotate(text: str, key: str, notes: Sequence[str]) -> str:
    """Return the text with a comment after each entry of the first `Column` under `key`."""
    match = re.search(
        rf"^(?P<indent> *){re.escape(key)}:\n(?P<rows>(?:(?P=indent) *- .*\n)+)", text, re.MULTILINE
    )
    if match is None:
        return text
    rows = match["rows"].splitlines()
    if len(rows) != len(notes):
        return text
    width = max(len(row) for row in rows)
    shown = "".join(f"{row:<{width}}  # {_ascii(note)}\n" for row, note in zip(rows, notes, strict=True))
    return text[: match.start("rows")] + shown + text[match.end("rows") :]


def _ascii(text: str) -> str:
    return text.encode("ascii", "backslashreplace").decode().replace("\n", " ")
