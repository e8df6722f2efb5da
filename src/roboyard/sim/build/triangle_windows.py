"""Concave meshes: slots for the triangles of fixed bodies, of which MuJoCo sees those near moving bodies.

MuJoCo collides convex shapes only. Where triangles are not searched here (`mesh_fields`), a window has a
limited number of slots, flat prisms, which `roboyard.sim.stepping.triangle_windows` moves to the triangles
that may be touched in the next step. So the cost of a compile and of a step depends on how many triangles are
near, not on how many the mesh has. A geom without contacts holds all triangles for rays; it is added when a
world is first asked for rays or boxes (`Engine.show_triangles`), since MuJoCo takes longer to compile it than
all else.
"""

from __future__ import annotations

from collections import OrderedDict
from dataclasses import field
from typing import TYPE_CHECKING, Any

import numpy as np

from roboyard._records import dataclass
from roboyard.description.model import Pose
from roboyard.shapes.mesh import TriangleMesh, read_only
from roboyard.shapes.triangle_tree import TriangleTree, triangle_tree
from roboyard.transforms import matrix_from_quaternion, to_wxyz

if TYPE_CHECKING:
    from roboyard.sim.build.mesh_assets import MeshAssets

MARGIN = 1e-3
"""Bullet's margin around the triangles of meshes in memory (m)."""
HALF_THICKNESS = 1e-3
"""Distance (m) of a prism's two triangles from the triangle itself."""
OVERLAP = 1e-5
"""Relative enlargement of triangles for rays."""
FEWEST, MOST = 48, 1536
"""Number of slots of a new window, and the largest number that a window grows to."""
PRISM = np.array(
    [[0.0, 0.0, 1.0], [1.0, 0.0, 1.0], [0.0, 1.0, 1.0], [0.0, 0.0, -1.0], [1.0, 0.0, -1.0], [0.0, 1.0, -1.0]]
)
"""(6, 3) corners of a slot's mesh before it is moved to a triangle: the upper three, then the lower ones."""
PRISM_FACES = np.array(
    [[0, 1, 2], [3, 5, 4], [0, 3, 4], [0, 4, 1], [1, 4, 5], [1, 5, 2], [2, 5, 3], [2, 3, 0]], dtype=np.int32
)
_COPIED = ("condim", "contype", "conaffinity", "friction", "priority", "solref", "solimp", "group", "rgba")
"""Fields that new slots take over from the first one, or from the geom that represented all triangles."""
_CACHE_SIZE = 16
_trees: OrderedDict[tuple[int, Pose], tuple[TriangleMesh, TriangleTree]] = OrderedDict()
_apart: OrderedDict[int, tuple[TriangleMesh, TriangleMesh]] = OrderedDict()


@dataclass(kw_only=True, slots=True, eq=False)
class TriangleWindow:
    """The triangles of one concave mesh, and the slots that show some of them to MuJoCo."""

    mesh: TriangleMesh
    """The triangles in their own frame."""
    origin: Pose
    """Pose of that frame in the link's frame (m)."""
    is_file: bool
    """Whether the mesh comes from a file; Bullet gives such meshes no margin."""
    is_single: bool = False
    """Whether its corners are still to be taken in single precision, as Bullet reads them from files."""
    slots: list[Any] = field(default_factory=list)
    """The spec's geoms."""
    whole: Any = None
    """The spec's geom that represents all triangles where these are searched, else None."""

    @property
    def margin(self) -> float:
        """Bullet's margin around the triangles (m); balls do not have it."""
        return 0.0 if self.is_file else MARGIN

    @property
    def tree(self) -> TriangleTree:
        """The triangles in the link's frame."""
        return _tree_of(self.mesh, self.origin)


def _tree_of(mesh: TriangleMesh, origin: Pose) -> TriangleTree:
    """Return the tree of a mesh at a pose in its link, which is cached."""
    key = id(mesh), origin
    found = _trees.get(key)
    if found is None or found[0] is not mesh:
        turned = mesh.vertices @ matrix_from_quaternion(origin.quaternion).T + np.asarray(origin.position)
        placed = TriangleMesh(vertices=read_only(turned, np.float64), faces=mesh.faces)
        found = _trees[key] = mesh, triangle_tree(placed)
        while len(_trees) > _CACHE_SIZE:
            _trees.popitem(last=False)
    return found[1]


def without_seams(mesh: TriangleMesh) -> TriangleMesh:
    """Return the triangles apart from one another and slightly larger, so that rays along seams hit one.

    Args:
        mesh: the triangles; the result is cached.
    """
    found = _apart.get(id(mesh))
    if found is None or found[0] is not mesh:
        found = _apart[id(mesh)] = mesh, _parted(mesh)
        while len(_apart) > _CACHE_SIZE:
            _apart.popitem(last=False)
    return found[1]


def _parted(mesh: TriangleMesh) -> TriangleMesh:
    corners = mesh.vertices[mesh.faces]
    if len(corners) == 1:  # MuJoCo's meshes have four different corners at least
        a, b, c = corners[0]
        corners = np.array([[a, b, (b + c) / 2], [a, (b + c) / 2, c]])
    middles = ((corners[:, 0] + corners[:, 1] + corners[:, 2]) / 3)[:, None]
    corners = middles + (1.0 + OVERLAP) * (corners - middles)
    faces = np.arange(3 * len(corners), dtype=np.int32).reshape(-1, 3)
    return TriangleMesh(
        vertices=read_only(corners.reshape(-1, 3), np.float64), faces=read_only(faces, np.int32)
    )


def add_slots(
    window: TriangleWindow,
    body: Any,
    geoms: list[Any],
    meshes: list[str],
    assets: MeshAssets,
    count: int,
    **fields: Any,
) -> None:
    """Add slots to a window.

    Args:
        window: the window.
        body: the spec's body.
        geoms: collision geoms of the link, which the slots are added to.
        meshes: names of the link's meshes, which those of the slots are added to.
        assets: the spec's meshes.
        count: number of slots to add.
        fields: of the spec's geoms; without any, those of the window's first slot.
    """
    from roboyard._mujoco import mujoco

    if not fields:
        fields = {name: getattr(window.slots[0], name) for name in _COPIED}
    for _ in range(count):
        name = assets.add_own(PRISM, PRISM_FACES)
        meshes.append(name)
        geom = body.add_geom(type=mujoco.mjtGeom.mjGEOM_MESH, meshname=name, mass=0.0, **fields)
        window.slots.append(geom)
        geoms.append(geom)


def show_hull(
    window: TriangleWindow, spec: Any, body: Any, geoms: list[Any], meshes: list[str], assets: MeshAssets
) -> None:
    """Let the hull of a mesh of a body that moves collide in place of its triangles; see `add_slots`."""
    from roboyard._mujoco import mujoco

    fields = {name: getattr(window.whole, name) for name in _COPIED if name != "rgba"}
    _remove_whole(window, spec, geoms)
    name = assets.add(window.mesh, hull=True, single=window.is_single)
    meshes.append(name)
    turn = to_wxyz(np.asarray(window.origin.quaternion, dtype=float))
    place = {"pos": window.origin.position, "quat": turn, "mass": 0.0}
    geoms.append(body.add_geom(type=mujoco.mjtGeom.mjGEOM_MESH, meshname=name, **place, **fields))


def show_slots(
    window: TriangleWindow, spec: Any, body: Any, geoms: list[Any], meshes: list[str], assets: MeshAssets
) -> None:
    """Let the slots of a mesh collide in place of the geom that represents all triangles; see `add_slots`."""
    fields = {name: getattr(window.whole, name) for name in _COPIED}
    _remove_whole(window, spec, geoms)
    add_slots(window, body, geoms, meshes, assets, min(len(window.tree), FEWEST), **fields)


def _remove_whole(window: TriangleWindow, spec: Any, geoms: list[Any]) -> None:
    whole, name = window.whole, window.whole.hfieldname
    geoms[:] = [geom for geom in geoms if geom is not whole]
    spec.delete(whole)
    spec.delete(spec.hfield(name))
    window.whole = None
