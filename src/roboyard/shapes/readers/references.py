"""External files of a mesh file: material libraries, images, buffers."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from pathlib import Path

from roboyard.shapes.readers.external_files import find_external_file
from roboyard.untrusted.files import read_file
from roboyard.untrusted.json_reading import parse_json

_MTLLIB = re.compile(rb"^([ \t]*mtllib[ \t]+)([^\r\n]+)", re.M)
_MAP = re.compile(
    rb"^([ \t]*(?:map_\w+|bump|disp|decal|refl|norm)[ \t]+"
    rb"(?:-(?:blendu|blendv|cc|clamp|imfchan|texres|type|bm|boost)[ \t]+\S+[ \t]+"
    rb"|-mm[ \t]+\S+[ \t]+\S+[ \t]+|-[ost](?:[ \t]+[-+.\deE]+){1,3}[ \t]+)*)([^\r\n]+)",
    re.M | re.I,
)
_INIT_FROM = re.compile(rb"(<init_from>\s*(?:<ref>\s*)?)([^<]+?)(?=\s*<)")
_MAX_TEXT = 256 << 20

NAME_PATTERNS = {".obj": _MTLLIB, ".mtl": _MAP, ".dae": _INIT_FROM}
"""Suffix to a pattern whose first group precedes a file's name and whose second group is the name."""


def named_files(mesh: Path, part: Path | None = None) -> Iterator[tuple[str, Path]]:
    """Yield the name as written and the path of each external file of `part` of a mesh (the mesh by default).

    Names are relative to the mesh's folder, as for the loader. The files of an OBJ's material libraries are
    included, so that one folder can hold them all.
    """
    file = mesh if part is None else part
    for name in names_in(file):
        found = find_external_file(mesh, name)
        if found is None or found == file:
            continue
        yield name, found
        if found.suffix.lower() == ".mtl" and part is None:
            yield from named_files(mesh, found)


def names_in(file: Path) -> Iterator[str]:
    """Yield the names of external files, as written, in a mesh file or a material library."""
    suffix = file.suffix.lower()
    pattern = NAME_PATTERNS.get(suffix)
    if pattern is None and suffix != ".gltf":
        return
    try:
        data = read_file(file, _MAX_TEXT)
    except OSError:
        return
    if pattern is not None:
        for match in pattern.finditer(data):
            name = match[2].decode("utf-8", "replace").strip()
            if suffix != ".dae" or "." in name:  # in a DAE, init_from may also name an image by its id
                yield name
    else:
        try:
            scene = parse_json(data)
            entries = [*scene.get("buffers", ()), *scene.get("images", ())]
            uris = [entry.get("uri") for entry in entries]
        except (ValueError, AttributeError, TypeError):
            return
        yield from (uri for uri in uris if isinstance(uri, str) and not uri.startswith("data:"))


def missing_files(mesh: Path, names: Iterable[str]) -> list[str]:
    """Return those `names` of a mesh, and of its material libraries, that are not in its folders."""
    named = list(names)
    for name in tuple(named):
        found = find_external_file(mesh, name)
        if found is not None and found.suffix.lower() == ".mtl":
            named += names_in(found)
    return [name for name in dict.fromkeys(named) if find_external_file(mesh, name) is None]
