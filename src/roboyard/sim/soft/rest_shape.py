"""The undeformed shape of a soft body: edges, springs against bending, tetrahedra."""

from __future__ import annotations

import numpy as np

from roboyard._arrays import NDArray
from roboyard._records import dataclass
from roboyard.sim.soft.materials import NeoHookean, Springs
from roboyard.transforms import Array

Ints = NDArray[np.int32]


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Lattice:
    """The springs of a soft body."""

    ends: Ints
    """(k, 2) nodes."""
    length: Array
    """(k,) lengths at rest (m)."""
    stiffness: Array
    """(k,) stiffness (N/m)."""
    damping: float
    """Of each (N s/m)."""
    damps_all_directions: bool


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Solid:
    """The tetrahedra of a soft body."""

    nodes: Ints
    """(k, 4) nodes, right-handed."""
    inverse: Array
    """(k, 3, 3) inverses of the matrices whose columns are the edges from the first node, at rest (1/m)."""
    volume: Array
    """(k,) volumes at rest (m³)."""
    material: NeoHookean


def edges_of(elements: NDArray[np.integer]) -> Ints:
    """Return the (k, 2) different edges of (m, 3) triangles or (m, 4) tetrahedra, each sorted."""
    corners = elements.shape[1]
    pairs = [elements[:, [i, j]] for i in range(corners) for j in range(i)]
    return np.unique(np.sort(np.concatenate(pairs), axis=1), axis=0).astype(np.int32)


def pairs_two_edges_apart(count: int, edges: NDArray[np.integer]) -> Ints:
    """Return the (k, 2) pairs of nodes that share a neighbour and no edge; count: number of nodes."""
    neighbours: list[set[int]] = [set() for _ in range(count)]
    for a, b in edges.tolist():
        neighbours[a].add(b)
        neighbours[b].add(a)
    found = {
        (node, far)
        for node, near in enumerate(neighbours)
        for middle in near
        for far in neighbours[middle]
        if far > node and far not in near
    }
    return np.array(sorted(found), dtype=np.int32).reshape(-1, 2)


def lattice(positions: Array, elements: NDArray[np.integer], springs: Springs) -> Lattice:
    """Return the springs of nodes at rest, (n, 3) (m)."""
    ends = edges_of(elements)
    stiffness = np.full(len(ends), springs.stiffness)
    if springs.bending_stiffness is not None:
        far = pairs_two_edges_apart(len(positions), ends)
        ends = np.concatenate([ends, far])
        stiffness = np.concatenate([stiffness, np.full(len(far), springs.bending_stiffness)])
    length = np.linalg.norm(positions[ends[:, 1]] - positions[ends[:, 0]], axis=1)
    return Lattice(
        ends=np.ascontiguousarray(ends),
        length=length,
        stiffness=stiffness,
        damping=springs.damping,
        damps_all_directions=springs.damps_all_directions,
    )


def right_handed(positions: Array, tetrahedra: NDArray[np.integer]) -> Ints:
    """Return (k, 4) tetrahedra with positive volume, without those of none."""
    sides = _sides(positions, tetrahedra)
    volume = np.linalg.det(sides) / 6
    size = np.abs(sides).max(axis=(1, 2))
    turned = tetrahedra.copy()
    turned[volume < 0] = turned[volume < 0][:, [0, 2, 1, 3]]
    return np.ascontiguousarray(turned[np.abs(volume) > 1e-9 * size**3], dtype=np.int32)


def solid(positions: Array, tetrahedra: Ints, material: NeoHookean) -> Solid:
    """Return the tetrahedra of nodes at rest, (n, 3) (m); they are right-handed."""
    sides = _sides(positions, tetrahedra)
    return Solid(
        nodes=tetrahedra,
        inverse=np.ascontiguousarray(np.linalg.inv(sides), dtype=np.float64),
        volume=np.linalg.det(sides) / 6,
        material=material,
    )


def surface_of(tetrahedra: Ints) -> Ints:
    """Return the (k, 3) triangles that belong to one right-handed tetrahedron only, seen from outside."""
    faces = np.concatenate([tetrahedra[:, [0, 2, 1]], tetrahedra[:, [0, 1, 3]], tetrahedra[:, [1, 2, 3]],
                            tetrahedra[:, [0, 3, 2]]])  # fmt: skip
    _, first, count = np.unique(np.sort(faces, axis=1), axis=0, return_index=True, return_counts=True)
    return np.ascontiguousarray(faces[np.sort(first[count == 1])], dtype=np.int32)


def _sides(positions: Array, tetrahedra: NDArray[np.integer]) -> Array:
    """Return (k, 3, 3) matrices whose columns are the edges from the first node (m)."""
    corners = positions[tetrahedra]
    return np.swapaxes(corners[:, 1:] - corners[:, :1], 1, 2)
