"""Collision shapes: kept where they are usable, else convex hulls.

The method of each link is the first that matches: `no_collision_links`, `coacd_links`, `convex_links`,
`no_decompose_links`; else a link whose collision shape is a primitive, or a mesh other than its visual one,
keeps it, and the others get hulls by `decompose_method`. Links in `coacd_links` and `convex_links` get hulls
of their visual meshes; the others of their collision meshes where they have any.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from roboyard.description.model import Box, Capsule, Collision, Cylinder, Link, Mesh, Plane, Sphere, Visual
from roboyard.description.robot_model import RobotModel
from roboyard.importer.context import ImportContext
from roboyard.shapes.convex.batch import decompose_many
from roboyard.shapes.convex.decomposition import Decomposition
from roboyard.shapes.load import load_mesh, scaled
from roboyard.shapes.mesh import TriangleMesh
from roboyard.shapes.mesh_files import write_obj
from roboyard.transforms import Array

Method = Literal["none", "keep", "coacd", "convex"]
MAX_VERTICES = 60
"""Most vertices of a hull: the limit of PhysX on a GPU."""
TIME_BUDGET = 50.0
"""Time for an import on two cores (s): ten seconds below a minute, as a reserve for slower machines."""
REST, REST_OF_LINK = 4.0, 0.35
"""Time of all steps but CoACD (s): for any robot, and for each link (spheres, files, validation and pictures;
measured on robots of 31 to 61 links with 44 000 to 460 000 triangles).
"""
LEAST_SHARE = 0.2
"""Smallest share of the time that CoACD gets."""
INSIDE_TOLERANCE = 1e-4
"""Share of the larger hull's size by which a smaller one may protrude and still count as inside."""


@dataclass(frozen=True, kw_only=True, slots=True)
class _Plan:
    """Method for one link's collision shapes."""

    method: Method
    why: str
    sources: tuple[Visual | Collision, ...] = ()
    """Shapes from which hulls are made."""


def make_collision_shapes(robot: RobotModel, context: ImportContext) -> RobotModel:
    """Return the robot with its configured collision shapes, and each link's original form in `solids`."""
    links = robot.description.links
    plans = {link.name: _plan(link, context) for link in links}
    hulls = _decompose(plans, context)
    facts: dict[str, object] = {}
    made: list[Link] = []
    solids: dict[str, tuple[Collision, ...]] = {}
    for link in links:
        plan = plans[link.name]
        solids[link.name] = _solid(link, plan)
        if plan.method == "none":
            new: tuple[Collision, ...] = ()
        elif plan.method == "keep":
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
    """Return the time after the start of an import by which CoACD must be done (s)."""
    return max(TIME_BUDGET - REST - REST_OF_LINK * links, LEAST_SHARE * TIME_BUDGET)


def has_dedicated_collision(link: Link) -> bool:
    """Return whether a collision shape is a primitive, or a mesh file that no visual of the link uses."""
    seen = {v.geometry.path for v in link.visuals if isinstance(v.geometry, Mesh)}
    return any(
        not isinstance(c.geometry, Mesh) or (c.geometry.path is not None and c.geometry.path not in seen)
        for c in link.collisions
    )


def _plan(link: Link, context: ImportContext) -> _Plan:
    settings = context.config.collision
    if link.name in settings.no_collision_links:
        return _Plan(method="none", why="in no_collision_links")
    forced: tuple[tuple[Method, Sequence[str]], ...] = (
        ("coacd", settings.coacd_links),
        ("convex", settings.convex_links),
    )
    for method, names in forced:
        if link.name in names:
            sources = link.visuals or link.collisions
            return _Plan(method=method, why=f"in {method}_links", sources=sources)
    if link.name in settings.no_decompose_links:
        return _Plan(method="keep", why="in no_decompose_links")
    if not link.visuals and not link.collisions:
        return _Plan(method="keep", why="has no shapes")
    if has_dedicated_collision(link):
        return _Plan(method="keep", why="has collision shapes of its own")
    why = "collides as its visual mesh" if link.collisions else "has no collision shape"
    if settings.decompose_method is None:
        return _Plan(method="keep", why=f"{why}; decompose_method is null")
    return _Plan(method=settings.decompose_method, why=why, sources=link.collisions or link.visuals)


def _mesh_key(geometry: Mesh) -> tuple[object, ...]:
    return (geometry.path, geometry.scale)


def _decompose(
    plans: dict[str, _Plan], context: ImportContext
) -> dict[tuple[Method, tuple[object, ...]], Decomposition]:
    """Decompose each mesh once per method."""
    found: dict[tuple[Method, tuple[object, ...]], Decomposition] = {}
    for method in ("convex", "coacd"):
        meshes: dict[tuple[object, ...], TriangleMesh] = {}
        for plan in plans.values():
            if plan.method != method:
                continue
            for shape in plan.sources:
                geometry = shape.geometry
                if isinstance(geometry, Mesh) and geometry.path is not None:
                    meshes[_mesh_key(geometry)] = scaled(load_mesh(geometry.path), geometry.scale)

        def progress(index: int, done: int, _: Decomposition, count: int = len(meshes)) -> None:
            context.log.report_progress(done / count, f"{done} of {count} meshes")

        results = decompose_many(
            list(meshes.values()),
            method,
            workers=context.workers,
            progress=progress,
            hull_count=context.config.collision.hull_count,
            max_vertices=MAX_VERTICES,
            total_limit=time_for_coacd(len(plans)) - (time.monotonic() - context.started),
        )
        for key, result in zip(meshes, results, strict=True):
            found[(method, key)] = result
    return found


def _hull_shapes(
    link: Link,
    plan: _Plan,
    hulls: dict[tuple[Method, tuple[object, ...]], Decomposition],
    context: ImportContext,
) -> tuple[Collision, ...]:
    kept: list[Collision] = []
    pieces: list[tuple[TriangleMesh, Visual | Collision]] = []
    for shape in plan.sources:
        geometry = shape.geometry
        if isinstance(geometry, Box | Sphere | Cylinder | Capsule | Plane):
            kept.append(Collision(geometry=geometry, origin=shape.origin))
        elif isinstance(geometry, Mesh) and geometry.path is not None:
            result = hulls[(plan.method, _mesh_key(geometry))]
            pieces += [(hull, shape) for hull in result.hulls]
            for note in result.notes:
                context.log.note(f"{geometry.path.name}: {note}", f'link "{link.name}"')
    dropped = redundant([_world(hull, shape) for hull, shape in pieces])
    if dropped:
        context.log.note(f"{len(dropped)} hulls inside others skipped", f'link "{link.name}"')
    made = [piece for index, piece in enumerate(pieces) if index not in dropped]
    for index, (hull, shape) in enumerate(made):
        kept.append(hull_collision(link.name, index, hull, context, origin_of=shape))
    return tuple(kept)


def hull_collision(
    link: str, index: int, hull: TriangleMesh, context: ImportContext, *, origin_of: Visual | Collision
) -> Collision:
    """Write a hull to `meshes/collision/<link>_col_<index>.obj` (`_` for `/`), and return the collision
    shape.
    """
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
    """Return the (n, 3) vertices of a hull in the link's frame (m)."""
    pose = shape.origin.matrix()
    return hull.vertices @ pose[:3, :3].T + pose[:3, 3]


def redundant(clouds: Sequence[Array]) -> set[int]:
    """Return the indices of clouds whose convex hull is inside that of another cloud that is kept.

    Args:
        clouds: (n, 3) points each (m).
    """
    from roboyard._qhull import qhull

    ConvexHull, QhullError = qhull()

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
    """Return the shapes nearest to the link's real form."""
    if plan.method == "none":
        return ()
    if link.collisions:
        return link.collisions
    return tuple(Collision(geometry=v.geometry, origin=v.origin) for v in link.visuals)


def _facts(
    plan: _Plan,
    shapes: tuple[Collision, ...],
    hulls: dict[tuple[Method, tuple[object, ...]], Decomposition],
) -> dict[str, object]:
    facts: dict[str, object] = {"method": plan.method, "why": plan.why, "shapes": len(shapes)}
    if plan.method in ("coacd", "convex"):
        meshes = [s.geometry for s in plan.sources if isinstance(s.geometry, Mesh) and s.geometry.path]
        used = [hulls[(plan.method, _mesh_key(geometry))] for geometry in meshes]
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
        groups.setdefault((plan.method, plan.why), []).append(name)
    words = {
        "none": "no collision",
        "keep": "unchanged",
        "coacd": "CoACD hulls",
        "convex": "one hull per mesh",
    }
    for (method, why), names in groups.items():
        shown = ", ".join(names[:8]) + (f", ... ({len(names)} in all)" if len(names) > 8 else "")
        context.log.note(f"{words[method]}: {shown} ({why})")
