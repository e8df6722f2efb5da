"""Copy a robot's mesh and image files beside its new URDF, under plain names."""

from __future__ import annotations

import json
import re
import shutil
import unicodedata
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path, PurePosixPath

from roboyard.shapes.readers.references import NAME_PATTERNS, named_files
from roboyard.untrusted.files import read_file
from roboyard.untrusted.json_reading import parse_json
from roboyard.untrusted.percent_codes import unquoted

_MAX_BYTES = 512 << 20


def plain_name(name: str) -> str:
    """Return a file name of ASCII letters, digits and `._-` alone; the suffix stays."""
    path = PurePosixPath(name.replace("\\", "/"))
    stem = unicodedata.normalize("NFKD", path.stem)
    text = "".join(c for c in stem if not unicodedata.combining(c))
    text = re.sub(r"[^A-Za-z0-9_.-]", "_", text).strip(".") or "mesh"
    return text + re.sub(r"[^A-Za-z0-9.]", "", path.suffix)


@dataclass(kw_only=True, eq=False)
class FileCopier:
    """Copies files to a folder, each source once.

    A mesh that names other files (materials, images, buffers) gets a folder of its own, with
    those files beside it under their bare names; the references in it are rewritten to those.
    """

    folder: Path
    """Of the new URDF."""
    plain: bool = True
    """Give files plain names."""
    staged: dict[Path, str] = field(default_factory=dict)
    """Source to its path relative to `folder`."""
    taken: set[str] = field(default_factory=set)
    reserved: frozenset[str] = frozenset()
    """Names of missing files, case folded; no copy gets one, or it would be taken for the missing file."""

    def mesh(self, source: Path) -> str:
        """Copy a mesh with the files it names; returns its path relative to the folder, with `/`."""
        if source not in self.staged:
            name = plain_name(source.name) if self.plain else source.name
            externals = dict(named_files(source))
            self.staged[source] = self._place("meshes", name, own_folder=bool(externals))
            target = self.folder / self.staged[source]
            target.parent.mkdir(parents=True, exist_ok=True)
            bare = _bare_names(externals.values(), target.name)
            _copy_rewritten(source, target, {n: bare[file] for n, file in externals.items()})
            for file, new in bare.items():
                named = {n: bare[other] for n, other in named_files(source, file)}
                _copy_rewritten(file, target.parent / new, named)
        return self.staged[source]

    def image(self, source: Path) -> str:
        """Copy an image; returns its path relative to the folder, with `/`."""
        if source not in self.staged:
            name = plain_name(source.name) if self.plain else source.name
            self.staged[source] = self._place("textures", name, own_folder=False)
            target = self.folder / self.staged[source]
            target.parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(source, target)
        return self.staged[source]

    def _place(self, folder: str, name: str, *, own_folder: bool) -> str:
        """A free path: `meshes/arm.stl`, `meshes/arm_1.stl`, ...; or `meshes/arm/arm.dae`."""
        number = 0
        while True:
            stem, suffix = Path(name).stem + (f"_{number}" if number else ""), Path(name).suffix
            key = f"{folder}/{stem}" if own_folder else f"{folder}/{stem}{suffix}"
            if key.casefold() not in self.taken and f"{stem}{suffix}".casefold() not in self.reserved:
                self.taken.add(key.casefold())
                kept = f"{stem}{suffix}" if name.casefold() in self.reserved else name
                return f"{key}/{kept}" if own_folder else key
            number += 1


def _bare_names(files: Iterable[Path], taken: str) -> dict[Path, str]:
    """A plain name for each file, no two alike."""
    names: dict[Path, str] = {}
    used = {taken.casefold()}
    for file in files:
        if file not in names:
            name, number = plain_name(file.name), 0
            while name.casefold() in used:
                number += 1
                name = plain_name(f"{file.stem}_{number}{file.suffix}")
            used.add(name.casefold())
            names[file] = name
    return names


def _copy_rewritten(source: Path, target: Path, bare_names: dict[str, str]) -> None:
    """Copy a file; the names in it that are not bare become bare."""
    changed = {name: bare for name, bare in bare_names.items() if unquoted(name) != bare}
    suffix = source.suffix.lower()
    pattern = NAME_PATTERNS.get(suffix)
    if not changed or (pattern is None and suffix != ".gltf"):
        shutil.copyfile(source, target)
        return
    data = read_file(source, _MAX_BYTES)
    if pattern is not None:

        def bare(match: re.Match[bytes]) -> bytes:
            name = match[2].decode("utf-8", "replace").strip()
            return match[1] + changed[name].encode() if name in changed else match[0]

        target.write_bytes(pattern.sub(bare, data))
        return
    scene = parse_json(data)
    for entry in (*scene.get("buffers", ()), *scene.get("images", ())):
        if entry.get("uri") in changed:
            entry["uri"] = changed[entry["uri"]]
    target.write_text(json.dumps(scene), encoding="utf-8")
