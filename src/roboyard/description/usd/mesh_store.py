"""Meshes of a stage as files, since all other tools of the project read meshes from files.

They are written into the user's cache folder under the hash of their content, once each.
"""

from __future__ import annotations

import os
import tempfile
from pathlib import Path

from roboyard.description.files.copy_files import plain_name
from roboyard.errors import DescriptionError
from roboyard.shapes.cache import content_key, mesh_folder
from roboyard.shapes.mesh import TriangleMesh
from roboyard.shapes.mesh_files import write_obj


def stored_mesh(mesh: TriangleMesh, name: str) -> Path:
    """Return the OBJ file of a mesh, written where it is not there yet.

    Args:
        mesh: the triangles, in metres.
        name: stem of the file.

    Raises:
        DescriptionError: the cache folder cannot be written.
    """
    arrays = (mesh.vertices, mesh.faces, mesh.uv, mesh.colors, mesh.texture)
    stem = plain_name(f"{name[:60]}.obj").removesuffix(".obj")
    key = content_key(stem, *arrays)
    folder = mesh_folder() / key[:2] / key
    file = folder / f"{stem}.obj"
    if file.is_file():
        return file
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=folder.parent, prefix=".new-") as new:
            write_obj(mesh, Path(new, file.name), materials=True)
            _move(Path(new), folder)
    except OSError as error:
        raise DescriptionError(
            f"meshes of a stage cannot be stored in {folder.parent}: {error.strerror or error}; "
            "name a folder that can be written in ROBOYARD_CACHE"
        ) from None
    return file


def _move(new: Path, folder: Path) -> None:
    """Move the files of a finished folder; the OBJ last, so that it is there only with what it names."""
    folder.mkdir(exist_ok=True)
    for file in sorted(new.iterdir(), key=lambda path: path.suffix == ".obj"):
        os.replace(file, folder / file.name)  # noqa: PTH105 - replaces a file that another process moved
