"""Collision shapes that are missing, unsuitable or overlapping."""

from __future__ import annotations

from itertools import combinations

import numpy as np

from roboyard.audit.findings import INFO, WARNING
from roboyard.audit.registry import Fault, Faults, check
from roboyard.audit.solids import hulls_meet, shape_points
from roboyard.description.urdf.elements import LinkElement
from roboyard.description.urdf.numbers import Location
from roboyard.description.urdf.parse import UrdfElements
from roboyard.description.urdf.xml import line_of
from roboyard.transforms import Array

SHRINK = 0.9
"""Shapes overlap when they still do at this size, so that neighbours that merely touch are not reported."""
MAX_LISTED = 12
MAX_TESTS = 3000


@check(
    "collision-none",
    WARNING,
    remedy="add collision shapes; the importer makes hulls of the visual meshes",
    example="(visuals only)",
)
def collision_none(urdf: UrdfElements) -> Faults:
    """No link has a collision shape, though some are visible: the robot falls through everything."""
    shapes = list(urdf.shapes)
    if shapes and not any(shape.kind == "collision" and shape.geometry is not None for shape in shapes):
        robot = Location(who="robot", line=line_of(urdf.root))
        yield Fault(at=robot, message="no link has a collision shape")


@check(
    "collision-missing",
    INFO,
    remedy="add a collision shape, unless this link should not collide",
    example="<link> with <visual> alone",
)
def collision_missing(urdf: UrdfElements) -> Faults:
    """Some links are visible but have no collision shape, though others have one."""
    if not any(link.collisions for link in urdf.links):
        return
    bare = [link for link in urdf.links if link.visuals and not link.collisions]
    if bare:
        named = ", ".join(f'"{link.name}"' for link in bare[:6]) + (", ..." if len(bare) > 6 else "")
        message = f"{len(bare)} visible links have no collision shape ({named})"
        yield Fault(at=bare[0], message=message, links=tuple(link.name for link in bare[:50]))


@check(
    "collision-is-visual",
    INFO,
    remedy="use a simple shape or a reduced mesh; the importer makes hulls of it",
    example="(one arm.dae of 20,000 triangles as visual and collision)",
)
def collision_is_visual(urdf: UrdfElements) -> Faults:
    """A collision mesh is the visual mesh itself, and over 1000 triangles."""
    found: list[LinkElement] = []
    for link in urdf.links:
        seen = {shape.mesh.found.path for shape in link.visuals if shape.mesh is not None}
        for shape in link.collisions:
            mesh = shape.mesh
            if (
                mesh is not None
                and mesh.found.path in seen
                and mesh.stats is not None
                and mesh.stats.triangles > 1000
            ):
                found.append(link)
                break
    if found:
        named = ", ".join(f'"{link.name}"' for link in found[:6]) + (", ..." if len(found) > 6 else "")
        message = f"{len(found)} links collide with their full visual mesh ({named})"
        yield Fault(at=found[0], message=message, links=tuple(link.name for link in found[:50]))


@check(
    "collision-hull-balloons",
    INFO,
    remedy="split it into convex parts: coacd in the importer, or several collision shapes",
    example="(a U-shaped bracket as one collision mesh)",
)
def collision_hull_balloons(urdf: UrdfElements) -> Faults:
    """A collision mesh's hull, with which simulators collide, has over 4 times the mesh's own volume."""
    seen: set[str] = set()
    for shape, mesh in urdf.mesh_shapes:
        facts = mesh.stats
        if shape.kind != "collision" or facts is None or facts.content in seen or not facts.is_closed:
            continue
        seen.add(facts.content)
        size = 0.0 if mesh.extents is None else float(mesh.extents.max())
        if facts.volume > 0 and facts.hull_volume > 4.0 * facts.volume and size > 0.02:
            ratio = facts.hull_volume / facts.volume
            name = mesh.found.path.name if mesh.found.path else mesh.uri
            message = f"the convex hull of collision mesh {name} holds {ratio:.1f} times its volume"
            yield Fault(at=shape, line=line_of(mesh.element), message=message)


@check(
    "collision-overlap",
    WARNING,
    remedy="shrink or move the shapes, or filter the pair (self-collision off for it)",
    example="(an upper arm whose shape cuts into the base two joints away)",
)
def collision_overlap(urdf: UrdfElements) -> Faults:
    """Collision shapes of links that no joint connects overlap deeply at the rest pose.

    Not looked for beyond 300 bodies or 3000 pairs of shapes.
    """
    tree = urdf.tree
    clouds = _clouds(urdf)
    pairs = [
        pair for pair in combinations(sorted(clouds), 2) if pair not in tree.body_pairs
    ] if len(clouds) <= 300 else []  # fmt: skip
    boxes = {body: _box(parts) for body, parts in clouds.items()}
    found: list[tuple[str, str]] = []
    tests = 0
    for first, second in pairs:
        if (boxes[first][1] < boxes[second][0]).any() or (boxes[second][1] < boxes[first][0]).any():
            continue
        for (one, a), (other, b) in ((p, q) for p in clouds[first] for q in clouds[second]):
            tests += 1
            if tests > MAX_TESTS:
                break
            if hulls_meet(a, b):
                found.append((one, other))
                break
    for one, other in found[:MAX_LISTED]:
        more = f" (and {len(found) - MAX_LISTED} more pairs)" if len(found) > MAX_LISTED else ""
        place = urdf.link_by_name[one]
        message = f'its collision shape overlaps that of link "{other}" at rest'
        is_last = (one, other) == found[:MAX_LISTED][-1]
        yield Fault(at=place, message=message + (more if is_last else ""), links=(one, other))


def _clouds(urdf: UrdfElements) -> dict[int, list[tuple[str, Array]]]:
    """Body to (link, (k, 3) shrunken points in the root frame) of its collision shapes."""
    found: dict[int, list[tuple[str, Array]]] = {}
    for link in urdf.link_by_name.values():
        pose = urdf.tree.frames.get(link.name)
        if pose is None:
            continue
        for shape in link.collisions:
            points = shape_points(shape)
            if points is None or not np.isfinite(points).all() or np.ptp(points, axis=0).max() > 1e4:
                continue
            points = points @ pose[:3, :3].T + pose[:3, 3]
            middle = (points.min(axis=0) + points.max(axis=0)) / 2.0
            points = middle + SHRINK * (points - middle)
            found.setdefault(urdf.tree.body_of[link.name], []).append((link.name, points))
    return found


def _box(parts: list[tuple[str, Array]]) -> Array:
    lower = np.min([points.min(axis=0) for _, points in parts], axis=0)
    upper = np.max([points.max(axis=0) for _, points in parts], axis=0)
    return np.stack([lower, upper])
