"""Write triangle meshes as OBJ, with colours and texture where there are any."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from roboyard.shapes.mesh import TriangleMesh


def write_obj(mesh: TriangleMesh, path: Path) -> None:
    """Write `path` (and an MTL and a PNG of the same stem where the mesh has colours or a texture).

    Numbers keep nine significant digits: a micrometre on a kilometre.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    lines: list[str] = []
    if mesh.colors is not None or mesh.texture is not None:
        lines.append(f"mtllib {path.stem}.mtl")
    lines += _rows("v", mesh.vertices)
    if mesh.uv is not None:
        lines += _rows("vt", mesh.uv)
    if mesh.normals is not None:
        lines += _rows("vn", mesh.normals)
    corner = _corner(has_uv=mesh.uv is not None, has_normal=mesh.normals is not None)
    materials, of_face = _materials(mesh)
    if len(materials):
        for index in range(len(materials)):
            lines.append(f"usemtl material_{index}")
            lines += _faces(mesh.faces[of_face == index], corner)
        _write_mtl(mesh, materials, path)
    else:
        lines += _faces(mesh.faces, corner)
    path.write_text("\n".join(lines) + "\n", encoding="ascii")


def _rows(tag: str, values: np.ndarray) -> list[str]:
    pattern = tag + " %.9g" * values.shape[1]
    return [pattern % tuple(row) for row in values.tolist()]


def _corner(*, has_uv: bool, has_normal: bool) -> str:
    if has_uv:
        return "%d/%d/%d" if has_normal else "%d/%d"
    return "%d//%d" if has_normal else "%d"


def _faces(faces: np.ndarray, corner: str) -> list[str]:
    times = corner.count("%d")
    pattern = f"f {corner} {corner} {corner}"
    return [pattern % tuple(row) for row in np.repeat(faces + 1, times, axis=1).tolist()]


def _materials(mesh: TriangleMesh) -> tuple[np.ndarray, np.ndarray]:
    """(k, 4) distinct colours and (m,) colour of each face."""
    if mesh.colors is not None:
        colors, of_face = np.unique(mesh.colors, axis=0, return_inverse=True)
        return colors, of_face.reshape(-1)
    if mesh.texture is not None:
        return np.full((1, 4), 255, dtype=np.uint8), np.zeros(len(mesh.faces), dtype=int)
    return np.zeros((0, 4), dtype=np.uint8), np.zeros(0, dtype=int)


def _write_mtl(mesh: TriangleMesh, colors: np.ndarray, path: Path) -> None:
    lines: list[str] = []
    for index, (r, g, b, a) in enumerate(colors.astype(float) / 255.0):
        lines += [f"newmtl material_{index}", f"Kd {r:.6g} {g:.6g} {b:.6g}", f"d {a:.6g}"]
        if mesh.texture is not None:
            lines.append(f"map_Kd {path.stem}.png")
    path.with_suffix(".mtl").write_text("\n".join(lines) + "\n", encoding="ascii")
    if mesh.texture is not None:
        from PIL import Image

        Image.fromarray(np.ascontiguousarray(mesh.texture)).save(path.with_suffix(".png"))
