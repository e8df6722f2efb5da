"""Triangle meshes for the generator: merge, move, colour, mass properties. Lengths in metres."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
GRID = 1e-5
"""Vertices are rounded to this grid (m), so that the files do not depend on the last bit of a cosine."""


@dataclass(frozen=True, kw_only=True)
class Mesh:
    """Closed surfaces, counter-clockwise seen from outside; components may overlap."""

    vertices: Array
    """(n, 3) m"""
    faces: NDArray[np.int64]
    """(m, 3)"""
    parts: tuple[str, ...] = ("",)
    """Material names; `face_parts` indexes them."""
    face_parts: NDArray[np.int64] | None = None
    """(m,) index into `parts`; None: all 0."""
    uv: Array | None = None
    """(m, 3, 2) texture coordinates of each corner; None: no texture."""

    @property
    def part_of_face(self) -> NDArray[np.int64]:
        return np.zeros(len(self.faces), dtype=np.int64) if self.face_parts is None else self.face_parts

    def moved(
        self, xyz: tuple[float, float, float] = (0, 0, 0), rpy: tuple[float, float, float] = (0, 0, 0)
    ) -> Mesh:
        """Return the mesh rotated by roll, pitch, yaw about the origin, then translated."""
        return replace(self, vertices=self.vertices @ rotation(rpy).T + np.asarray(xyz, dtype=float))

    def scaled(self, x: float, y: float, z: float) -> Mesh:
        """Return the mesh scaled about the origin; an odd number of negative factors reverses the faces."""
        turned = x * y * z < 0
        faces = self.faces[:, ::-1] if turned else self.faces
        uv = self.uv[:, ::-1] if turned and self.uv is not None else self.uv
        return replace(self, vertices=self.vertices * (x, y, z), faces=faces, uv=uv)

    def named(self, part: str) -> Mesh:
        """Return the mesh with all faces in one material."""
        return replace(self, parts=(part,), face_parts=None)

    def __add__(self, other: Mesh) -> Mesh:
        return merge(self, other)


def rotation(rpy: tuple[float, float, float]) -> Array:
    """Return the (3, 3) matrix Rz(yaw) Ry(pitch) Rx(roll), the convention of URDF."""
    (cr, cp, cy), (sr, sp, sy) = np.cos(rpy), np.sin(rpy)
    return np.array([
        [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
        [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
        [-sp, cp * sr, cp * cr],
    ])  # fmt: skip


def merge(*meshes: Mesh) -> Mesh:
    """Return all faces in one mesh, materials kept by name."""
    names = tuple(dict.fromkeys(name for m in meshes for name in m.parts))
    start = np.cumsum([0] + [len(m.vertices) for m in meshes])
    textured = any(m.uv is not None for m in meshes)
    return Mesh(
        vertices=np.concatenate([m.vertices for m in meshes]),
        faces=np.concatenate([m.faces + s for m, s in zip(meshes, start, strict=False)]),
        parts=names,
        face_parts=np.concatenate([
            np.array([names.index(n) for n in m.parts])[m.part_of_face] for m in meshes
        ]),
        uv=np.concatenate([np.zeros((len(m.faces), 3, 2)) if m.uv is None else m.uv for m in meshes])
        if textured
        else None,
    )  # fmt: skip


def steady(values: Array) -> Array:
    """Return nearest integers; values half-way, up to rounding errors, are rounded up."""
    return np.floor(values + (0.5 + 1e-4))


def tidy(mesh: Mesh) -> Mesh:
    """Return a mesh with vertices on the grid, equal ones merged and faces without area dropped."""
    keys = steady(mesh.vertices / GRID).astype(np.int64)
    unique, inverse = np.unique(keys, axis=0, return_inverse=True)
    faces = inverse.reshape(-1)[mesh.faces]
    a, b, c = faces.T
    vertices = unique * GRID
    keep = (a != b) & (b != c) & (c != a)
    keep &= np.linalg.norm(np.cross(vertices[b] - vertices[a], vertices[c] - vertices[a]), axis=1) > 1e-10
    used, compact = np.unique(faces[keep], return_inverse=True)
    return replace(
        mesh,
        vertices=vertices[used],
        faces=compact.reshape(-1, 3),
        face_parts=mesh.part_of_face[keep],
        uv=None if mesh.uv is None else mesh.uv[keep],
    )


def corner_normals(mesh: Mesh, crease: float = 0.7) -> Array:
    """Return (m, 3, 3) unit corner normals; edges of less than `crease` (rad) are smooth."""
    v = mesh.vertices[mesh.faces]
    area = np.cross(v[:, 1] - v[:, 0], v[:, 2] - v[:, 0])
    unit = area / np.linalg.norm(area, axis=1, keepdims=True)
    order = np.argsort(mesh.faces.reshape(-1), kind="stable")
    corners = np.split(order, np.cumsum(np.bincount(mesh.faces.reshape(-1)))[:-1])
    normals = np.empty((len(mesh.faces) * 3, 3))
    for group in corners:
        face = group // 3
        together = (unit[face] @ unit[face].T > np.cos(crease)).astype(float)
        normals[group] = together @ area[face]
    return (normals / np.linalg.norm(normals, axis=1, keepdims=True)).reshape(-1, 3, 3)


@dataclass(frozen=True, kw_only=True)
class MassProperties:
    mass: float
    """kg"""
    center: Array
    """(3,) m"""
    inertia: Array
    """(3, 3) about the centre of mass; kg m²"""


def mass_properties(mesh: Mesh, mass: float) -> MassProperties:
    """Return the mass properties of the solid at uniform density; overlapping components count twice.

    Source: signed tetrahedra against the origin; the second moment of a tetrahedron with one corner at
    the origin is V/20 (sum of p pᵀ over its corners + s sᵀ), s the sum of the corners.
    """
    p = mesh.vertices[mesh.faces]
    volume = np.einsum("ij,ij->i", p[:, 0], np.cross(p[:, 1], p[:, 2])) / 6.0
    s = p.sum(axis=1)
    total = volume.sum()
    if total <= 0:
        raise ValueError("the mesh encloses no volume; check the winding")
    center = (volume[:, None] * s / 4.0).sum(axis=0) / total
    moments = np.einsum("f,fci,fcj->ij", volume, p, p) + np.einsum("f,fi,fj->ij", volume, s, s)
    second = moments / 20.0 / total - np.outer(center, center)
    return MassProperties(mass=mass, center=center, inertia=mass * (np.trace(second) * np.eye(3) - second))
