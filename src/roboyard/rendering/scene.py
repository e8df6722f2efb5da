"""What there is to draw: shapes fixed to frames, gathered once for each compile of a world."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from roboyard.shapes.mesh import TriangleMesh


@dataclass(frozen=True, kw_only=True, eq=False)
class RenderShape:
    """One mesh fixed to one frame."""

    mesh: TriangleMesh
    scale: tuple[float, float, float] = (1.0, 1.0, 1.0)
    position: NDArray[np.float64]
    """(3,) of the mesh in its frame; m"""
    rotation: NDArray[np.float64]
    """(3, 3) of the mesh in its frame."""
    frame: int
    """Row of the frame arrays given at render time (in a world: the MuJoCo body)."""
    owner: tuple[int, int]
    """Body id and link index written to the segmentation image."""
    rgba: tuple[float, float, float, float] = (0.7, 0.7, 0.7, 1.0)
    """Multiplies the mesh's own colours or texture where it has any."""
    use_mesh_colors: bool = True
    """False where the description's own material overrides the mesh file's."""
    checker: tuple[tuple[float, float, float], float] | None = None
    """Second colour and square size (m) of a checkerboard over the shape's x-y plane; None: plain."""
    texture: NDArray[np.uint8] | None = None
    """(h, w, 4) image that replaces the mesh's own."""
    specular: float = 0.2
    """0 to 1"""
    infinite: bool = False
    """The mesh is a flat piece of its own x-y plane and stands for all of that plane (a floor)."""


@dataclass(frozen=True, kw_only=True, eq=False)
class DebugLines:
    """Line segments in world coordinates, drawn with depth."""

    start: NDArray[np.float64]
    """(k, 3) m"""
    end: NDArray[np.float64]
    """(k, 3) m"""
    rgb: NDArray[np.float64]
    """(k, 3) 0 to 1"""
    width: NDArray[np.float64]
    """(k,) pixels"""


def lines_as_arrays(
    lines: DebugLines, scale: float
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Start, end, rgb and `scale` times width for kernels; raises ValueError where they do not fit."""
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
    """All shapes of a world; `revision` changes whenever `shapes` does, so that back ends can cache."""

    shapes: Sequence[RenderShape] = ()
    revision: int = 0
    lines: DebugLines | None = None
    background: tuple[float, float, float] = (1.0, 1.0, 1.0)
    extra: dict[str, object] = field(default_factory=dict)
    """Room for a back end's cache, keyed by the back end's name."""
