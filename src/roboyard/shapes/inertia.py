"""Mass, centre of mass and inertia of solids of uniform density.

Closed forms for the primitives, exact integration over a closed mesh, the convex hull of a mesh that is not
closed, the bounding box of one that is flat. All functions use plain numbers and arrays.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Literal

import numpy as np

from roboyard._arrays import ArrayLike, NDArray
from roboyard._records import dataclass
from roboyard.shapes.mesh import bounding_box

Array = NDArray[np.float64]

DEFAULT_DENSITY = 1000.0
"""Density of water (kg/m³). Links are metal and plastic (1000 to 8000) around air: mostly 300 to 3000."""

THIN = 1e-3
"""Thickness assumed for a flat mesh (m)."""

Solid = Literal["primitive", "closed mesh", "convex hull", "bounding box"]


@dataclass(frozen=True, kw_only=True, eq=False)
class SolidInertia:
    """Mass, centre of mass and inertia tensor of a rigid solid, in one frame."""

    mass: float
    """Mass (kg)."""
    center: Array
    """(3,) centre of mass (m)."""
    inertia: Array
    """(3, 3) inertia about the centre of mass, along the frame's axes (kg m²)."""
    solid: Solid = "primitive"
    """Kind of shape from which the values were computed."""

    def scaled_to(self, mass: float) -> SolidInertia:
        """Return the same solid at the density that gives `mass` (kg)."""
        factor = mass / self.mass
        return SolidInertia(mass=mass, center=self.center, inertia=self.inertia * factor, solid=self.solid)

    def moved(self, position: ArrayLike, rotation: ArrayLike) -> SolidInertia:
        """Return the solid in a frame where its own frame has this (3,) position (m) and (3, 3) rotation."""
        turn = np.asarray(rotation, dtype=float)
        return SolidInertia(
            mass=self.mass,
            center=turn @ self.center + np.asarray(position, dtype=float),
            inertia=turn @ self.inertia @ turn.T,
            solid=self.solid,
        )

    def about(self, center: ArrayLike) -> SolidInertia:
        """Return the solid with its inertia about another point (3,) (m), which counts as its centre."""
        point = np.asarray(center, dtype=float)
        offset = self.center - point
        shift = self.mass * (offset @ offset * np.eye(3) - np.outer(offset, offset))
        return SolidInertia(mass=self.mass, center=point, inertia=self.inertia + shift, solid=self.solid)


def box(size: ArrayLike, density: float = DEFAULT_DENSITY) -> SolidInertia:
    """Return the inertia of a centred box of full extents `size` (3,) (m)."""
    x, y, z = np.asarray(size, dtype=float)
    mass = density * x * y * z
    return _diagonal(mass, mass / 12.0 * np.array([y * y + z * z, x * x + z * z, x * x + y * y]))


def sphere(radius: float, density: float = DEFAULT_DENSITY) -> SolidInertia:
    """Return the inertia of a centred sphere (m)."""
    mass = density * 4.0 / 3.0 * math.pi * radius**3
    return _diagonal(mass, np.full(3, 0.4 * mass * radius**2))


def cylinder(radius: float, length: float, density: float = DEFAULT_DENSITY) -> SolidInertia:
    """Return the inertia of a centred cylinder along z (m)."""
    mass = density * math.pi * radius**2 * length
    across = mass * (3.0 * radius**2 + length**2) / 12.0
    return _diagonal(mass, np.array([across, across, 0.5 * mass * radius**2]))


def capsule(radius: float, length: float, density: float = DEFAULT_DENSITY) -> SolidInertia:
    """Return the inertia of a centred capsule: a cylinder of `length` along z with half spheres (m)."""
    tube = cylinder(radius, length, density)
    caps = sphere(radius, density)
    # the centre of mass of each half sphere is 3r/8 outside the end of the cylinder
    offset = 0.5 * length + 0.375 * radius
    own = 83.0 / 320.0 * caps.mass * radius**2  # both half spheres about axes through their own centres
    across = tube.inertia[0, 0] + own + caps.mass * offset**2
    along = tube.inertia[2, 2] + caps.inertia[2, 2]
    return _diagonal(tube.mass + caps.mass, np.array([across, across, along]))


def mesh(vertices: ArrayLike, faces: ArrayLike, density: float = DEFAULT_DENSITY) -> SolidInertia:
    """Return the inertia of the solid that a triangle mesh bounds.

    A closed, consistently wound mesh (inwards or outwards) gives the solid itself; others their convex hull,
    or a bounding box at least 1 mm thick where the hull is flat.

    Args:
        vertices: (n, 3) positions (m).
        faces: (m, 3) vertex indices.
        density: density (kg/m³).

    Raises:
        ValueError: no vertices, or some are not finite.
    """
    points, triangles = np.asarray(vertices, dtype=float), np.asarray(faces)
    if len(points) == 0 or not np.isfinite(points).all():
        raise ValueError(f"mass properties need finite vertices, got {points.tolist()[:3]} of {len(points)}")
    if len(triangles) and is_closed(points, triangles):
        solid = inside_of(points, triangles, density)
        if solid is not None:
            return solid
    return hull_of(points, density)


def inside_of(vertices: Array, faces: NDArray, density: float = DEFAULT_DENSITY) -> SolidInertia | None:
    """Return the inertia inside a closed surface of (n, 3) vertices (m) and (m, 3) faces.

    None where the volume is under 0.1 % of the bounding box.
    """
    volume, center, second = volume_integrals(vertices, faces)
    if volume > 1e-3 * _box_volume(vertices) and _is_positive(second, volume):
        return _from_integrals(volume, center, second, density, "closed mesh")
    return None


def hull_of(points: ArrayLike, density: float = DEFAULT_DENSITY) -> SolidInertia:
    """Return the inertia of the convex hull of (n, 3) points (m), or of their bounding box if flat."""
    cloud = np.asarray(points, dtype=float)
    return hull_or_box(convex_hull(cloud), cloud, density)


def hull_or_box(
    hull: tuple[Array, NDArray] | None, cloud: Array, density: float = DEFAULT_DENSITY
) -> SolidInertia:
    """Return the inertia of a `convex_hull`, or if it is None of the (n, 3) points' bounding box (m)."""
    if hull is not None:
        volume, center, second = volume_integrals(*hull)
        if volume > 0 and _is_positive(second, volume):
            return _from_integrals(volume, center, second, density, "convex hull")
    lower, upper = cloud.min(axis=0), cloud.max(axis=0)
    solid = box(np.maximum(upper - lower, THIN), density)
    return SolidInertia(
        mass=solid.mass, center=(lower + upper) / 2.0, inertia=solid.inertia, solid="bounding box"
    )


def combined(parts: Sequence[SolidInertia]) -> SolidInertia:
    """Return several solids in one frame as one (overlaps count twice); `solid` is that of the heaviest.

    Raises:
        ValueError: no parts, or no mass.
    """
    mass = sum(part.mass for part in parts)
    if not mass > 0:
        raise ValueError(f"the mass of all parts must be above 0, got {mass} kg of {len(parts)} parts")
    center = np.sum([part.mass * part.center for part in parts], axis=0) / mass
    inertia = np.zeros((3, 3))
    for part in parts:
        inertia += part.about(center).inertia
    heaviest = max(parts, key=lambda part: part.mass)
    return SolidInertia(mass=mass, center=center, inertia=inertia, solid=heaviest.solid)


def principal_moments(inertia: ArrayLike) -> Array:
    """Return the (3,) principal moments of a symmetric (3, 3) tensor, smallest first (kg m²)."""
    return np.linalg.eigvalsh(np.asarray(inertia, dtype=float))


def is_physical(inertia: ArrayLike, tolerance: float = 1e-6) -> bool:
    """Whether a (3, 3) tensor (kg m²) is physical: positive moments, none above the sum of the others."""
    small, middle, large = principal_moments(inertia)
    return bool(small > 0 and small + middle >= large * (1.0 - tolerance))


# ----------------------------------------------------------------------------------------------- triangles


def is_closed(vertices: Array, faces: NDArray) -> bool:
    """Whether (m, 3) faces are closed: every edge has one opposite edge once (n, 3) vertices are welded."""
    welded, triangles = weld(vertices, faces)
    if len(triangles) < 4:
        return False
    count = len(welded)
    tails = triangles.ravel().astype(np.int64)
    heads = np.roll(triangles, -1, axis=1).ravel().astype(np.int64)
    there, back = tails * count + heads, heads * count + tails
    there.sort()
    back.sort()
    return bool(np.array_equal(there, back)) and bool((np.diff(there) > 0).all())


def weld(vertices: Array, faces: NDArray) -> tuple[Array, NDArray]:
    """Merge (n, 3) vertices at equal positions (to 1e-7 of the mesh's size); drop collapsed (m, 3) faces."""
    points = np.ascontiguousarray(vertices, dtype=float)
    lower, upper = bounding_box(points) if len(points) else np.zeros((2, 3))
    extent = float((upper - lower).max())
    if extent <= 0 or not math.isfinite(extent):
        return points, np.empty((0, 3), dtype=np.int64)
    # three 21-bit grid coordinates in one integer sort far faster than rows
    grid = np.rint((points - lower) * ((2**21 - 1) / extent)).astype(np.int64)
    keys = (grid[:, 0] << 42) | (grid[:, 1] << 21) | grid[:, 2]
    _, first, inverse = np.unique(keys, return_index=True, return_inverse=True)
    triangles = inverse.reshape(-1)[np.asarray(faces, dtype=np.int64)]
    a, b, c = triangles.T
    return points[first], triangles[(a != b) & (b != c) & (c != a)]


def convex_hull(points: Array) -> tuple[Array, NDArray] | None:
    """Return (k, 3) vertices and (f, 3) outward faces of the hull of (n, 3) points.

    None where they are flat.
    """
    from roboyard._qhull import qhull

    ConvexHull, QhullError = qhull()

    lower, upper = bounding_box(points)
    size = float((upper - lower).max())
    if len(points) < 4 or not size > 0:
        return None
    unit = (points - lower) / size
    try:
        hull = ConvexHull(unit)
    except QhullError:
        return None
    if hull.volume < 1e-9:
        return None
    used = hull.vertices
    index = np.full(len(points), -1)
    index[used] = np.arange(len(used))
    corners = points[used]
    faces = index[hull.simplices]
    a, b, c = (unit[used][faces[:, k]] for k in range(3))
    inward = np.einsum("ij,ij->i", np.cross(b - a, c - a), hull.equations[:, :3]) < 0
    faces[inward] = faces[inward][:, ::-1]
    return corners, faces


def volume_integrals(vertices: Array, faces: NDArray) -> tuple[float, Array, Array]:
    """Return volume (m³), (3,) centroid (m), (3, 3) second moments ∫(x-c)(x-c)ᵀdV (m⁵) in a closed surface.

    Inward and outward winding give the same values.
    Source: signed tetrahedra from one point, Blow and Binstock, "How to find the inertia tensor" (2004).
    """
    origin = vertices.mean(axis=0)
    corners = (vertices - origin)[faces]
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    six = np.einsum("ij,ij->i", a, np.cross(b, c))
    volume = float(six.sum()) / 6.0
    if volume == 0.0:
        return 0.0, origin, np.zeros((3, 3))
    total = a + b + c
    center = (six @ total) / (24.0 * volume)
    second = (
        np.einsum("i,ij,ik->jk", six, total, total)
        + np.einsum("i,ij,ik->jk", six, a, a)
        + np.einsum("i,ij,ik->jk", six, b, b)
        + np.einsum("i,ij,ik->jk", six, c, c)
    ) / 120.0
    second -= volume * np.outer(center, center)
    return abs(volume), origin + center, second * math.copysign(1.0, volume)


def _diagonal(mass: float, moments: Array) -> SolidInertia:
    return SolidInertia(mass=float(mass), center=np.zeros(3), inertia=np.diag(moments))


def _from_integrals(
    volume: float, center: Array, second: Array, density: float, solid: Solid
) -> SolidInertia:
    inertia = density * (np.trace(second) * np.eye(3) - second)
    return SolidInertia(
        mass=density * volume, center=center, inertia=(inertia + inertia.T) / 2.0, solid=solid
    )


def _is_positive(second: Array, volume: float) -> bool:
    return bool(volume > 0 and np.linalg.eigvalsh(second)[0] > 0)


def _box_volume(points: Array) -> float:
    return float(np.prod(points.max(axis=0) - points.min(axis=0)))
