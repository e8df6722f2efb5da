"""Distance along a ray to its first hit on a solid, or -1.

Rays start at o with unit direction d, both in the solid's frame; s are MuJoCo's sizes. As in MuJoCo, a ray
that starts inside hits the surface from inside, and a plane is hit from above only.
"""

from __future__ import annotations

import numpy as np

from roboyard._numba import njit

PLANE, SPHERE, CAPSULE, ELLIPSOID, CYLINDER, BOX = 0, 2, 3, 4, 5, 6
"""As in mujoco.mjtGeom."""


@njit(cache=True, inline="always")
def _nearest(a, b, c):  # pragma: no cover
    """Smallest root at least 0 of a t² + 2 b t + c, or -1; a > 0."""
    root = b * b - a * c
    if root < 0.0:
        return -1.0
    root = np.sqrt(root)
    if -b - root >= 0.0:
        return (-b - root) / a
    if -b + root >= 0.0:
        return (-b + root) / a
    return -1.0


@njit(cache=True)
def box(ox, oy, oz, dx, dy, dz, sx, sy, sz):  # pragma: no cover
    """Slabs: the ray is inside from the last entry to the first exit."""
    enter, leave = -np.inf, np.inf
    for o, d, s in ((ox, dx, sx), (oy, dy, sy), (oz, dz, sz)):
        if abs(d) < 1e-15:
            if abs(o) > s:
                return -1.0
            continue
        inverse = 1.0 / d
        a, b = (-s - o) * inverse, (s - o) * inverse
        if a > b:
            a, b = b, a
        enter, leave = max(enter, a), min(leave, b)
    if enter > leave or leave < 0.0:
        return -1.0
    return enter if enter >= 0.0 else leave


@njit(cache=True)
def capsule(ox, oy, oz, dx, dy, dz, r, half):  # pragma: no cover
    """A cylinder between two spheres; from inside, the exit is the last of the three exits."""
    inside = ox * ox + oy * oy + (oz - min(max(oz, -half), half)) ** 2 < r * r
    best = -1.0
    a, b, c = dx * dx + dy * dy, ox * dx + oy * dy, ox * ox + oy * oy - r * r
    if a > 1e-15:
        root = b * b - a * c
        if root >= 0.0:
            t = (-b + np.sqrt(root)) / a if inside else (-b - np.sqrt(root)) / a
            if t >= 0.0 and abs(oz + t * dz) <= half:
                best = t
    for z in (-half, half):
        b = ox * dx + oy * dy + (oz - z) * dz
        root = b * b - (ox * ox + oy * oy + (oz - z) ** 2 - r * r)
        if root < 0.0:
            continue
        t = -b + np.sqrt(root) if inside else -b - np.sqrt(root)
        outer = (oz + t * dz) * z >= 0.0 and abs(oz + t * dz) >= half if half > 0.0 else True
        if t >= 0.0 and outer and (best < 0.0 or t < best):
            best = t
    return best


@njit(cache=True)
def cylinder(ox, oy, oz, dx, dy, dz, r, half):  # pragma: no cover
    """A tube cut by two discs."""
    enter, leave = -np.inf, np.inf
    a, b, c = dx * dx + dy * dy, ox * dx + oy * dy, ox * ox + oy * oy - r * r
    if a > 1e-15:
        root = b * b - a * c
        if root < 0.0:
            return -1.0
        root = np.sqrt(root)
        enter, leave = (-b - root) / a, (-b + root) / a
    elif c > 0.0:
        return -1.0
    if abs(dz) > 1e-15:
        low, high = (-half - oz) / dz, (half - oz) / dz
        if low > high:
            low, high = high, low
        enter, leave = max(enter, low), min(leave, high)
    elif abs(oz) > half:
        return -1.0
    if enter > leave or leave < 0.0:
        return -1.0
    return enter if enter >= 0.0 else leave


@njit(cache=True)
def meet(kind, ox, oy, oz, dx, dy, dz, sx, sy, sz):  # pragma: no cover
    """Distance to the first surface of a solid of any of these kinds, or -1."""
    if kind == BOX:
        return box(ox, oy, oz, dx, dy, dz, sx, sy, sz)
    if kind == CYLINDER:
        return cylinder(ox, oy, oz, dx, dy, dz, sx, sy)
    if kind == CAPSULE:
        return capsule(ox, oy, oz, dx, dy, dz, sx, sy)
    if kind == SPHERE:
        return _nearest(1.0, ox * dx + oy * dy + oz * dz, ox * ox + oy * oy + oz * oz - sx * sx)
    if kind == ELLIPSOID:
        ix, iy, iz = 1.0 / (sx * sx), 1.0 / (sy * sy), 1.0 / (sz * sz)
        return _nearest(
            dx * dx * ix + dy * dy * iy + dz * dz * iz,
            ox * dx * ix + oy * dy * iy + oz * dz * iz,
            ox * ox * ix + oy * oy * iy + oz * oz * iz - 1.0,
        )
    if dz > -1e-15 or oz < 0.0:  # a plane from below, or along it
        return -1.0
    t = -oz / dz
    if (sx > 0.0 and abs(ox + t * dx) > sx) or (sy > 0.0 and abs(oy + t * dy) > sy):
        return -1.0
    return t
