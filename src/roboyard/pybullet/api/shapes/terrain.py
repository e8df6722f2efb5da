"""Heightfields from a list or a file, and replacing their heights."""

from __future__ import annotations

import io
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from roboyard.description.model import Heightfield
from roboyard.pybullet.face.arguments import text, vector3, whole
from roboyard.pybullet.face.errors import failure
from roboyard.pybullet.state.file_search import find_file, not_found_remedy
from roboyard.transforms import Array
from roboyard.untrusted.files import read_file

if TYPE_CHECKING:
    from roboyard.pybullet.client import Client

Vector = Sequence[float]
FAILED = "createCollisionShape failed."
_MAX_POINTS = 4096 * 4096
_MAX_BYTES = 64 << 20


def points_of(client: Client, data: Sequence[float] | None, rows: int, columns: int, file_name: str) -> Array:
    """Return (ny, nx) unscaled heights from a list, or else from a file.

    Args:
        client: client whose search path is used.
        data: (nx ny,) heights; that at (i, j) is item i + j nx.
        rows: nx.
        columns: ny.
        file_name: image or table.

    Raises:
        error: neither is given, the list has another length, or the file cannot be read.
    """
    nx, ny = whole(rows), whole(columns)
    if data is None and file_name:
        return _read(client, text(file_name))
    if data is None:
        raise failure(
            FAILED,
            "a heightfield needs heightfieldData, numHeightfieldRows and numHeightfieldColumns, or fileName; "
            f"got heightfieldData={data!r}, fileName={file_name!r}",
        )
    heights = np.asarray(data, dtype=float).reshape(-1)
    if len(heights) != nx * ny:
        raise failure(
            "Size of heightfieldData doesn't match numHeightfieldColumns*numHeightfieldRows",
            f"got {len(heights)} heights for {nx} by {ny} points",
        )
    if min(nx, ny) < 2:
        raise failure(FAILED, f"a heightfield needs at least 2 by 2 points, got {nx} by {ny}")
    return heights.reshape(ny, nx)


def heightfield(points: Array, scale: Vector) -> tuple[Heightfield, float]:
    """Return the shape of (ny, nx) heights, and the scaled height (m) of its origin, halfway up its range."""
    dx, dy, dz = vector3(scale, FAILED)
    middle = dz * (points.min() + points.max()) / 2.0
    return Heightfield(heights=_turned(points * dz - middle), cell=(dy, dx)), float(middle)


def replace_heights(client: Client, terrain: Heightfield, points: Array, dz: float, middle: float) -> None:
    """Replace the heights of a shape, and of the bodies that use it; its origin stays.

    Args:
        client: client that owns the shape.
        terrain: shape.
        points: (ny, nx) unscaled heights.
        dz: scale of the heights.
        middle: scaled height of the origin (m).

    Raises:
        error: the number of points differs.
    """
    from roboyard.sim.terrain import set_heights

    turned = _turned(points * dz - middle)
    if turned.shape != terrain.heights.shape:
        ny, nx = terrain.heights.shape
        raise failure(
            FAILED, f"the heightfield has {nx} by {ny} points, got {turned.shape[1]} by {turned.shape[0]}"
        )
    set_heights(client.scene.world, terrain, turned)
    client.scene.frames_are_old = True


def _turned(grid: Array) -> Array:
    """Return (ny, nx) heights as the shape stores them, see `rotated_terrain_frame`."""
    turned = np.rot90(grid.T, k=-1).copy()
    turned.setflags(write=False)
    return turned


def _read(client: Client, name: str) -> Array:
    """Return (ny, nx) heights from a file: a table for .txt, else the red channel of an image (0 to 1)."""
    path = find_file(client.search.folder, name, client.mounts)
    if path is None:
        raise failure(FAILED, not_found_remedy(client.search.folder, name))
    points = _table(path) if path.suffix.lower() == ".txt" else _image(path)
    if min(points.shape) < 2 or points.size > _MAX_POINTS or not np.isfinite(points).all():
        raise failure(FAILED, f"{name}: expected at least 2 by 2 finite heights, got {points.shape}")
    return points


def _table(path: Path) -> Array:
    """Return (ny, nx) heights of a table of comma-separated numbers, each line a row of points along x.

    Bullet swaps the table's rows and columns: the numbers are transposed, then reshaped.
    """
    rows = []
    try:
        for line in read_file(path, _MAX_BYTES).decode("utf-8", "replace").splitlines():
            if line.strip(", \t"):
                rows.append([float(word) for word in line.split(",") if word.strip()])
        table = np.array(rows, dtype=float)
    except (OSError, ValueError) as problem:
        raise failure(
            FAILED, f"{path.name}: all lines must have the same number of numbers ({problem})"
        ) from None
    ny, nx = table.shape if table.ndim == 2 else (0, 0)
    return np.ascontiguousarray(table.T).reshape(ny, nx)


def _image(path: Path) -> Array:
    from PIL import Image, UnidentifiedImageError

    try:
        with Image.open(io.BytesIO(read_file(path, _MAX_BYTES))) as image:
            if image.width * image.height > _MAX_POINTS:
                raise failure(FAILED, f"{path.name}: {image.width} by {image.height} is too large")
            red = np.asarray(image.convert("RGB"))[:, :, 0]
    except (OSError, UnidentifiedImageError, Image.DecompressionBombError) as problem:
        raise failure(FAILED, f"{path.name}: not an image that can be read ({problem})") from None
    return red[:, ::-1] / 255.0
