"""Mesh data of bodies, and convex decomposition of mesh files."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from roboyard.description.model import Collision, Cylinder, Mesh, Pose
from roboyard.errors import RoboyardError
from roboyard.pybullet.bullet_rules.mesh_objects import split_objects
from roboyard.pybullet.bullet_rules.models import prism
from roboyard.pybullet.face import constants as c
from roboyard.pybullet.face.arguments import number, text, whole
from roboyard.pybullet.face.commands import command
from roboyard.pybullet.face.errors import failure, unavailable
from roboyard.pybullet.state.file_search import find_file, not_found_remedy
from roboyard.sim.physics_profile import BULLET
from roboyard.transforms import Array, conjugate, matrix_from_quaternion, multiply, rotate

if TYPE_CHECKING:
    from roboyard.pybullet.bullet_rules.models import BodyModel
    from roboyard.pybullet.client import Client
    from roboyard.pybullet.state.bodies.body_records import BodyRecord
    from roboyard.shapes.mesh import TriangleMesh

_NO_MESH = "getMeshData failed"
_DEFAULT_HULLS = 32


@command()
def getMeshData(
    client: Client, bodyUniqueId: int, linkIndex: int = -1, collisionShapeIndex: int = -1, flags: int = -1
) -> tuple[int, tuple[tuple[float, ...], ...]]:
    """Return the vertices of a link's collision meshes, or of a soft body in the world.

    For convex meshes these are the corners of the hull, for OBJ files those of each object's hull. Boxes,
    spheres, capsules and planes have no vertices.

    Args:
        bodyUniqueId: body.
        linkIndex: link; -1 for the base.
        collisionShapeIndex: index of one of the link's shapes; -1 for all.
        flags: MESH_DATA_SIMULATION_MESH for the nodes of a soft body; otherwise it returns the corners of
            all its visible triangles.

    Returns:
        Number of vertices k, and the (k, 3) vertices in the link's inertial frame (m).

    Raises:
        error: the body or link does not exist.
    """
    record = client.scene.bodies.get(whole(bodyUniqueId))
    if record is None or not -1 <= whole(linkIndex) < record.joint_count:
        raise failure(_NO_MESH, f"there is no body {bodyUniqueId} with a link {linkIndex}")
    if record.soft is not None:
        from roboyard.pybullet.api.soft_bodies import soft_mesh

        return soft_mesh(record.soft, simulated=whole(flags) == c.MESH_DATA_SIMULATION_MESH)
    whole(flags)
    known = record.model.once("mesh data", _no_answers)
    key = linkIndex, max(whole(collisionShapeIndex), -1)
    if key not in known:
        link = record.model.links[linkIndex + 1]
        shapes = split_objects(link.collisions)
        if collisionShapeIndex >= 0:
            shapes = shapes[collisionShapeIndex : collisionShapeIndex + 1]
        found = [_vertices(record, shape, link.frame) for shape in shapes]
        rows = tuple(tuple(row) for points in found for row in points.tolist())
        known[key] = len(rows), rows
    answer: tuple[int, tuple[tuple[float, ...], ...]] = known[key]
    return answer


def _no_answers(_: BodyModel) -> dict[tuple[int, int], Any]:
    return {}


def _vertices(record: BodyRecord, shape: Collision, frame: Pose) -> Array:
    """Return (k, 3) vertices in the inertial frame (m)."""
    geometry = shape.geometry
    if isinstance(geometry, Mesh):
        points = _mesh_vertices(geometry, concave=shape.concave)
    elif isinstance(geometry, Cylinder) and record.file and not record.model.implicit_cylinder:
        points = _mesh_vertices(prism(geometry.radius, geometry.length), concave=False)
    else:
        return np.zeros((0, 3))
    back = conjugate(frame.quaternion)
    offset = np.asarray(shape.origin.position) - np.asarray(frame.position)
    turn = matrix_from_quaternion(multiply(back, shape.origin.quaternion))
    return points @ turn.T + rotate(back, offset)


def _mesh_vertices(mesh: Mesh, *, concave: bool) -> Array:
    from roboyard.sim.build.geoms import is_single, load_scaled
    from roboyard.sim.build.mesh_assets import convex_hull

    triangles = load_scaled(mesh, 1.0)
    if triangles is None or not len(triangles.vertices):
        return np.zeros((0, 3))
    if concave:
        return np.asarray(triangles.vertices, dtype=float)
    return convex_hull(triangles, BULLET.hull_steps, single=is_single(mesh, 1.0))[0]


@command()
def vhacd(
    client: Client,
    fileNameIn: str,
    fileNameOut: str,
    fileNameLogging: str,
    concavity: float = -1.0,
    alpha: float = -1.0,
    beta: float = -1.0,
    gamma: float = -1.0,
    minVolumePerCH: float = -1.0,
    resolution: int = -1,
    maxNumVerticesPerCH: int = -1,
    depth: int = -1,
    planeDownsampling: int = -1,
    convexhullDownsampling: int = -1,
    pca: int = -1,
    mode: int = -1,
    convexhullApproximation: int = -1,
) -> None:
    """Decompose a mesh into convex parts and write them to an OBJ file, one object each.

    `roboyard.shapes.convex.decomposition` computes the parts. It uses maxNumVerticesPerCH, and 2 to the power
    of depth as the largest number of parts; the other settings of V-HACD have no effect.

    Args:
        fileNameIn: mesh file.
        fileNameOut: OBJ file to write.
        fileNameLogging: text file for a summary; "" for none.
        concavity: ignored.
        alpha: ignored.
        beta: ignored.
        gamma: ignored.
        minVolumePerCH: ignored.
        resolution: ignored.
        maxNumVerticesPerCH: largest number of corners of a part.
        depth: largest depth of cuts.
        planeDownsampling: ignored.
        convexhullDownsampling: ignored.
        pca: ignored.
        mode: ignored.
        convexhullApproximation: ignored.

    Raises:
        error: a file cannot be read or written, or the mesh cannot be decomposed.
    """
    from roboyard.shapes import load_mesh
    from roboyard.shapes.convex.decomposition import decompose

    path = find_file(client.search.folder, text(fileNameIn), client.mounts)
    if path is None:
        raise failure("vhacd failed.", not_found_remedy(client.search.folder, fileNameIn))
    for setting in (concavity, alpha, beta, gamma, minVolumePerCH):
        number(setting)
    parts = 2 ** min(whole(depth), 8) if whole(depth) > 0 else _DEFAULT_HULLS
    corners = whole(maxNumVerticesPerCH) if whole(maxNumVerticesPerCH) >= 4 else 64
    try:
        written = client.output_files.path(text(fileNameOut))
        logged = client.output_files.path(fileNameLogging) if text(fileNameLogging) else None
        made = decompose(load_mesh(path), hull_count=parts, max_vertices=corners)
        written.write_text(_as_obj(made.hulls), encoding="utf-8")
        if logged is not None:
            lines = [f"{path.name}: {len(made.hulls)} convex parts by {made.method_used}", *made.notes]
            logged.write_text("\n".join(lines) + "\n", encoding="utf-8")
    except (RoboyardError, OSError) as problem:
        raise failure("vhacd failed.", *str(problem).splitlines()) from problem


def _as_obj(parts: Sequence[TriangleMesh]) -> str:
    lines, first = [], 1
    for k, part in enumerate(parts):
        lines.append(f"o convex_{k}")
        lines += [f"v {x:.9g} {y:.9g} {z:.9g}" for x, y, z in part.vertices.tolist()]
        lines += [f"f {a + first} {b + first} {d + first}" for a, b, d in part.faces.tolist()]
        first += len(part.vertices)
    return "\n".join(lines) + "\n"


@command()
def unsupportedChangeScaling(client: Client, bodyUniqueId: int, scaling: object) -> None:
    """Raise an error: bodies cannot be scaled after they are created.

    Raises:
        error: always.
    """
    raise unavailable("unsupportedChangeScaling", "load the body again with globalScaling or meshScale")
