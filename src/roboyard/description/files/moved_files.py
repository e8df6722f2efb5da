"""Files of a robot that was moved after its description was written: found by the end of their paths.

`package://old/tree/arm/meshes/base.obj` and `/old/place/arm/meshes/base.obj` mean, in a package that was
copied out of that tree, its `meshes/base.obj`; `package://visual/base.obj` can only mean the one
`visual/base.obj` of the package.
"""

from __future__ import annotations

import os
from functools import lru_cache
from pathlib import Path, PurePosixPath

MAX_FILES = 20_000
"""Files of a package that are looked at."""
LEAST_SHARED = 2
"""Names at the end of two paths that have to agree: the file's and its folder's."""
_MESHES = {".stl", ".obj", ".dae", ".ply", ".off", ".glb", ".gltf"}
_IMAGES = {".png", ".jpg", ".jpeg", ".tga", ".bmp"}


def moved_file(package: Path, named: str, *, deep: bool, least: int = LEAST_SHARED) -> Path | None:
    """The mesh or image below `package` that a path from elsewhere means.

    Args:
        package: folder of the robot's files.
        named: the path as the description gives it, with the package's name in front where it has one.
        deep: also look for the whole of `named` in folders further down; for folders that hold one package.
        least: names at the end of both paths that have to agree.

    Returns:
        The one file whose path in the package ends `named`, the longest first; with `deep`, else the one
        whose path `named` ends; None where there is none or a choice.
    """
    wanted = _names(named)
    paths = _files(package).get(wanted[-1], ()) if wanted else ()
    ending = [path for path in paths if least <= len(_names(path)) and _ends(wanted, _names(path))]
    if ending:
        return package / max(ending, key=len)
    inside = [path for path in paths if deep and least <= len(wanted) and _ends(_names(path), wanted)]
    return package / inside[0] if len(inside) == 1 else None


def is_mesh_or_image(file: Path) -> bool:
    """True where a file is called as meshes and textures are."""
    return file.suffix.lower() in _MESHES | _IMAGES


@lru_cache(maxsize=64)
def _files(package: Path) -> dict[str, tuple[str, ...]]:
    """Mesh and image files below a package, as paths relative to it, by file name in lower case."""
    found: dict[str, list[str]] = {}
    seen = 0
    for folder, folders, files in os.walk(package):
        folders[:] = sorted(name for name in folders if not name.startswith("."))
        inside = Path(folder).relative_to(package)
        for name in files:
            if is_mesh_or_image(inside / name):
                found.setdefault(name.casefold(), []).append((inside / name).as_posix())
        seen += len(files)
        if seen > MAX_FILES:
            break
    return {name: tuple(paths) for name, paths in found.items()}


def _names(path: str) -> tuple[str, ...]:
    return tuple(part.casefold() for part in PurePosixPath(path).parts if part not in ("/", ".", ".."))


def _ends(path: tuple[str, ...], end: tuple[str, ...]) -> bool:
    """True where `path` ends as `end` says."""
    return len(end) <= len(path) and path[len(path) - len(end) :] == end
