"""Collision shapes from any mesh: one convex hull where that is close, else a few.

The hull comes first; a voxel grid says how much of it is air. Only where that is too much is the mesh taken
apart, by CoACD in a child process or, where CoACD is absent, fails, runs over time or hugs the mesh clearly
less closely, by Roboyard's own splitter. Results are cached under the hash of mesh and settings.
"""

from __future__ import annotations

import functools
import json
import math
import threading
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from roboyard.errors import ConfigError, unknown_name
from roboyard.shapes import coacd_process
from roboyard.shapes.cache import content_key, load_arrays, store_arrays
from roboyard.shapes.hulls import Hull, HullFit, convex_hull, measure_hulls
from roboyard.shapes.mesh import TriangleMesh, read_only
from roboyard.shapes.splitter import split_convex
from roboyard.shapes.voxels import VoxelGrid, voxelize

Method = Literal["coacd", "split", "convex"]
METHODS = ("coacd", "split", "convex")
VERSION = 2
"""Raised when the same mesh and settings give other hulls than before."""
TIGHT_EXCESS = 0.10
"""Excess of a single hull below which it is kept."""
TIGHT_RATIO = 0.90
"""Solid volume / hull volume above which a single hull is kept."""
WORTH_PARTS = 0.9
"""Excess of the parts / excess of the single hull above which the parts are not worth having."""
CLEARLY = (0.8, 0.1)
"""Own parts replace CoACD's where their excess is below this share of CoACD's, and lower by at least this."""
TIME_LIMIT = 10.0
"""Seconds that CoACD may take for a mesh: what is not done by then seldom ends, and hugs no closer."""
TOTAL_LIMIT = 35.0
"""Seconds that all runs of CoACD may take for a robot; the meshes left then go to the splitter."""
SHELL_SHARE = 0.5
"""Share of voxels too thin to have an inside above which a mesh counts as an open shell."""


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Decomposition:
    """Convex parts of one mesh and how well they stand for it. Volumes are shares of the solid's."""

    hulls: tuple[TriangleMesh, ...]
    """Closed, convex, wound outwards; m, in the mesh's frame."""
    excess: float
    """Volume of the hulls' union outside the solid."""
    missing: float
    """Volume of the solid outside every hull."""
    deepest_mm: float
    """Farthest that the union reaches out of the solid."""
    method_used: str
    """"hull" (one hull), "coacd", "split" (Roboyard's own) or "none"."""
    seconds: float
    """Time it took; 0 from the cache."""
    notes: tuple[str, ...] = ()
    """What was unusual, and what was done instead of what was asked."""
    cached: bool = False


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
    """Convex collision shapes of one mesh; never fails on a mesh with a finite vertex.

    Args:
        mesh: any triangles, open or closed; m.
        method: "coacd" (falls back to "split", with a note), "split" (Roboyard's own), "convex" (one hull),
            or None for no shapes at all.
        hull_count: most hulls.
        max_vertices: most vertices of a hull.
        time_limit: seconds that CoACD may take.
        use_cache: keep results on disk and take them from there.
        stop: asked now and then; True ends the work early, with what the splitter has by then.
        deadline: `time.monotonic()` at which CoACD has to be done, whatever the time limit says.

    Raises:
        ConfigError: an unknown method, or a limit below what a hull needs.
        MeshError: the mesh has no finite vertex.
    """
    _check(method, hull_count, max_vertices)
    if method is None:
        return Decomposition(
            hulls=(), excess=0.0, missing=1.0, deepest_mm=0.0, method_used="none", seconds=0.0
        )
    key = content_key(mesh.vertices, mesh.faces, method, hull_count, max_vertices, time_limit, VERSION)
    if use_cache and (known := _from_cache(key)) is not None:
        return known
    begin = time.perf_counter()
    allowed = min(time_limit, deadline - time.monotonic())
    made, lasting = _compute(mesh, method, hull_count, max_vertices, allowed, stop)
    made = replace(made, seconds=time.perf_counter() - begin)
    if use_cache and lasting and not stop():
        store_arrays("hulls", key, _to_arrays(made))
    return made


def decompose_many(
    meshes: Sequence[TriangleMesh],
    method: Method | None = "coacd",
    *,
    workers: int = 2,
    progress: Callable[[int, int, Decomposition], None] | None = None,
    hull_count: int = 8,
    max_vertices: int = 60,
    time_limit: float = TIME_LIMIT,
    total_limit: float = TOTAL_LIMIT,
    use_cache: bool = True,
) -> list[Decomposition]:
    """`decompose` for several meshes, in their order, `workers` at a time, the largest first.

    Args:
        total_limit: seconds after which CoACD is not asked any more.
        progress: called after each as (index of the mesh, how many are done, its result), from this thread.

    An interrupt ends the child processes before it goes on.
    """
    stopped = threading.Event()
    results: dict[int, Decomposition] = {}
    deadline = time.monotonic() + total_limit

    def work(mesh: TriangleMesh) -> Decomposition:
        return decompose(
            mesh,
            method,
            hull_count=hull_count,
            max_vertices=max_vertices,
            time_limit=time_limit,
            use_cache=use_cache,
            stop=stopped.is_set,
            deadline=deadline,
        )

    with ThreadPoolExecutor(max_workers=max(1, workers), thread_name_prefix="decompose") as pool:
        order = sorted(range(len(meshes)), key=lambda index: -len(meshes[index].faces))
        futures = {pool.submit(work, meshes[index]): index for index in order}
        try:
            for future in as_completed(futures):
                index = futures[future]
                results[index] = future.result()
                if progress is not None:
                    progress(index, len(results), results[index])
        except BaseException:
            stopped.set()
            pool.shutdown(wait=True, cancel_futures=True)
            raise
    return [results[index] for index in range(len(meshes))]


def _check(method: str | None, hull_count: int, max_vertices: int) -> None:
    if method is not None and method not in METHODS:
        raise ConfigError(unknown_name("decomposition method", method, METHODS))
    if hull_count < 1:
        raise ConfigError(f"hull_count {hull_count}: give at least 1")
    if max_vertices < 4:
        raise ConfigError(f"max_vertices {max_vertices}: a hull has at least 4")


def _compute(
    mesh: TriangleMesh,
    method: Method,
    hull_count: int,
    max_vertices: int,
    time_limit: float,
    stop: Callable[[], bool],
) -> tuple[Decomposition, bool]:
    """The parts, and whether they are worth keeping (without coacd installed they are not)."""
    grid = voxelize(mesh, fill_cavities=True)
    single = convex_hull(mesh, max_vertices)
    fit = measure_hulls([single.mesh], grid)
    notes = [*grid.notes, *single.notes]
    tight = fit.excess < TIGHT_EXCESS or grid.volume > TIGHT_RATIO * single.volume
    if method == "convex" or hull_count == 1 or tight:
        return _result([single], fit, "hull", notes), True
    hulls, used, lasting = _take_apart(mesh, grid, method, hull_count, max_vertices, time_limit, stop, notes)
    parts = measure_hulls([hull.mesh for hull in hulls], grid)
    if len(hulls) == 1 or parts.excess > WORTH_PARTS * fit.excess:
        notes.append("parts hug the mesh no closer: one hull kept")
        return _result([single], fit, "hull", notes), lasting
    return _result(hulls, parts, used, notes), lasting


def _take_apart(
    mesh: TriangleMesh,
    grid: VoxelGrid,
    method: Method,
    hull_count: int,
    max_vertices: int,
    time_limit: float,
    stop: Callable[[], bool],
    notes: list[str],
) -> tuple[list[Hull], str, bool]:
    own = functools.partial(split_convex, mesh, grid, hull_count, max_vertices, stop=stop)
    if method != "coacd":
        return own(), "split", True
    if grid.thin.sum() > SHELL_SHARE * grid.solid.sum():
        notes.append("open shell: split without coacd, which has no inside to work on")
        return own(), "split", True
    if not coacd_process.is_installed():
        notes.append('split without coacd, which is not installed: pip install "roboyard[convex]"')
        return own(), "split", False
    try:
        clouds = coacd_process.run_coacd(mesh, hull_count, time_limit, stop)
    except coacd_process.CoacdFailedError as error:
        notes.append(f"split without coacd: {error}")
        return own(), "split", True
    theirs, ours = [convex_hull(cloud, max_vertices) for cloud in clouds], own()
    their_excess, our_excess = (
        measure_hulls([h.mesh for h in hulls], grid).excess for hulls in (theirs, ours)
    )
    if our_excess < min(CLEARLY[0] * their_excess, their_excess - CLEARLY[1]):
        notes.append(f"own parts kept: excess {our_excess:.2f}, coacd's {their_excess:.2f}")
        return ours, "split", True
    return theirs, "coacd", True


def _result(hulls: Sequence[Hull], fit: HullFit, used: str, notes: Sequence[str]) -> Decomposition:
    lost = max(hull.lost for hull in hulls)
    said = [*notes, *(note for hull in hulls for note in hull.notes)]
    if lost > 0.05:
        said.append(f"vertex limit gave up {lost:.0%} of a hull's volume")
    return Decomposition(
        hulls=tuple(hull.mesh for hull in hulls),
        excess=fit.excess,
        missing=fit.missing,
        deepest_mm=fit.deepest_mm,
        method_used=used,
        seconds=0.0,
        notes=tuple(dict.fromkeys(said)),
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
