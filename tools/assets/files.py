"""Mesh, material and image files as bytes that are identical on every machine."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from assets.mesh import Mesh, corner_normals, steady, tidy

Rgb = tuple[float, float, float]


def number(value: float, digits: int = 5) -> str:
    """Return the shortest decimal with at most `digits` places; never `-0`."""
    text = f"{value:.{digits}f}".rstrip("0").rstrip(".")
    return "0" if text in ("-0", "") else text


def obj(mesh: Mesh, *, header: str, mtl: str | None = None, crease: float = 0.7) -> bytes:
    """Return a Wavefront OBJ with normals and one group for each material of `mtl`."""
    mesh = tidy(mesh)
    lines = [f"# {header}"]
    if mtl is not None:
        lines.append(f"mtllib {mtl}")
    lines += ["v " + " ".join(number(x) for x in v) for v in mesh.vertices]
    uv_index = None
    if mesh.uv is not None:
        uv_unique, inverse = np.unique(np.round(mesh.uv.reshape(-1, 2), 4), axis=0, return_inverse=True)
        uv_index = inverse.reshape(-1, 3)
        lines += [f"vt {number(u, 4)} {number(v, 4)}" for u, v in uv_unique]
    normals = steady(corner_normals(mesh, crease).reshape(-1, 3) * 100) / 100
    unique, inverse = np.unique(normals, axis=0, return_inverse=True)
    normal_index = inverse.reshape(-1, 3)
    lines += ["vn " + " ".join(number(x, 2) for x in n) for n in unique]
    for part, name in enumerate(mesh.parts):
        chosen = np.flatnonzero(mesh.part_of_face == part)
        if mtl is not None and len(chosen):
            lines.append(f"usemtl {name}")
        for f in chosen:
            texts = []
            for corner in range(3):
                t = "" if uv_index is None else str(uv_index[f, corner] + 1)
                texts.append(f"{mesh.faces[f, corner] + 1}/{t}/{normal_index[f, corner] + 1}")
            lines.append("f " + " ".join(texts))
    return ("\n".join(lines) + "\n").encode()


def mtl(materials: Mapping[str, Rgb], *, header: str, textures: Mapping[str, str] | None = None) -> bytes:
    """Return a material library: diffuse colours, and image files for the materials that have one."""
    lines = [f"# {header}"]
    for name, rgb in materials.items():
        lines += [
            f"newmtl {name}",
            "Ka 0 0 0",
            "Kd " + " ".join(number(c, 3) for c in rgb),
            "Ks 0.1 0.1 0.1",
            "Ns 40",
        ]
        if textures and name in textures:
            lines.append(f"map_Kd {textures[name]}")
    return ("\n".join(lines) + "\n").encode()


def stl(mesh: Mesh, *, header: str, unit: float = 1.0) -> bytes:
    """Return a binary STL; `unit` is the file's length unit in metres (0.001 for millimetres)."""
    mesh = tidy(mesh)
    v = (mesh.vertices[mesh.faces] / unit).astype("<f4")
    out = np.zeros(len(v), dtype=[("normal", "<f4", 3), ("v", "<f4", (3, 3)), ("attribute", "<u2")])
    normal = np.cross(v[:, 1] - v[:, 0], v[:, 2] - v[:, 0]).astype(float)
    out["normal"] = np.round(normal / np.linalg.norm(normal, axis=1, keepdims=True), 3) + 0.0
    out["v"] = v
    return header.encode()[:80].ljust(80, b" ") + struct.pack("<I", len(v)) + out.tobytes()


def dae(
    mesh: Mesh, *, header: str, colors: Mapping[str, Rgb], unit: float = 1.0, crease: float = 0.7
) -> bytes:
    """Return a COLLADA 1.4 file with one triangle set per material; `unit` is its length unit (m).

    A node of the scene rotates the geometry by 90 degrees about z, as exporters do, and the vertices are
    stored rotated back: a reader that ignores node transforms gives a rotated mesh.
    """
    mesh = tidy(mesh)
    turned = mesh.vertices @ np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    normals, inverse = np.unique(
        steady(corner_normals(mesh, crease).reshape(-1, 3) * 100) / 100, axis=0, return_inverse=True
    )
    normals = normals @ np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    index = inverse.reshape(-1, 3)
    effects, materials, sets, binds = [], [], [], []
    for part, name in enumerate(mesh.parts):
        rgb = " ".join(number(c, 3) for c in colors[name])
        effects.append(
            f'<effect id="{name}-effect"><profile_COMMON><technique sid="common"><phong>'
            f"<diffuse><color>{rgb} 1</color></diffuse>"
            "</phong></technique></profile_COMMON></effect>"
        )
        materials.append(
            f'<material id="{name}" name="{name}"><instance_effect url="#{name}-effect"/></material>'
        )
        chosen = np.flatnonzero(mesh.part_of_face == part)
        p = np.stack([mesh.faces[chosen], index[chosen]], axis=2).reshape(-1)
        sets.append(
            f'<triangles material="{name}" count="{len(chosen)}">'
            '<input semantic="VERTEX" source="#mesh-vertices" offset="0"/>'
            '<input semantic="NORMAL" source="#mesh-normals" offset="1"/>'
            f"<p>{' '.join(map(str, p))}</p></triangles>"
        )
        binds.append(f'<instance_material symbol="{name}" target="#{name}"/>')
    text = f"""<?xml version="1.0" encoding="utf-8"?>
<!-- {header} -->
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset><created>2026-01-01T00:00:00</created><modified>2026-01-01T00:00:00</modified>\
<unit name="unit" meter="{unit:g}"/><up_axis>Z_UP</up_axis></asset>
<library_effects>{"".join(effects)}</library_effects>
<library_materials>{"".join(materials)}</library_materials>
<library_geometries><geometry id="mesh" name="mesh"><mesh>
{_dae_source("mesh-positions", turned / unit, 5)}
{_dae_source("mesh-normals", normals, 2)}
<vertices id="mesh-vertices"><input semantic="POSITION" source="#mesh-positions"/></vertices>
{"".join(sets)}
</mesh></geometry></library_geometries>
<library_visual_scenes><visual_scene id="scene"><node id="body">\
<matrix>0 -1 0 0 1 0 0 0 0 0 1 0 0 0 0 1</matrix>
<instance_geometry url="#mesh"><bind_material><technique_common>\
{"".join(binds)}</technique_common></bind_material></instance_geometry></node></visual_scene></library_visual_scenes>
<scene><instance_visual_scene url="#scene"/></scene>
</COLLADA>
"""
    return text.encode()


def _dae_source(name: str, rows: NDArray[np.float64], digits: int) -> str:
    numbers = " ".join(number(x, digits) for x in rows.reshape(-1))
    return (
        f'<source id="{name}"><float_array id="{name}-array" count="{rows.size}">{numbers}</float_array>'
        f'<technique_common><accessor source="#{name}-array" count="{len(rows)}" stride="3">'
        '<param name="X" type="float"/><param name="Y" type="float"/><param name="Z" type="float"/>'
        "</accessor></technique_common></source>"
    )


def png(pixels: NDArray[np.uint8], palette: Sequence[tuple[int, int, int]]) -> bytes:
    """Return an uncompressed palette PNG: compressed bytes differ between zlib builds.

    Args:
        pixels: (h, w) palette indices, row 0 at the top.
        palette: RGB 0..255.
    """
    height, width = pixels.shape
    raw = np.concatenate([np.zeros((height, 1), dtype=np.uint8), pixels], axis=1).tobytes()
    blocks = b""
    for start in range(0, len(raw), 65535):
        block = raw[start : start + 65535]
        final = start + 65535 >= len(raw)
        blocks += struct.pack("<BHH", final, len(block), len(block) ^ 0xFFFF) + block
    stream = b"\x78\x01" + blocks + struct.pack(">I", zlib.adler32(raw))
    chunks = [
        (b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 3, 0, 0, 0)),
        (b"PLTE", bytes(c for rgb in palette for c in rgb)),
        (b"IDAT", stream),
        (b"IEND", b""),
    ]
    out = b"\x89PNG\r\n\x1a\n"
    for kind, data in chunks:
        out += struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
    return out
