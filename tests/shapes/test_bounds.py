"""Meshes that ask for more than they hold: refused in little time and memory."""

from __future__ import annotations

import base64
import json
import struct
from pathlib import Path

import numpy as np
import pytest

from roboyard.errors import MeshError
from roboyard.shapes.load import load_mesh
from roboyard.shapes.readers import parts

FAN = "v 0 0 0\nv 1 0 0\nv 0 1 0\n" + ("f" + " 1 2 3" * 300 + "\n") * 3
SOURCES = """<source id="p"><float_array id="a" count="9">0 0 0 1 0 0 0 1 0</float_array><technique_common>
<accessor source="#a" count="3" stride="3"/></technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#p"/></vertices>"""
TRIANGLES = (
    """<triangles count="1"><input semantic="VERTEX" source="#v" offset="0"/><p>0 1 2</p></triangles>"""
)


@pytest.fixture(autouse=True)
def few(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(parts, "MAX_TRIANGLES", 1000)


def dae(levels: int) -> str:
    nodes = '<node id="n0"><instance_geometry url="#g"/></node>'
    for level in range(1, levels):
        nodes += f'<node id="n{level}">' + f'<instance_node url="#n{level - 1}"/>' * 10 + "</node>"
    return f"""<COLLADA version="1.4.1"><library_geometries><geometry id="g"><mesh>{SOURCES}{TRIANGLES}</mesh>
</geometry></library_geometries><library_nodes>{nodes}</library_nodes><library_visual_scenes>
<visual_scene id="s"><node><instance_node url="#n{levels - 1}"/></node></visual_scene></library_visual_scenes>
<scene><instance_visual_scene url="#s"/></scene></COLLADA>"""


def gltf(nodes: int, mode: int = 4) -> str:
    data = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], dtype="<f4").tobytes() + struct.pack("<3H", 0, 1, 2)
    uri = "data:application/octet-stream;base64," + base64.b64encode(data).decode()
    return json.dumps(
        {
            "asset": {"version": "2.0"},
            "scene": 0,
            "scenes": [{"nodes": list(range(nodes))}],
            "nodes": [{"mesh": 0}] * nodes,
            "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1, "mode": mode}]}],
            "accessors": [
                {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"},
                {"bufferView": 1, "componentType": 5123, "count": 3, "type": "SCALAR"},
            ],
            "bufferViews": [
                {"buffer": 0, "byteOffset": 0, "byteLength": 36},
                {"buffer": 0, "byteOffset": 36, "byteLength": 6},
            ],
            "buffers": [{"byteLength": len(data), "uri": uri}],
        }
    )


def stl(count: int) -> bytes:
    record = struct.pack("<12fH", 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0)
    return b"x".ljust(80) + struct.pack("<I", count) + record * count


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("fan.obj", FAN * 2),
        ("nested.dae", dae(5)),
        ("nodes.gltf", gltf(1001)),
        ("many.stl", stl(1001)),
    ],
)
def test_triangles_are_counted_before_they_are_made(tmp_path: Path, name: str, content: str | bytes) -> None:
    (tmp_path / name).write_bytes(content if isinstance(content, bytes) else content.encode())
    with pytest.raises(MeshError, match=r"triangles are too many \(at most 1000\)"):
        load_mesh(tmp_path / name)


@pytest.mark.parametrize(
    ("name", "content", "count"),
    [
        ("fan.obj", FAN, 3 * 898),
        ("nested.dae", dae(4), 1000),
        ("nodes.gltf", gltf(1000), 1000),
        ("many.stl", stl(1000), 1000),
    ],
)
def test_as_many_as_are_allowed_are_read(
    tmp_path: Path, name: str, content: str | bytes, count: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(parts, "MAX_TRIANGLES", count)
    (tmp_path / name).write_bytes(content if isinstance(content, bytes) else content.encode())
    assert len(load_mesh(tmp_path / name).faces) == count


def test_accessors_count_their_numbers(tmp_path: Path) -> None:
    scene = json.loads(gltf(1))
    scene["accessors"].append({"componentType": 5126, "count": 10_000_000, "type": "MAT4"})
    (tmp_path / "m.gltf").write_text(json.dumps(scene))
    with pytest.raises(MeshError, match="declares 160000012 numbers"):
        load_mesh(tmp_path / "m.gltf")


def test_triangles_that_share_no_corners_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(parts, "MAX_VERTICES", 600)
    corners = np.random.default_rng(0).random((300, 9)).astype("<f4")
    record = np.zeros(300, np.dtype([("n", "<f4", 3), ("c", "<f4", 9), ("a", "<u2")]))
    record["c"] = corners
    file = tmp_path / "soup.stl"
    file.write_bytes(b"x".ljust(80) + struct.pack("<I", 300) + record.tobytes())
    with pytest.raises(MeshError, match="900 vertices are too many"):
        load_mesh(file)
