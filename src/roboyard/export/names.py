"""Names that a format allows, distinct where the originals are."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Iterable, Mapping

_IDENTIFIER = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")


def is_identifier(name: str) -> bool:
    """Whether every version of USD takes the name: ASCII letters, digits and `_`, no digit first."""
    return _IDENTIFIER.fullmatch(name) is not None


def identifier(name: str, fallback: str = "unnamed") -> str:
    """The nearest identifier to a name; accents are dropped, other characters become `_`."""
    plain = unicodedata.normalize("NFKD", name)
    text = "".join(c for c in plain if not unicodedata.combining(c))
    text = re.sub(r"[^A-Za-z0-9_]", "_", text)
    if not text.strip("_"):
        return f"{fallback}{text}" if text else fallback
    return f"_{text}" if text[0].isdigit() else text


def identifiers(names: Iterable[str], taken: Iterable[str] = (), fallback: str = "unnamed") -> dict[str, str]:
    """An identifier for each name, all distinct, none in `taken`.

    Names that are identifiers already are kept, also after similar ones; the others get the nearest
    free one (`arm.1` becomes `arm_1`, or `arm_1_2` where that is taken).
    """
    wanted = list(dict.fromkeys(names))
    reserved = set(taken)
    found = {name: name for name in wanted if is_identifier(name) and name not in reserved}
    used = reserved | set(found)
    for name in wanted:
        if name not in found:
            found[name] = free_name(identifier(name, fallback), used)
            used.add(found[name])
    return {name: found[name] for name in wanted}


def free_name(name: str, used: Iterable[str]) -> str:
    """The name, or the name with the first number (`_2`, `_3`, ...) that is not used."""
    taken = used if isinstance(used, set | frozenset | Mapping) else set(used)
    if name not in taken:
        return name
    number = 2
    while f"{name}_{number}" in taken:
        number += 1
    return f"{name}_{number}"
