"""JSON from any source: a bounded number of values, and one kind of error."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from roboyard.untrusted.files import read_file

MAX_VALUES = 4_000_000
"""Most values, keys and brackets of a text; empty lists take 70 bytes of memory each, empty objects 64."""


def read_json(file: Path | str, max_bytes: int) -> Any:
    """Return the content of a JSON file.

    Args:
        file: its path.
        max_bytes: largest file that is accepted (bytes).

    Raises:
        OSError: it cannot be read, is no regular file, or is too large.
        ValueError: it is no JSON, is nested too deeply, or has too many values (`parse_json`).
    """
    return parse_json(read_file(file, max_bytes))


def parse_json(data: bytes) -> Any:
    """Return the value of a JSON text in UTF-8, UTF-16 or UTF-32.

    Raises:
        ValueError: it is no JSON (`json.JSONDecodeError` where the place is known), is nested too deeply, or
            has more than `MAX_VALUES` values.
    """
    count = sum(map(data.count, (b",", b":", b"[", b"{")))  # those in texts count, too
    if count > MAX_VALUES:
        raise ValueError(f"{count} values are too many (at most {MAX_VALUES}); split the file")
    try:
        return json.loads(data)
    except UnicodeDecodeError as error:
        raise ValueError(f"byte {error.start} is no {error.encoding}; save the text as UTF-8") from None
    except RecursionError:
        raise ValueError("nested too deeply; reduce the levels of lists and objects") from None
