"""YAML from any source: a bounded number of values, and one kind of error.

The text is scanned once before anything is built from it. Scanning takes little memory, and ends at the first
value too many; aliases count as often as they expand.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import yaml

from roboyard.untrusted.files import read_file

MAX_VALUES = 300_000
"""Most values and keys after expanding aliases; a value takes up to 0.4 kB while it is read."""
MAX_DEPTH = 200
"""Most levels of lists and mappings."""

LOADER: Any = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
"""Builds plain data only; libyaml's, where PyYAML was built with it."""


def read_yaml(file: Path | str, max_bytes: int) -> Any:
    """Return the content of a YAML file: dicts, lists and scalars; None for an empty one.

    Args:
        file: its path.
        max_bytes: largest file that is accepted (bytes).

    Raises:
        OSError: it cannot be read, is no regular file, or is too large.
        ValueError: it is no YAML of plain data, is nested too deeply, or has too many values.
    """
    data = read_file(file, max_bytes)
    try:
        return parse_yaml(data.decode("utf-8"))
    except UnicodeDecodeError as error:
        raise ValueError(f"byte {error.start} is no UTF-8; save the text as UTF-8") from None


def parse_yaml(text: str) -> Any:
    """Return the value of a YAML text: dicts, lists and scalars; None for an empty one.

    Raises:
        ValueError: it is no YAML of plain data, is nested too deeply, or has too many values.
    """
    try:
        check_size(text)
        return yaml.load(text, Loader=LOADER)  # noqa: S506 - a safe loader
    except yaml.YAMLError as error:
        raise ValueError(" ".join(str(error).split())) from None
    except (RecursionError, OverflowError, TypeError) as error:  # a key that is no scalar, a huge number
        raise ValueError(f"it is no plain data ({error}); write plain keys and values") from None


def check_size(text: str, most: int = MAX_VALUES) -> None:
    """Count the values of a YAML text without building them.

    Args:
        text: one document.
        most: values that are accepted, aliases expanded.

    Raises:
        ValueError: there are more, or they are nested too deeply; the message has the line.
        yaml.YAMLError: it is no YAML.
    """
    count = 0
    open_counts: list[tuple[str | None, int]] = []
    sizes: dict[str, int] = {}
    for event in yaml.parse(text, Loader=LOADER):
        if isinstance(event, yaml.CollectionStartEvent):
            open_counts.append((event.anchor, count))
            count += 1
            if len(open_counts) > MAX_DEPTH:
                raise ValueError(f"line {_line(event)}: over {MAX_DEPTH} levels deep; write it flat")
        elif isinstance(event, yaml.CollectionEndEvent):
            anchor, before = open_counts.pop()
            if anchor:
                sizes[anchor] = count - before
        elif isinstance(event, yaml.ScalarEvent):
            count += 1
            if event.anchor:
                sizes[event.anchor] = 1
        elif isinstance(event, yaml.AliasEvent):
            count += sizes.get(event.anchor, 1)
        if count > most:
            raise ValueError(
                f"line {_line(event)}: more than {most} values, aliases expanded; split the file"
            )


def _line(event: Any) -> int:
    return int(event.start_mark.line) + 1
