"""New names for links and joints whose names are no identifiers."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from roboyard.description.urdf.parse import UrdfElements

_PLAIN = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")


@dataclass(frozen=True, kw_only=True, slots=True)
class Renames:
    """Old name to new name, only where they differ; links and joints are two name spaces."""

    links: Mapping[str, str]
    joints: Mapping[str, str]


def planned_renames(urdf: UrdfElements) -> Renames:
    """Return the names that `repair` changes: each that is no USD identifier, distinct from all others."""
    return Renames(
        links=distinct_names((link.name for link in urdf.links), _PLAIN),
        joints=distinct_names((joint.name for joint in urdf.joints), _PLAIN),
    )


def identifier(name: str) -> str:
    """Return the nearest name of ASCII letters, digits and `_`, without accents; others become codes."""
    plain = unicodedata.normalize("NFKD", name)
    parts: list[str] = []
    for character in plain:
        if unicodedata.combining(character):
            continue
        if character.isascii():
            parts.append(character if character.isalnum() else "_")
        else:
            parts.append(f"_u{ord(character):x}")
    text = re.sub(r"_{2,}", "_", "".join(parts)).strip("_") if not plain.isascii() else "".join(parts)
    if not text.strip("_"):
        text = "unnamed"
    return text if not text[0].isdigit() else f"_{text}"


def distinct_names(names: Iterable[str], kept: re.Pattern[str]) -> dict[str, str]:
    """Return new names for all that do not match `kept`, distinct from each other and from the kept ones."""
    wanted = [name for name in dict.fromkeys(names) if name]
    taken = {name for name in wanted if kept.fullmatch(name)}
    renames: dict[str, str] = {}
    for name in wanted:
        if name in taken:
            continue
        new = base = identifier(name)
        number = 0
        while new in taken:
            number += 1
            new = f"{base}_{number}"
        taken.add(new)
        renames[name] = new
    return renames
