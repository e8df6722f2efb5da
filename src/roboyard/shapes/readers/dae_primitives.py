"""Read a COLLADA `<geometry>`: triangles, polygon lists, polygons, strips and fans."""

from __future__ import annotations

import warnings
import xml.etree.ElementTree as ET

import numpy as np

from roboyard._arrays import NDArray
from roboyard._records import dataclass
from roboyard.shapes.readers.dae_ids import ElementIds
from roboyard.shapes.readers.parts import Floats, Indices, check_triangles
from roboyard.shapes.readers.plain_numbers import is_worth_it, read_plain_numbers

_KINDS = ("triangles", "polylist", "polygons", "tristrips", "trifans")
_SOURCES = ("vertices", "source")


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Primitive:
    """Triangles of one material symbol."""

    positions: Floats
    """(n, 3) in the file's unit."""
    corners: Indices
    """(m, 3) indices into `positions`."""
    normals: tuple[Floats, Indices] | None
    uv: tuple[Floats, Indices] | None
    colors: NDArray[np.uint8] | None
    """(m, 4) RGBA, mean of each face's vertex colours."""
    material: str | None


def read_geometry(geometry: ET.Element, ids: ElementIds) -> list[Primitive]:
    """Return the primitives of one geometry that have triangles; lines and splines are skipped."""
    mesh = geometry.find("mesh")
    if mesh is None:
        return []
    sources: dict[int, Floats] = {}
    found = (_read_primitive(element, ids, sources) for element in mesh if element.tag in _KINDS)
    return [primitive for primitive in found if primitive is not None]


def _read_primitive(element: ET.Element, ids: ElementIds, sources: dict[int, Floats]) -> Primitive | None:
    inputs, stride = _inputs(element, ids)
    corners = _corners(element, stride)
    if not len(corners):
        return None
    if "POSITION" not in inputs:
        raise ValueError(f"<{element.tag}> has no positions")

    def values(semantic: str) -> tuple[Floats, Indices] | None:
        if semantic not in inputs:
            return None
        source, offset = inputs[semantic]
        if id(source) not in sources:
            sources[id(source)] = _floats(source, ids)
        return sources[id(source)], corners[:, :, offset]

    position = values("POSITION")
    assert position is not None
    normals, uv, tint = values("NORMAL"), values("TEXCOORD"), values("COLOR")
    return Primitive(
        positions=_columns(position[0], 3),
        corners=position[1],
        normals=None if normals is None else (_columns(normals[0], 3), normals[1]),
        uv=None if uv is None else (_columns(uv[0], 2), uv[1]),
        colors=None if tint is None else _face_colors(*tint),
        material=element.get("material"),
    )


def _inputs(element: ET.Element, ids: ElementIds) -> tuple[dict[str, tuple[ET.Element, int]], int]:
    """Return semantic to source and offset in the index list, and the number of indices per corner."""
    found: dict[str, tuple[ET.Element, int]] = {}
    stride = 1
    for entry in element.findall("input"):
        offset = int(entry.get("offset", "0"))
        if not 0 <= offset < 64:
            raise ValueError(f"<{element.tag}> has an input at offset {offset}")
        stride = max(stride, offset + 1)
        source = ids.find(entry.get("source"), *_SOURCES)
        semantic = entry.get("semantic", "")
        if source is None:
            continue
        if semantic == "VERTEX":
            for nested in source.findall("input"):
                other = ids.find(nested.get("source"), *_SOURCES)
                if other is not None:
                    found.setdefault(nested.get("semantic", ""), (other, offset))
        else:
            found.setdefault(semantic, (source, offset))
    return found, stride


def _corners(element: ET.Element, stride: int) -> Indices:
    """Return (m, 3, stride) indices of the triangles' corners."""
    lists = [_numbers(p.text or "", np.int64) for p in element.iter("p")]
    lists = [numbers[: len(numbers) // stride * stride].reshape(-1, stride) for numbers in lists]
    empty = np.empty((0, 3, stride), dtype=np.int64)
    if not lists:
        return empty
    if element.tag == "triangles":
        every = np.concatenate(lists)
        return every[: len(every) // 3 * 3].reshape(-1, 3, stride)
    if element.tag == "polylist":
        counts = element.find("vcount")
        sizes = np.array((counts.text or "").split() if counts is not None else [], dtype=np.int64)
        every = np.concatenate(lists)
        if (sizes < 0).any() or sizes.sum() > len(every):
            raise ValueError(f"<polylist> counts {int(sizes.sum())} corners, more than it lists")
        return every[_fans(sizes)]
    if element.tag == "tristrips":
        return np.concatenate([empty, *(_strip(numbers) for numbers in lists)])
    sizes = np.array([len(numbers) for numbers in lists], dtype=np.int64)  # polygons and fans
    return np.concatenate(lists)[_fans(sizes)]


def _fans(sizes: Indices) -> Indices:
    """Return (m, 3) positions of triangle corners in a list of polygons of these sizes, split as fans."""
    starts = np.cumsum(sizes) - sizes
    cut = np.maximum(sizes - 2, 0)
    first = np.repeat(starts, cut)
    check_triangles(int(cut.sum()))
    step = np.arange(cut.sum()) - np.repeat(np.cumsum(cut) - cut, cut)
    return np.stack([first, first + step + 1, first + step + 2], axis=1)


def _strip(numbers: Indices) -> Indices:
    """Return the (m, 3) triangles of a strip, every second one flipped."""
    count = max(len(numbers) - 2, 0)
    index = np.arange(count)[:, None] + np.arange(3)
    index[1::2] = index[1::2, ::-1]
    return numbers[index]


def _floats(source: ET.Element, ids: ElementIds) -> Floats:
    """Return the (n, stride) table of a `<source>`."""
    accessor = source.find("technique_common/accessor")
    array = None if accessor is None else ids.find(accessor.get("source"), "float_array", "int_array")
    if array is None:
        array = source.find("float_array")
    if array is None:
        raise ValueError(f"<source> {source.get('id')!r} has no numbers")
    numbers = _numbers(array.text or "", np.float64)
    stride = int(accessor.get("stride", "1")) if accessor is not None else 3
    offset = int(accessor.get("offset", "0")) if accessor is not None else 0
    if not 1 <= stride <= 64 or offset < 0:
        raise ValueError(f"a <source> has the invalid stride {stride} or offset {offset}")
    numbers = numbers[offset:]
    return numbers[: len(numbers) // stride * stride].reshape(-1, stride)


def _numbers(text: str, dtype: type) -> NDArray:
    """Return the (n,) numbers of a text that blanks separate."""
    plain = read_plain_numbers(text, dtype) if is_worth_it(text, dtype) else None
    if plain is not None:
        return plain
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            return np.fromstring(text, dtype=dtype, sep=" ")
        except (DeprecationWarning, ValueError):  # not numbers alone, or spelt as only Python reads them
            return np.array(text.split(), dtype=dtype)


def _columns(table: Floats, count: int) -> Floats:
    if table.shape[1] < count:
        raise ValueError(f"a <source> has {table.shape[1]} numbers per item where {count} are needed")
    return table[:, :count]


def _face_colors(values: Floats, index: Indices) -> NDArray[np.uint8]:
    table = _columns(values, 3)
    if index.size and (index.min() < 0 or index.max() >= len(table)):
        raise ValueError(f"a face refers to colour {int(index.max()) + 1}, but there are {len(table)}")
    rgb = np.rint(255 * table[index].mean(axis=1)).clip(0, 255)
    return np.column_stack([rgb, np.full(len(rgb), 255)]).astype(np.uint8)
