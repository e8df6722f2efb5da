"""Adding soft bodies to a world."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from roboyard._arrays import ArrayLike, NDArray
from roboyard.description.model import RGBA, Link, Material, Mesh, RobotDescription, Visual
from roboyard.errors import RoboyardError
from roboyard.shapes.mesh import TriangleMesh
from roboyard.sim.soft.build import SoftShape, build_soft
from roboyard.sim.soft.materials import NeoHookean, Springs
from roboyard.sim.soft.rest_shape import Ints, Lattice, Solid, lattice, right_handed, solid, surface_of
from roboyard.sim.soft.skin import embedded_skin, surface_skin
from roboyard.sim.soft.soft_body import SoftBody
from roboyard.transforms import Array, matrix_from_quaternion

if TYPE_CHECKING:
    from roboyard.sim.simulation import Simulation

MOST_NODES = 20_000
"""Most nodes of a soft body; each has three degrees of freedom."""


def add_soft_body(
    world: Simulation,
    nodes: ArrayLike,
    elements: ArrayLike,
    position: ArrayLike,
    orientation: ArrayLike,
    *,
    mass: float,
    material: Springs | NeoHookean | Sequence[Springs | NeoHookean],
    radius: float,
    friction: float,
    self_collision: bool,
    repulsion: float | None,
    skin: TriangleMesh | None,
    rgba: RGBA | None,
    name: str,
) -> SoftBody:
    """Add a soft body of nodes (n, 3) and elements (m, 3) or (m, 4); see `World.add_soft_body`."""
    local, cells = _checked_shape(nodes, elements, name)
    if not (0.0 < mass < np.inf and 0.0 < radius < np.inf and 0.0 <= friction < np.inf):
        raise RoboyardError(
            f"{name}: mass and radius must be positive and friction at least 0, got {mass}, {radius} and "
            f"{friction}"
        )
    turn = matrix_from_quaternion(np.asarray(orientation, dtype=float))
    place = np.asarray(position, dtype=float)
    placed = local @ turn.T + place
    if repulsion is not None and not 0.0 <= repulsion < np.inf:
        raise RoboyardError(f"{name}: repulsion must be at least 0 and finite, got {repulsion}")
    if not np.isfinite(placed).all():
        raise RoboyardError(f"{name}: position and orientation must be finite")
    materials = (material,) if isinstance(material, Springs | NeoHookean) else tuple(material)
    parts = tuple(_part(placed, cells, one, name) for one in materials)
    surface = cells if cells.shape[1] == 3 else surface_of(cells)
    if skin is None:
        drawn = surface_skin(placed, surface)
    else:
        moved = TriangleMesh(
            vertices=skin.vertices @ turn.T + place,
            faces=skin.faces, uv=skin.uv, colors=skin.colors, texture=skin.texture,
        )  # fmt: skip
        drawn = embedded_skin(moved, placed, cells)
    masses = np.full(len(placed), mass / len(placed))
    shape = SoftShape(
        positions=placed, masses=masses, elements=cells, radius=radius, friction=friction,
        self_collision=self_collision, repulsion=repulsion,
    )  # fmt: skip
    unique = world.reserve_name(name)
    centre = np.average(placed, axis=0, weights=masses)
    geometry = Mesh(uri="", path=None, data=drawn.deformed(placed - centre))
    visual = Visual(geometry=geometry, material=Material(name="soft", rgba=rgba) if rgba else None)
    link = Link(name=name, visuals=(visual,))
    built, made = build_soft(world.raw_spec, f"{unique}/", link, shape, hard=world.profile.hard_contacts)
    body = world.register(unique, built, RobotDescription(name=name, links=(link,)), fixed_base=True)
    world.mark_stale()
    soft = SoftBody(world, body, shape, made, parts, drawn)
    world.soft.add(soft)
    world.render_shapes.deforming[body.id] = soft.drawn_mesh
    return soft


def _checked_shape(nodes: ArrayLike, elements: ArrayLike, name: str) -> tuple[Array, Ints]:
    local = np.asarray(nodes, dtype=float)
    cells: NDArray[np.integer] = np.asarray(elements, dtype=np.int64)
    if local.ndim != 2 or local.shape[1] != 3 or not 3 <= len(local) <= MOST_NODES:
        raise RoboyardError(
            f"{name}: soft bodies need 3 to {MOST_NODES} nodes of three numbers, got shape {local.shape}"
        )
    if cells.ndim != 2 or cells.shape[1] not in (3, 4) or not len(cells):
        raise RoboyardError(
            f"{name}: elements must be triangles (m, 3) or tetrahedra (m, 4), got shape {cells.shape}"
        )
    if not np.isfinite(local).all() or cells.min() < 0 or cells.max() >= len(local):
        raise RoboyardError(
            f"{name}: nodes must be finite, and elements must name nodes 0 to {len(local) - 1}"
        )
    if cells.shape[1] == 4:
        found = right_handed(local, cells)
        if not len(found):
            raise RoboyardError(f"{name}: its tetrahedra have no volume")
        cells = found
    used = np.zeros(len(local), dtype=bool)
    used[cells] = True
    if not used.all():
        raise RoboyardError(
            f"{name}: node {int(np.flatnonzero(~used)[0])} belongs to no element; leave such nodes out"
        )
    return local, np.ascontiguousarray(cells, dtype=np.int32)


def _part(placed: Array, cells: Ints, material: Springs | NeoHookean, name: str) -> Lattice | Solid:
    if isinstance(material, Springs):
        return lattice(placed, cells, material)
    if cells.shape[1] != 4:
        raise RoboyardError(f"{name}: a Neo-Hookean solid needs tetrahedra; give triangles springs")
    return solid(placed, cells, material)
