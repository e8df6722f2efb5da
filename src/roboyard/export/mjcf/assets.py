"""Mesh, texture and material files of an MJCF, each distinct one once."""

from __future__ import annotations

import hashlib
import xml.etree.ElementTree as ET
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from roboyard.description.model import RGBA
from roboyard.export.images import ImageCache, write_png
from roboyard.export.mjcf.xml import add
from roboyard.export.names import free_name, identifier
from roboyard.shapes.mesh import TriangleMesh
from roboyard.shapes.mesh_files import STL_MAX_FACES, write_obj, write_stl

MESHES, TEXTURES = "meshes", "textures"
MIN_VERTICES = 4
"""Requirements of MuJoCo on a mesh."""
FIRST = 256
"""Vertices that are compared first; all of them only where these are too few."""


@dataclass(kw_only=True, eq=False)
class Assets:
    """The `<asset>` element being filled and the folder its files go to."""

    folder: Path
    element: ET.Element
    meshes: dict[bytes, str] = field(default_factory=dict)
    materials: dict[tuple[RGBA, str | None], str] = field(default_factory=dict)
    textures: dict[str, str] = field(default_factory=dict)
    names: dict[str, set[str]] = field(default_factory=dict)
    digests: ImageCache = field(default_factory=ImageCache)
    files: list[Path] = field(default_factory=list)

    def mesh(self, mesh: TriangleMesh, name: str, *, solid: bool) -> str | None:
        """Name of the asset of a mesh; None for one too small for MuJoCo.

        Args:
            mesh: triangles; texture coordinates are kept.
            name: what to call it if it is new.
            solid: it collides; else it is only looked at and may be open or flat.
        """
        keep_uv = mesh.uv is not None and not solid
        digest = hashlib.blake2b(digest_size=16)
        for array in (mesh.vertices, mesh.faces, *((mesh.uv,) if keep_uv else ())):
            digest.update(np.ascontiguousarray(array).data)
        key = digest.digest() + bytes([solid])
        if key not in self.meshes:
            if not _has_distinct(mesh.vertices, MIN_VERTICES):
                return None
            chosen = self._free("mesh", name.replace("/", "_"))
            suffix = ".obj" if keep_uv or len(mesh.faces) > STL_MAX_FACES else ".stl"
            file = self.folder / MESHES / f"{chosen}{suffix}"
            file.parent.mkdir(parents=True, exist_ok=True)
            if suffix == ".obj":
                write_obj(mesh, file)
            else:
                write_stl(mesh, file)
            add(
                self.element,
                "mesh",
                name=chosen,
                file=f"{MESHES}/{file.name}",
                inertia="convex" if solid else "shell",
            )
            self.files.append(file)
            self.meshes[key] = chosen
        return self.meshes[key]

    def material(self, rgba: RGBA, texture: str | None, name: str | None) -> str:
        """Name of the material of a colour and texture."""
        key = (rgba, texture)
        if key not in self.materials:
            channels = "".join(f"{round(255 * min(max(c, 0.0), 1.0)):02x}" for c in rgba)
            chosen = self._free("material", name or f"color_{channels}")
            add(self.element, "material", name=chosen, rgba=rgba, texture=texture)
            self.materials[key] = chosen
        return self.materials[key]

    def texture(self, pixels: np.ndarray, name: str) -> str:
        """Name of the texture of an (h, w, 4) image."""
        key = self.digests.of(pixels)
        if key not in self.textures:
            chosen = self._free("texture", name)
            file = self.folder / TEXTURES / f"{chosen}.png"
            write_png(pixels, key, file, alpha=False)
            add(self.element, "texture", name=chosen, type="2d", file=f"{TEXTURES}/{file.name}")
            self.files.append(file)
            self.textures[key] = chosen
        return self.textures[key]

    def _free(self, kind: str, name: str) -> str:
        used = self.names.setdefault(kind, set())
        wanted = identifier(name, kind)
        # file systems may ignore case
        folded = free_name(wanted.casefold(), used)
        used.add(folded)
        return wanted + folded[len(wanted.casefold()) :]


def _has_distinct(vertices: np.ndarray, count: int) -> bool:
    """Return whether (n, 3) vertices hold so many distinct ones, as 32-bit numbers."""
    single = vertices.astype(np.float32)
    return any(len(np.unique(part, axis=0)) >= count for part in (single[:FIRST], single))
