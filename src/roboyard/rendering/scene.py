"""`RenderScene`: shapes fixed to frames, collected once for each compile of a world."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import field

import numpy as np

from roboyard._arrays import NDArray
from roboyard._records import dataclass
from roboyard.shapes.mesh import TriangleMesh


@dataclass(frozen=True, kw_only=True, eq=False)
class RenderShape:
    """One mesh fixed to one frame."""

    mesh: TriangleMesh
    """Vertices and faces (m)."""
    scale: tuple[float, float, float] = (1.0, 1.0, 1.0)
    """Factors along the axes of the mesh."""
    position: NDArray[np.float64]
    """(3,) position of the mesh in its frame (m)."""
    rotation: NDArray[np.float64]
    """(3, 3) rotation of the mesh in its frame."""
    frame: int
    """Row of the frame arrays given at render time (in a world: the MuJoCo body)."""
    owner: tuple[int, int]
    """Body id and link index written to the segmentation image."""
    rgba: tuple[float, float, float, float] = (0.7, 0.7, 0.7, 1.0)
    """RGBA, each 0 to 1; multiplied with the mesh's own colours or texture if it has any."""
    use_mesh_colors: bool = True
    """False where the description's own material overrides the mesh file's."""
    checker: tuple[tuple[float, float, float], float] | None = None
    """Second colour and square size (m) of a checkerboard over the shape's x-y plane; None: plain."""
    texture: NDArray[np.uint8] | None = None
    """(h, w, 4) image that replaces the mesh's own texture."""
    specular: float = 0.2
    """Strength of the highlight, 0 to 1."""
    infinite: bool = False
    """Whether the mesh, flat in its own x-y plane, represents the whole of that plane (a floor)."""


@dataclass(frozen=True, kw_only=True, eq=False)
class DebugLines:
    """Line segments in world coordinates, drawn with depth."""

    start: NDArray[np.float64]
    """(k, 3) first end in the world frame (m)."""
    end: NDArray[np.float64]
    """(k, 3) second end in the world frame (m)."""
    rgb: NDArray[np.float64]
    """(k, 3) colour, 0 to 1."""
    width: NDArray[np.float64]
    """(k,) width (pixels)."""


def lines_as_arrays(
    lines: DebugLines, scale: float
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Return (k, 3) starts and ends (m), (k, 3) RGB and (k,) widths times `scale` (pixels) for the kernels.

    Raises ValueError where their numbers differ.
    """
    start, end = (np.ascontiguousarray(a, dtype=float).reshape(-1, 3) for a in (lines.start, lines.end))
    rgb = np.clip(np.ascontiguousarray(lines.rgb, dtype=float).reshape(-1, 3), 0.0, 1.0)
    width = scale * np.ascontiguousarray(lines.width, dtype=float).ravel()
    if not len(start) == len(end) == len(rgb) == len(width):
        raise ValueError(
            f"lines need as many starts ({len(start)}) as ends ({len(end)}), colours ({len(rgb)}) and widths "
            f"({len(width)})"
        )
    return start, end, rgb, width


@dataclass(kw_only=True, eq=False)
class RenderScene:
    """All shapes of a world; `revision` changes with `shapes`, so that back ends can cache."""

    shapes: Sequence[RenderShape] = ()
    revision: int = 0
    lines: DebugLines | None = None
    background: tuple[float, float, float] = (1.0, 1.0, 1.0)
    extra: dict[str, object] = field(default_factory=dict)
    """Caches of the back ends, by name of the back end."""
