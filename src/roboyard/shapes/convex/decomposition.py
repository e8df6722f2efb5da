"""Convex collision shapes of any mesh: one convex hull where it fits closely, else several.

The convex hull is tried first; a voxel grid measures its volume outside the solid. Where that is too much the
mesh is decomposed, by CoACD in a child process or, where CoACD is not installed, fails, exceeds its time
limit or fits clearly worse, by Roboyard's own box splitter. Results are cached by the hash of mesh and
settings.
"""

from __future__ import annotations

import json
import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from roboyard.errors import ConfigError, install_command, unknown_name
from roboyard.shapes.cache import content_key, load_arrays, store_arrays
from roboyard.shapes.convex import coacd_process
from roboyard.shapes.convex.box_splitter import split_convex
from roboyard.shapes.convex.hulls import Hull, HullFit, convex_hull, measure_hulls
from roboyard.shapes.mesh import TriangleMesh, read_only
from roboyard.shapes.voxels.grid import VoxelGrid, voxelize

Method = Literal["coacd", "split", "convex"]
METHODS = ("coacd", "split", "convex")
"""As of `decompose`."""
VERSION = 2
"""Part of the cache key; raise it when the same mesh and settings give different hulls."""
TIGHT_EXCESS = 0.10
"""Excess of a single hull below which it is kept."""
TIGHT_RATIO = 0.90
"""Solid volume / hull volume above which a single hull is kept."""
WORTH_PARTS = 0.9
"""Excess of the parts / excess of the single hull above which the single hull is kept."""
CLEARLY = (0.8, 0.1)
"""Own parts replace CoACD's where their excess is below this share of CoACD's, and lower by at least this."""
TIME_LIMIT = 10.0
"""Time limit of CoACD for a mesh (s): longer runs seldom end, and fit no closer."""
SHELL_SHARE = 0.5
"""Share of voxels too thin to have an inside above which a mesh counts as an open shell."""


@dataclass(frozen=True, slots=True)
class Settings:
    """Settings of a decomposition; fields as the arguments of `decompose`.

    Raises:
        ConfigError: an unknown method, or a limit below what a hull needs.
    """

    method: Method | None = "coacd"
    hull_count: int = 8
    max_vertices: int = 60
    time_limit: float = TIME_LIMIT
    use_cache: bool = True

    def __post_init__(self) -> None:
        """Check the values."""
        if self.method is not None and self.method not in METHODS:
            raise ConfigError(unknown_name("decomposition method", self.method, METHODS))
        if self.hull_count < 1:
            raise ConfigError(f"hull_count {self.hull_count}: must be at least 1")
        if self.max_vertices < 4:
            raise ConfigError(f"max_vertices {self.max_vertices}: a hull has at least 4")


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class PendingDecomposition:
    """A mesh with its hull and own parts, for which CoACD has yet to run."""

    mesh: TriangleMesh
    """The mesh (m)."""
    key: str
    """Key of the cache."""
    grid: VoxelGrid
    """Its voxel grid."""
    single: tuple[Hull, HullFit]
    """Its convex hull."""
    own: tuple[list[Hull], HullFit]
    """Parts of the box splitter."""
    notes: tuple[str, ...]
    """Warnings so far."""
    seconds: float
    """Time spent so far (s)."""

    @property
    def excess_volume(self) -> float:
        """Volume of the own parts outside the solid (m³), which CoACD may reduce."""
        return self.own[1].excess * self.grid.volume


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Decomposition:
    """Convex parts of one mesh and how well they approximate it; volumes are shares of the solid's."""

    hulls: tuple[TriangleMesh, ...]
    """Closed convex meshes, wound outwards, in the mesh's frame (m)."""
    excess: float
    """Volume of the hulls' union outside the solid."""
    missing: float
    """Volume of the solid outside every hull."""
    deepest_mm: float
    """Largest distance of the union's surface outside the solid (mm)."""
    method_used: str
    """"hull" (one hull), "coacd", "split" (Roboyard's own) or "none"."""
    seconds: float
    """Time spent (s); 0 from the cache."""
    notes: tuple[str, ...] = ()
    """Warnings about the mesh, and deviations from the requested method."""
    cached: bool = False
    """Whether the result is from the cache."""


def decompose(
    mesh: TriangleMesh,
    method: Method | None = "coacd",
    *,
    hull_count: int = 8,
    max_vertices: int = 60,
    time_limit: float = TIME_LIMIT,
    use_cache: bool = True,
    stop: Callable[[], bool] = lambda: False,
    deadline: float = math.inf,
) -> Decomposition:
    """Return convex collision shapes of one mesh; succeeds for every mesh with a finite vertex.

    Args:
        mesh: any triangles, open or closed (m).
        method: "coacd" (falls back to "split", with a note), "split" (the box splitter), "convex" (one hull),
            or None for no shapes at all.
        hull_count: most hulls.
        max_vertices: most vertices of a hull.
        time_limit: time limit of CoACD (s).
        use_cache: store results on disk and reuse them.
        stop: called regularly; True ends the work early with the present parts of the splitter.
        deadline: `time.monotonic()` at which CoACD is ended in any case (s).

    Raises:
        ConfigError: an unknown method, or a limit below what a hull needs.
        MeshError: the mesh has no finite vertex.
    """
    settings = Settings(method, hull_count, max_vertices, time_limit, use_cache)
    pending = start_decomposition(mesh, settings, stop)
    return (
        pending
        if isinstance(pending, Decomposition)
        else wait_decomposition(pending, settings, stop, deadline)
    )


def start_decomposition(
    mesh: TriangleMesh, settings: Settings, stop: Callable[[], bool] = lambda: False
) -> Decomposition | PendingDecomposition:
    """Do all that needs no CoACD; return the result if CoACD is not needed or the result is cached.

    Raises:
        MeshError: the mesh has no finite vertex.
    """
    method, vertices = settings.method, settings.max_vertices
    if method is None:
        return Decomposition(
            hulls=(), excess=0.0, missing=1.0, deepest_mm=0.0, method_used="none", seconds=0.0
        )
    key = content_key(
        mesh.vertices, mesh.faces, method, settings.hull_count, vertices, settings.time_limit, VERSION
    )
    if settings.use_cache and (known := _from_cache(key)) is not None:
        return known
    started = time.perf_counter()
    grid = voxelize(mesh, fill_cavities=True)
    single = convex_hull(mesh, vertices)
    fit = measure_hulls([single.mesh], grid)
    notes = [*grid.notes, *single.notes]
    tight = fit.excess < TIGHT_EXCESS or grid.volume > TIGHT_RATIO * single.volume
    parts: list[Hull] = [single]
    parts_fit, needs_coacd, cacheable = fit, False, True
    if method != "convex" and settings.hull_count > 1 and not tight:
        parts = split_convex(mesh, grid, settings.hull_count, vertices, stop=stop)
        parts_fit = measure_hulls([hull.mesh for hull in parts], grid)
        needs_coacd, cacheable = _needs_coacd(method, grid, notes)
    pending = PendingDecomposition(
        mesh=mesh,
        key=key,
        grid=grid,
        single=(single, fit),
        own=(parts, parts_fit),
        notes=tuple(notes),
        seconds=time.perf_counter() - started,
    )
    return (
        pending
        if needs_coacd
        else _finished(pending, settings, parts, parts_fit, "split", notes, stop, cacheable)
    )


def _needs_coacd(method: str, grid: VoxelGrid, notes: list[str]) -> tuple[bool, bool]:
    """Return whether to run CoACD, and whether the result may be cached (not without coacd installed)."""
    if method != "coacd":
        return False, True
    if grid.thin.sum() > SHELL_SHARE * grid.solid.sum():
        notes.append("open shell: split without coacd, which needs a closed inside")
        return False, True
    if not coacd_process.is_installed():
        notes.append(f"split without coacd, which is not installed: {install_command('convex')}")
        return False, False
    return True, True


def wait_decomposition(
    pending: PendingDecomposition,
    settings: Settings,
    stop: Callable[[], bool] = lambda: False,
    deadline: float = math.inf,
) -> Decomposition:
    """Run CoACD and return its parts or the box splitter's; arguments as of `decompose`."""
    since = time.perf_counter()
    notes = list(pending.notes)
    (parts, fit), used = pending.own, "split"
    try:
        allowed = min(settings.time_limit, deadline - time.monotonic())
        clouds = coacd_process.run_coacd(pending.mesh, settings.hull_count, allowed, stop)
    except coacd_process.CoacdFailedError as error:
        notes.append(f"split without coacd: {error}")
    else:
        theirs = [convex_hull(cloud, settings.max_vertices) for cloud in clouds]
        their_fit = measure_hulls([hull.mesh for hull in theirs], pending.grid)
        if fit.excess < min(CLEARLY[0] * their_fit.excess, their_fit.excess - CLEARLY[1]):
            notes.append(
                f"box splitter's parts kept: excess {fit.excess:.2f}, coacd's {their_fit.excess:.2f}"
            )
        else:
            parts, fit, used = theirs, their_fit, "coacd"
    pending = replace(pending, seconds=pending.seconds + time.perf_counter() - since)
    return _finished(pending, settings, parts, fit, used, notes, stop, True)


def _finished(
    pending: PendingDecomposition,
    settings: Settings,
    parts: list[Hull],
    fit: HullFit,
    used: str,
    notes: list[str],
    stop: Callable[[], bool],
    cacheable: bool,
) -> Decomposition:
    """Return the parts, or the single hull where they fit no closer; store the result if cacheable."""
    single, single_fit = pending.single
    if len(parts) == 1 or fit.excess > WORTH_PARTS * single_fit.excess:
        if parts != [single]:
            notes.append("parts fit the mesh no closer: one hull kept")
        parts, fit, used = [single], single_fit, "hull"
    made = replace(_result(parts, fit, used, notes), seconds=pending.seconds)
    if settings.use_cache and cacheable and not stop():
        store_arrays("hulls", pending.key, _to_arrays(made))
    return made


def _result(hulls: Sequence[Hull], fit: HullFit, used: str, notes: Sequence[str]) -> Decomposition:
    lost = max(hull.lost for hull in hulls)
    messages = [*notes, *(note for hull in hulls for note in hull.notes)]
    if lost > 0.05:
        messages.append(f"vertex limit gave up {lost:.0%} of a hull's volume")
    return Decomposition(
        hulls=tuple(hull.mesh for hull in hulls),
        excess=fit.excess,
        missing=fit.missing,
        deepest_mm=fit.deepest_mm,
        method_used=used,
        seconds=0.0,
        notes=tuple(dict.fromkeys(messages)),
    )


def _to_arrays(made: Decomposition) -> dict[str, np.ndarray]:
    about = {
        "excess": made.excess,
        "missing": made.missing,
        "deepest_mm": made.deepest_mm,
        "method_used": made.method_used,
        "notes": made.notes,
    }
    arrays: dict[str, np.ndarray] = {"about": np.array(json.dumps(about))}
    for index, hull in enumerate(made.hulls):
        arrays[f"vertices{index}"], arrays[f"faces{index}"] = hull.vertices, hull.faces
    return arrays


def _from_cache(key: str) -> Decomposition | None:
    arrays = load_arrays("hulls", key)
    if arrays is None:
        return None
    try:
        about = json.loads(str(arrays["about"]))
        hulls = tuple(
            TriangleMesh(
                vertices=read_only(arrays[f"vertices{index}"], np.float64),
                faces=read_only(arrays[f"faces{index}"], np.int32),
            )
            for index in range((len(arrays) - 1) // 2)
        )
        return Decomposition(
            hulls=hulls,
            excess=float(about["excess"]),
            missing=float(about["missing"]),
            deepest_mm=float(about["deepest_mm"]),
            method_used=str(about["method_used"]),
            seconds=0.0,
            notes=tuple(about["notes"]),
            cached=True,
        )
    except (KeyError, ValueError, TypeError):
        return None
