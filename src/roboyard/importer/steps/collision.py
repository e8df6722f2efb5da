"""Collision shapes: keep the good ones, make hulls where there are none or where the visual mesh stands in.

Which way each link goes, first match: `no_collision_links`, `coacd_links`, `convex_links`,
`no_decompose_links`; else a link whose collision shape is a primitive, or a mesh other than its visual one,
keeps it, and the others get hulls by `decompose_method`. Links that a list forces get hulls of their visual
meshes; the others of their collision meshes where they have any.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from roboyard.description.model import Box, Capsule, Collision, Cylinder, Link, Mesh, Plane, Sphere, Visual
from roboyard.description.robot_model import RobotModel
from roboyard.export.mesh_files import write_obj
from roboyard.importer.context import ImportContext
from roboyard.shapes.convex.batch import decompose_many
from roboyard.shapes.convex.decomposition import Decomposition
from roboyard.shapes.load import load_mesh, scaled
from roboyard.shapes.mesh import TriangleMesh
from roboyard.transforms import Array

Way = Literal["none", "keep", "coacd", "convex"]
MAX_VERTICES = 60
"""Of a hull: what PhysX takes on a graphics card."""
TIME_BUDGET = 50.0
"""Seconds that an import may take on two cores; ten less than a minute, to spare on slower machines."""
REST, REST_OF_LINK = 4.0, 0.35
"""Seconds that everything but CoACD takes: for any robot, and for each of its links (spheres, files, trials
and pictures; measured on robots of 31 to 61 links with 44 000 to 460 000 triangles)."""
LEAST_SHARE = 0.2
"""Share of the budget that CoACD has in any case."""
INSIDE_TOLERANCE = 1e-4
"""Share of the larger hull's size by which a smaller one may stick out and still count as inside it."""


@dataclass(frozen=True, kw_only=True, slots=True)
class _Plan:
    """What happens to one link."""

    way: Way
    why: str
    sources: tuple[Visual | Collision, ...] = ()
    """Shapes that hulls are made of."""


def collision(robot: RobotModel, context: ImportContext) -> RobotModel:
    """Collision shapes as the configuration wants them; what each link really looks like goes to `solids`."""
    links = robot.description.links
    plans = {link.name: _plan(link, context) for link in links}
    hulls = _decompose(plans, context)
    facts: dict[str, object] = {}
    made: list[Link] = []
    solids: dict[str, tuple[Collision, ...]] = {}
    for link in links:
        plan = plans[link.name]
        solids[link.name] = _solid(link, plan)
        if plan.way == "none":
            new: tuple[Collision, ...] = ()
        elif plan.way == "keep":
            new = link.collisions
        else:
            new = _hull_shapes(link, plan, hulls, context)
        facts[link.name] = _facts(plan, new, hulls)
        made.append(replace(link, collisions=new))
    context.log.facts["collision"] = facts
    _summary(plans, context)
    description = replace(robot.description, links=tuple(made))
    return replace(robot, description=description, solids=solids)


def time_for_coacd(links: int) -> float:
    """Seconds after the import's beginning at which CoACD has to be done to leave the rest its time."""
    return max(TIME_BUDGET - REST - REST_OF_LINK * links, LEAST_SHARE * TIME_BUDGET)


def has_dedicated_collision(link: Link) -> bool:
    """True where a collision shape is a primitive, or a mesh file that no visual of the link uses."""
    seen = {v.geometry.path for v in link.visuals if isinstance(v.geometry, Mesh)}
    return any(
        not isinstance(c.geometry, Mesh) or (c.geometry.path is not None and c.geometry.path not in seen)
        for c in link.collisions
    )


def _plan(link: Link, context: ImportContext) -> _Plan:
    settings = context.config.collision
    if link.name in settings.no_collision_links:
        return _Plan(way="none", why="in no_collision_links")
    forced: tuple[tuple[Way, Sequence[str]], ...] = (
        ("coacd", settings.coacd_links),
        ("convex", settings.convex_links),
    )
    for way, names in forced:
        if link.name in names:
            sources = link.visuals or link.collisions
            return _Plan(way=way, why=f"in {way}_links", sources=sources)
    if link.name in settings.no_decompose_links:
        return _Plan(way="keep", why="in no_decompose_links")
    if not link.visuals and not link.collisions:
        return _Plan(way="keep", why="has no shapes")
    if has_dedicated_collision(link):
        return _Plan(way="keep", why="came with its own collision shapes")
    why = "collides as its visual mesh" if link.collisions else "has no collision shape"
    if settings.decompose_method is None:
        return _Plan(way="keep", why=f"{why}; decompose_method is null")
    return _Plan(way=settings.decompose_method, why=why, sources=link.collisions or link.visuals)


def _mesh_key(geometry: Mesh) -> tuple[object, ...]:
    return (geometry.path, geometry.scale)


def _decompose(
    plans: dict[str, _Plan], context: ImportContext
) -> dict[tuple[Way, tuple[object, ...]], Decomposition]:
    """Each mesh taken apart once per method."""
    found: dict[tuple[Way, tuple[object, ...]], Decomposition] = {}
    for way in ("convex", "coacd"):
        wanted: dict[tuple[object, ...], TriangleMesh] = {}
        for plan in plans.values():
            if plan.way != way:
                continue
            for shape in plan.sources:
                geometry = shape.geometry
                if isinstance(geometry, Mesh) and geometry.path is not None:
                    wanted[_mesh_key(geometry)] = scaled(load_mesh(geometry.path), geometry.scale)

        def progress(index: int, done: int, _: Decomposition, count: int = len(wanted)) -> None:
            context.log.tell(done / count, f"{done} of {count} meshes")

        results = decompose_many(
            list(wanted.values()),
            way,
            workers=context.workers,
            progress=progress,
            hull_count=context.config.collision.hull_count,
            max_vertices=MAX_VERTICES,
            total_limit=time_for_coacd(len(plans)) - (time.monotonic() - context.started),
        )
        for key, result in zip(wanted, results, strict=True):
            found[(way, key)] = result
    return found


def _hull_shapes(
    link: Link,
    plan: _Plan,
    hulls: dict[tuple[Way, tuple[object, ...]], Decomposition],
    context: ImportContext,
) -> tuple[Collision, ...]:
    kept: list[Collision] = []
    pieces: list[tuple[TriangleMesh, Visual | Collision]] = []
    for shape in plan.sources:
        geometry = shape.geometry
        if isinstance(geometry, Box | Sphere | Cylinder | Capsule | Plane):
            kept.append(Collision(geometry=geometry, origin=shape.origin))
        elif isinstance(geometry, Mesh) and geometry.path is not None:
            result = hulls[(plan.way, _mesh_key(geometry))]
            pieces += [(hull, shape) for hull in result.hulls]
            for note in result.notes:
                context.log.note(f"{geometry.path.name}: {note}", f'link "{link.name}"')
    dropped = redundant([_world(hull, shape) for hull, shape in pieces])
    if dropped:
        context.log.note(f"{len(dropped)} hulls inside others left out", f'link "{link.name}"')
    made = [piece for index, piece in enumerate(pieces) if index not in dropped]
    for index, (hull, shape) in enumerate(made):
        kept.append(hull_collision(link.name, index, hull, context, origin_of=shape))
    return tuple(kept)


def hull_collision(
    link: str, index: int, hull: TriangleMesh, context: ImportContext, *, origin_of: Visual | Collision
) -> Collision:
    """A collision shape whose mesh is written to `meshes/collision/<link>_col_<index>.obj`; `_` for `/`."""
    plain = link.replace("/", "_")
    name = f"{plain}_col_{index}"
    path = context.urdf_folder / "meshes" / "collision" / f"{name}.obj"
    while plain != link and path.exists():
        name = f"{name}_"
        path = path.with_stem(name)
    write_obj(hull, path, materials=True)
    uri = path.relative_to(context.urdf_folder).as_posix()
    return Collision(geometry=Mesh(uri=uri, path=path), origin=origin_of.origin, name=name)


def _world(hull: TriangleMesh, shape: Visual | Collision) -> Array:
    """(n, 3) vertices in the link's frame."""
    pose = shape.origin.matrix()
    return hull.vertices @ pose[:3, :3].T + pose[:3, 3]


def redundant(clouds: Sequence[Array]) -> set[int]:
    """Indices of convex point clouds that lie inside another one that stays."""
    from scipy.spatial import ConvexHull, QhullError

    order = sorted(range(len(clouds)), key=lambda i: -float(np.prod(np.ptp(clouds[i], axis=0))))
    stays: list[tuple[Array, float]] = []
    dropped: set[int] = set()
    for index in order:
        points = clouds[index]
        inside = any(
            (points @ planes[:, :3].T + planes[:, 3] <= INSIDE_TOLERANCE * size).all()
            for planes, size in stays
        )
        if inside:
            dropped.add(index)
            continue
        try:
            planes = np.asarray(ConvexHull(points).equations)
        except QhullError:
            continue
        stays.append((planes, float(np.ptp(points, axis=0).max())))
    return dropped


def _solid(link: Link, plan: _Plan) -> tuple[Collision, ...]:
    """Shapes that stand for the link's real form."""
    if plan.way == "none":
        return ()
    if link.collisions:
        return link.collisions
    return tuple(Collision(geometry=v.geometry, origin=v.origin) for v in link.visuals)


def _facts(
    plan: _Plan,
    shapes: tuple[Collision, ...],
    hulls: dict[tuple[Way, tuple[object, ...]], Decomposition],
) -> dict[str, object]:
    facts: dict[str, object] = {"way": plan.way, "why": plan.why, "shapes": len(shapes)}
    if plan.way in ("coacd", "convex"):
        meshes = [s.geometry for s in plan.sources if isinstance(s.geometry, Mesh) and s.geometry.path]
        used = [hulls[(plan.way, _mesh_key(geometry))] for geometry in meshes]
        facts["meshes"] = [
            {
                "file": geometry.path.name if geometry.path else geometry.uri,
                "method": result.method_used,
                "hulls": len(result.hulls),
                "excess_volume": _rounded(result.excess),
                "missing_volume": _rounded(result.missing),
                "deepest_mm": _rounded(result.deepest_mm),
                "seconds": round(result.seconds, 3),
                "cached": result.cached,
            }
            for geometry, result in zip(meshes, used, strict=True)
        ]
    return facts


def _rounded(value: float) -> float | None:
    return round(float(value), 4) if np.isfinite(value) else None


def _summary(plans: dict[str, _Plan], context: ImportContext) -> None:
    groups: dict[tuple[str, str], list[str]] = {}
    for name, plan in plans.items():
        groups.setdefault((plan.way, plan.why), []).append(name)
    words = {
        "none": "no collision",
        "keep": "kept as they are",
        "coacd": "CoACD hulls",
        "convex": "one hull a mesh",
    }
    for (way, why), names in groups.items():
        shown = ", ".join(names[:8]) + (f", ... ({len(names)} in all)" if len(names) > 8 else "")
        context.log.note(f"{words[way]}: {shown} ({why})")
