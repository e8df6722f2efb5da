"""Shapes of a description as MuJoCo geoms: visuals in group 2 without contact, collisions in group 3."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from roboyard.description.model import (
    RGBA,
    Box,
    Capsule,
    Collision,
    Contact,
    Cylinder,
    Geometry,
    Heightfield,
    Mesh,
    Plane,
    Pose,
    Sphere,
    Visual,
)
from roboyard.shapes.mesh import read_only
from roboyard.sim.build.solver_options import CONTACT_SOLIMP, CONTACT_SOLREF
from roboyard.sim.build.triangle_windows import FEWEST, TriangleWindow, add_slots, without_seams
from roboyard.transforms import multiply, normalized, rotate, to_wxyz

if TYPE_CHECKING:
    from roboyard._mujoco import mujoco
    from roboyard.shapes.mesh import TriangleMesh
    from roboyard.sim.build.mesh_assets import MeshAssets
    from roboyard.sim.build.records import BuildOptions, BuiltLink

VISUAL_GROUP = 2
COLLISION_GROUP = 3
SMALLEST = 1e-6
"""Smallest size of a shape (m)."""
SMALLEST_MESH = 1e-4
"""Smallest size of a collision mesh (m); MuJoCo rejects hulls of almost no volume."""
HALF_SPACE = 100.0
"""Half size of the box that replaces a plane on a moving body (m)."""
UNPAINTED: RGBA = (0.7, 0.7, 0.7, 1.0)
TERRAIN_BASE = 1.0
"""Thickness of the ground under the lowest point of a heightfield (m)."""


def add_collision(
    record: BuiltLink,
    spec: mujoco.MjSpec,
    assets: MeshAssets,
    collision: Collision,
    options: BuildOptions,
    notes: list[str],
) -> None:
    """Add one collision shape to a link's body; a shape without size is skipped with a note."""
    static = record.is_static
    may_be_concave = static or options.searches_meshes
    is_concave = may_be_concave and collision.concave and isinstance(collision.geometry, Mesh)
    fields = contact_fields(record.link.contact if record.link is not None else None, options)
    if is_concave:
        is_there = _add_triangles(record, spec, assets, collision, options, fields)
    else:
        arguments = geom_arguments(
            record, spec, assets, collision.geometry, collision.origin, options.scale,
            static=static, hull=True,
        )  # fmt: skip
        is_there = arguments is not None
        if arguments is not None:
            geom = record.element.add_geom(group=COLLISION_GROUP, mass=0.0, **fields, **arguments)
            record.geoms.append(geom)
    if not is_there:
        notes.append(f'link "{record.name}": collision shape has no size or no mesh; skipped')


def contact_fields(contact: Contact | None, options: BuildOptions) -> dict[str, Any]:
    """Return what a geom of a collision shape has besides its shape and pose."""
    return {
        "contype": options.contype,
        "conaffinity": options.conaffinity,
        "condim": _contact_dimension(contact),
        "friction": _friction(contact),
        "solref": CONTACT_SOLREF,
        "solimp": CONTACT_SOLIMP,
    }


def _add_triangles(
    record: BuiltLink,
    spec: mujoco.MjSpec,
    assets: MeshAssets,
    collision: Collision,
    options: BuildOptions,
    fields: dict[str, Any],
) -> bool:
    """Add a concave mesh, if it has triangles; rays do not hit its geoms."""
    assert isinstance(collision.geometry, Mesh)
    scale = options.scale
    mesh = load_scaled(collision.geometry, scale)
    if mesh is None or not len(mesh.faces):
        return False
    record.hidden.append((collision, scale))
    x, y, z = (scale * v for v in collision.origin.position)
    origin = replace(collision.origin, position=(x, y, z))
    window = TriangleWindow(
        mesh=mesh,
        origin=origin,
        is_file=collision.geometry.path is not None,
        is_single=is_single(collision.geometry, scale),
    )
    fields = {**fields, "group": COLLISION_GROUP, "rgba": (0.0, 0.0, 0.0, 0.0)}
    if options.searches_meshes:
        record.windows.append(window)
        _add_whole(record, spec, window, fields)
        return True
    if not len(window.tree):
        return True
    record.windows.append(window)
    count = min(len(window.tree), FEWEST)
    add_slots(window, record.element, record.geoms, record.meshes, assets, count, **fields)
    return True


def _add_whole(
    record: BuiltLink, spec: mujoco.MjSpec, window: TriangleWindow, fields: dict[str, Any]
) -> None:
    """Add the geom that represents all triangles of a mesh."""
    from roboyard._mujoco import mujoco
    from roboyard.sim.build.mesh_fields import add_field_asset, mesh_field

    field = mesh_field(window.mesh, single=window.is_single)
    name = f"{record.element.name}/triangles{len(record.geoms) + len(record.visuals)}"
    add_field_asset(spec, name, field)
    turn = np.asarray(window.origin.quaternion, dtype=float)
    position = np.asarray(window.origin.position) + rotate(turn, field.middle)
    window.whole = record.element.add_geom(
        type=mujoco.mjtGeom.mjGEOM_HFIELD, hfieldname=name, pos=position, quat=to_wxyz(turn), mass=0.0,
        **fields,
    )  # fmt: skip
    record.geoms.append(window.whole)


def add_triangles_for_rays(record: BuiltLink, spec: mujoco.MjSpec, assets: MeshAssets) -> None:
    """Add a geom with all triangles for each concave mesh that has none yet; nothing touches it."""
    for collision, scale in record.hidden:
        if not _has_area(collision.geometry, scale):
            continue
        arguments = geom_arguments(
            record, spec, assets, collision.geometry, collision.origin, scale,
            static=True, hull=False, triangles=True,
        )  # fmt: skip
        if arguments is not None:
            record.element.add_geom(
                group=COLLISION_GROUP, contype=0, conaffinity=0, mass=0.0, rgba=UNPAINTED, **arguments
            )
    record.hidden.clear()


def _has_area(geometry: Geometry, scale: float) -> bool:
    """Return whether the triangles of a mesh have an area that MuJoCo accepts."""
    mesh = load_scaled(geometry, scale) if isinstance(geometry, Mesh) else None
    if mesh is None:
        return False
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    return bool(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() > SMALLEST**2)


def add_visual(
    record: BuiltLink,
    spec: mujoco.MjSpec,
    assets: MeshAssets,
    visual: Visual,
    options: BuildOptions,
    notes: list[str],
) -> None:
    """Add one visual shape to a link's body; it does not collide and has no mass."""
    static = record.is_static
    arguments = geom_arguments(
        record, spec, assets, visual.geometry, visual.origin, options.scale, static=static, hull=False
    )
    if arguments is None:
        return
    record.visuals.append(
        record.element.add_geom(
            group=VISUAL_GROUP, contype=0, conaffinity=0, mass=0.0, rgba=paint(visual), **arguments
        )
    )


def paint(visual: Visual) -> RGBA:
    """Return the colour of a visual shape's geom."""
    return visual.material.rgba if visual.material and visual.material.rgba else UNPAINTED


def geom_arguments(
    record: BuiltLink,
    spec: mujoco.MjSpec,
    assets: MeshAssets,
    geometry: Geometry,
    origin: Pose,
    scale: float,
    *,
    static: bool,
    hull: bool,
    triangles: bool = False,
) -> dict[str, Any] | None:
    """Return the type, size and pose of a geom; None for a shape without size.

    A mesh is its hull (`hull`), its triangles one by one (`triangles`), or the mesh itself.
    """
    from roboyard._mujoco import mujoco

    kinds = mujoco.mjtGeom
    position = np.asarray(origin.position, dtype=float) * scale
    quaternion = np.asarray(origin.quaternion, dtype=float)
    size = np.zeros(3)
    extra: dict[str, Any] = {}
    match geometry:
        case Box() | Sphere() | Cylinder() | Capsule():
            return plain_arguments(geometry, origin, scale)
        case Plane():
            quaternion = multiply(quaternion, turn_z_to(np.asarray(geometry.normal, dtype=float)))
            if static:
                kind, size = kinds.mjGEOM_PLANE, np.array([0.0, 0.0, 1.0])
            else:
                kind, size = kinds.mjGEOM_BOX, np.full(3, HALF_SPACE)
                position = position - rotate(quaternion, np.array([0.0, 0.0, HALF_SPACE]))
            used = np.ones(1)
        case Mesh():
            mesh = load_scaled(geometry, scale)
            if mesh is None or len(mesh.faces) == 0:
                return None
            if hull and np.ptp(mesh.vertices, axis=0).max() < SMALLEST_MESH:
                return None
            kind, used = kinds.mjGEOM_MESH, np.ones(1)
            single = is_single(geometry, scale)
            extra["meshname"] = assets.add(
                without_seams(mesh) if triangles else mesh, hull=hull, single=single
            )
            record.meshes.append(extra["meshname"])
        case Heightfield():
            kind, used = kinds.mjGEOM_HFIELD, np.ones(1)
            extra["hfieldname"], lowest = add_heightfield_asset(record, spec, geometry, scale)
            position = position + rotate(quaternion, np.array([0.0, 0.0, lowest]))
    if not (used > SMALLEST).all():
        return None
    return {"type": kind, "size": size, "pos": position, "quat": to_wxyz(quaternion), **extra}


def plain_arguments(
    geometry: Box | Sphere | Cylinder | Capsule, origin: Pose, scale: float
) -> dict[str, Any] | None:
    """Return the type, size and pose of a primitive's geom; None for one without size."""
    kind, size, used = plain_size(geometry, scale)
    if not (used > SMALLEST).all():
        return None
    position = np.asarray(origin.position, dtype=float) * scale
    return {"type": kind, "size": size, "pos": position, "quat": to_wxyz(np.asarray(origin.quaternion))}


def plain_size(
    geometry: Box | Sphere | Cylinder | Capsule, scale: float
) -> tuple[Any, np.ndarray, np.ndarray]:
    """Return MuJoCo's type of a primitive, its sizes (3,) (m), and those that must be positive."""
    kind, sizes, count = sizes_of(geometry, scale)
    size = np.array(sizes)
    return kind, size, size[:count]


def sizes_of(
    geometry: Box | Sphere | Cylinder | Capsule, scale: float
) -> tuple[Any, tuple[float, float, float], int]:
    """Return MuJoCo's type of a primitive, its sizes (m), and how many of these must be positive."""
    from roboyard._mujoco import mujoco

    kinds = mujoco.mjtGeom
    match geometry:
        case Box(size=(x, y, z)):
            return kinds.mjGEOM_BOX, (x * scale / 2, y * scale / 2, z * scale / 2), 3
        case Sphere(radius=radius):
            return kinds.mjGEOM_SPHERE, (radius * scale, 0.0, 0.0), 1
        case Cylinder(radius=radius, length=length):
            return kinds.mjGEOM_CYLINDER, (radius * scale, length * scale / 2, 0.0), 2
        case Capsule(radius=radius, length=length):
            kind = kinds.mjGEOM_CAPSULE if length > SMALLEST else kinds.mjGEOM_SPHERE
            return kind, (radius * scale, length * scale / 2, 0.0), 1


_MOST_SCALED, _SMALL_MESH = 64, 4096
"""Number of scaled meshes that are kept, and the most vertices of one: a shape is looked at several times."""
_scaled: dict[tuple[int, tuple[float, ...], bool], tuple[TriangleMesh, TriangleMesh]] = {}


def load_scaled(geometry: Mesh, scale: float) -> TriangleMesh | None:
    """Return the triangles of a mesh with its own and the body's scale applied; None without a mesh."""
    from roboyard.shapes.load import load_mesh, scaled

    mesh = geometry.data
    if mesh is None:
        if geometry.path is None:
            return None
        mesh = load_mesh(geometry.path)
    factors = tuple(component * scale for component in geometry.scale)
    if factors == (1.0, 1.0, 1.0):
        return mesh
    key = id(mesh), factors, geometry.path is None
    known = _scaled.get(key)
    if known is not None and known[0] is mesh:
        return known[1]
    found = scaled(mesh if geometry.path is None else in_single(mesh), factors)
    if len(mesh.vertices) <= _SMALL_MESH:
        if len(_scaled) >= _MOST_SCALED:
            _scaled.clear()
        _scaled[key] = mesh, found
    return found


def hull_meshes(shapes: Sequence[Collision], scale: float) -> list[tuple[TriangleMesh, bool]]:
    """Return the scaled meshes in memory whose hulls are shapes, each with its `is_single`."""
    return [
        (mesh, is_single(geometry, scale))
        for shape in shapes
        if isinstance(geometry := shape.geometry, Mesh) and not shape.concave and geometry.data is not None
        if (mesh := load_scaled(geometry, scale)) is not None and len(mesh.faces)
    ]


def is_single(geometry: Mesh, scale: float) -> bool:
    """Return whether the corners that `load_scaled` returns are still to be taken in single precision.

    Files have numbers of single precision, as Bullet reads them, which may be scaled then.
    """
    is_scaled = tuple(component * scale for component in geometry.scale) != (1.0, 1.0, 1.0)
    return geometry.path is not None and not is_scaled


def in_single(mesh: TriangleMesh) -> TriangleMesh:
    """Return a mesh whose corners have coordinates of single precision."""
    return replace(mesh, vertices=read_only(mesh.vertices.astype(np.float32), np.float64))


def add_heightfield_asset(
    record: BuiltLink, spec: mujoco.MjSpec, terrain: Heightfield, scale: float
) -> tuple[str, float]:
    """Add a heightfield to the spec; return its name and the height of its lowest point (m)."""
    nx, ny = terrain.heights.shape
    name = f"{record.element.name}/terrain{len(record.geoms) + len(record.visuals)}"
    record.terrains[name] = terrain
    return name, fill_heightfield(spec.add_hfield(name=name, nrow=ny, ncol=nx), terrain, scale)


def fill_heightfield(field: Any, terrain: Heightfield, scale: float) -> float:
    """Write heights into the spec's heightfield; return the height of the lowest point (m)."""
    heights = np.asarray(terrain.heights, dtype=float) * scale
    nx, ny = heights.shape
    lowest, highest = float(heights.min()), float(heights.max())
    rise = max(highest - lowest, SMALLEST)
    half_x, half_y = (nx - 1) * terrain.cell[0] * scale / 2, (ny - 1) * terrain.cell[1] * scale / 2
    field.size = [half_x, half_y, rise, TERRAIN_BASE]
    field.userdata = ((heights - lowest) / rise).T.astype(np.float32).ravel()
    return lowest


def turn_z_to(normal: np.ndarray) -> np.ndarray:
    """Return the quaternion (4,) x, y, z, w of the shortest rotation from +z to a direction (3,)."""
    x, y, z = normal / np.linalg.norm(normal)
    if z < -1 + 1e-9:
        return np.array([1.0, 0.0, 0.0, 0.0])
    return normalized([-y, x, 0.0, 1.0 + z])


DEFAULT_FRICTION = (1.0, 0.005, 0.0001)


def _friction(contact: Contact | None) -> tuple[float, float, float]:
    if contact is None:
        return DEFAULT_FRICTION
    slide, spin, roll = DEFAULT_FRICTION
    return (
        slide if contact.lateral_friction is None else contact.lateral_friction,
        spin if contact.spinning_friction is None else contact.spinning_friction,
        roll if contact.rolling_friction is None else contact.rolling_friction,
    )


def _contact_dimension(contact: Contact | None) -> int:
    """Return 3 for sliding friction, 4 with spinning, 6 with rolling (only where the file has them)."""
    if contact is None:
        return 3
    if contact.rolling_friction:
        return 6
    return 4 if contact.spinning_friction else 3
