"""Read COLLADA 1.4 and 1.5: the triangles of the visual scene, with node transforms, unit and materials.

`<up_axis>` is not applied: robot descriptions refer to the raw axes. A broken reference drops the material or
image, not the triangles. Source of the format: Khronos, COLLADA 1.4.1.
"""

from __future__ import annotations

import contextlib
import xml.etree.ElementTree as ET
from collections.abc import Iterator
from pathlib import Path
from xml.parsers import expat

import numpy as np

from roboyard._arrays import NDArray
from roboyard.shapes.readers.dae_ids import ElementIds
from roboyard.shapes.readers.dae_materials import Surfaces
from roboyard.shapes.readers.dae_primitives import Primitive, read_geometry
from roboyard.shapes.readers.parts import Floats, Part, check_triangles, part_from_corners
from roboyard.shapes.readers.read_mtl import SurfaceMaterial

MAX_DEPTH = 64
MAX_INSTANCES = 100_000
_END = b"</COLLADA>"


def read_dae(data: bytes, file: Path) -> list[Part]:
    """Return one part for each group of triangles of one material (m)."""
    root = parse(data)
    ids = ElementIds(root)
    scale = _unit(root)
    surfaces = Surfaces(root, ids, file)
    geometries: dict[int, list[Primitive]] = {}
    parts: list[Part] = []
    total = 0
    for instance, transform in _instances(root, ids):
        geometry = ids.find(instance.get("url"), "geometry")
        if geometry is None:
            continue
        if id(geometry) not in geometries:
            geometries[id(geometry)] = read_geometry(geometry, ids)
        total += sum(len(primitive.corners) for primitive in geometries[id(geometry)])
        check_triangles(total)
        bound = {
            bind.get("symbol"): ids.find(bind.get("target"), "material")
            for bind in instance.iter("instance_material")
        }
        for primitive in geometries[id(geometry)]:
            material = bound.get(primitive.material)
            if material is None:
                material = ids.find(primitive.material, "material")
            parts.append(_part(primitive, transform, scale, surfaces.material(material)))
    return parts


def parse(data: bytes) -> ET.Element:
    """Parse the document without namespaces; blank lines before its declaration are skipped.

    Raises:
        ValueError: it has a DTD (which could declare entities), or another root element.
    """
    scout = expat.ParserCreate()
    data = data.lstrip(b" \t\r\n")

    def refuse(*_: object) -> None:
        raise ValueError(f"a DOCTYPE (DTD, entity declarations) is not accepted: {str(_[0])[:40]!r}")

    def stop(*_: object) -> None:
        raise StopIteration

    scout.StartDoctypeDeclHandler = refuse
    scout.StartElementHandler = stop
    with contextlib.suppress(StopIteration):
        scout.Parse(data, True)
    root = _tree(data)
    for element in root.iter():
        if isinstance(element.tag, str):
            element.tag = element.tag.rpartition("}")[2]
    if root.tag != "COLLADA":
        raise ValueError(f"the root element is <{root.tag[:40]}>, not <COLLADA>")
    return root


def _tree(data: bytes) -> ET.Element:
    """Return the root element; content after its end tag, such as the rest of a longer file, is ignored."""
    try:
        return ET.fromstring(data)  # noqa: S314 - no DTD precedes the root element, so no entity can be expanded
    except ET.ParseError:
        document, end, _ = data.partition(_END)
        if not end:
            raise
        return ET.fromstring(document + end)  # noqa: S314 - as above


def _unit(root: ET.Element) -> float:
    unit = root.find("asset/unit")
    try:
        meter = float(unit.get("meter", "1")) if unit is not None else 1.0
    except ValueError:
        return 1.0
    return meter if np.isfinite(meter) and meter > 0 else 1.0


def _instances(root: ET.Element, ids: ElementIds) -> Iterator[tuple[ET.Element, NDArray[np.float64]]]:
    """Yield each `<instance_geometry>` of the visual scene with its (4, 4) transform."""
    shown = root.find("scene/instance_visual_scene")
    scene = ids.find(shown.get("url"), "visual_scene") if shown is not None else None
    if scene is None:
        scene = root.find("library_visual_scenes/visual_scene")
    if scene is None:
        return
    stack = [(node, np.eye(4), 0) for node in reversed(scene.findall("node"))]
    visited = 0
    while stack:
        node, parent, depth = stack.pop()
        visited += 1
        if depth > MAX_DEPTH or visited > MAX_INSTANCES:
            raise ValueError(
                f"nodes nested deeper than {MAX_DEPTH} or more than {MAX_INSTANCES}, got {visited}"
            )
        transform = parent @ _transform(node)
        below: list[tuple[ET.Element, NDArray[np.float64], int]] = []
        for child in node:
            if child.tag == "node":
                below.append((child, transform, depth + 1))
            elif child.tag == "instance_node":
                other = ids.find(child.get("url"), "node")
                if other is not None:
                    below.append((other, transform, depth + 1))
            elif child.tag == "instance_geometry":
                yield child, transform
            elif child.tag == "instance_controller":
                skin = _skinned(child, ids)
                if skin is not None:
                    yield skin, transform
        stack.extend(reversed(below))


def _skinned(instance: ET.Element, ids: ElementIds) -> ET.Element | None:
    """Return an instance of the geometry of a skin, in its bind pose."""
    controller = ids.find(instance.get("url"), "controller")
    skin = None if controller is None else controller.find("skin")
    if skin is None:
        return None
    shown = ET.Element("instance_geometry", url=skin.get("source", ""))
    shown.extend(instance.findall("bind_material"))
    return shown


def _transform(node: ET.Element) -> NDArray[np.float64]:
    """Return the (4, 4) product of a node's transforms, in document order."""
    out = np.eye(4)
    for element in node:
        if element.tag not in ("matrix", "translate", "rotate", "scale"):
            continue
        values = np.array((element.text or "").split(), dtype=np.float64)
        step = np.eye(4)
        if element.tag == "matrix":
            step = values.reshape(4, 4)
        elif element.tag == "translate":
            step[:3, 3] = values.reshape(3)
        elif element.tag == "scale":
            step[:3, :3] = np.diag(values.reshape(3))
        else:
            step[:3, :3] = _rotation(values.reshape(4))
        out = out @ step
    return out


def _rotation(axis_angle: Floats) -> Floats:
    """Return the (3, 3) rotation about an axis by an angle in degrees (Rodrigues)."""
    length = np.linalg.norm(axis_angle[:3])
    if length == 0:
        return np.eye(3)
    x, y, z = axis_angle[:3] / length
    angle = np.radians(axis_angle[3])
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * (cross @ cross)


def _part(primitive: Primitive, transform: Floats, scale: float, surface: SurfaceMaterial) -> Part:
    linear = transform[:3, :3]
    order = [2, 1, 0] if np.linalg.det(linear) < 0 else [0, 1, 2]
    positions = (primitive.positions @ linear.T + transform[:3, 3]) * scale
    normals = uv = None
    if primitive.normals is not None:
        values, index = primitive.normals
        normals = (values @ np.linalg.pinv(linear), index[:, order])
    if primitive.uv is not None and surface.texture is not None:
        values, index = primitive.uv
        uv = (values, index[:, order])
    color = surface.color if surface.color is not None or surface.texture is not None else primitive.colors
    return part_from_corners(
        positions,
        primitive.corners[:, order],
        normals=normals,
        uv=uv,
        color=color,
        texture=surface.texture if uv is not None else None,
    )
