"""Distances between links represented by spheres, and pairs that always or never collide in many postures."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from roboyard._arrays import NDArray
from roboyard._numba import njit
from roboyard.description.robot_model import CollisionSphere
from roboyard.transforms import Array

Mask = NDArray[np.bool_]


@dataclass(frozen=True, kw_only=True, eq=False)
class SphereSets:
    """Spheres of all links in one array, with a bounding sphere for each link."""

    spheres: Array
    """(s, 4) centre and radius in the link's frame (m)."""
    start: NDArray[np.int64]
    """(links + 1,) index of the first sphere of each link."""
    around: Array
    """(links, 4) sphere that contains all spheres of a link (m)."""

    @staticmethod
    def of(names: Sequence[str], spheres: Mapping[str, Sequence[CollisionSphere]]) -> SphereSets:
        """Return the spheres of the named links; each must have at least one."""
        rows, start, around = [], [0], []
        for name in names:
            own = np.array([(*sphere.center, sphere.radius) for sphere in spheres[name]], dtype=float)
            middle = 0.5 * ((own[:, :3] - own[:, 3:]).min(axis=0) + (own[:, :3] + own[:, 3:]).max(axis=0))
            reach = float((np.linalg.norm(own[:, :3] - middle, axis=1) + own[:, 3]).max())
            rows.append(own)
            around.append((*middle, reach))
            start.append(start[-1] + len(own))
        table = np.concatenate(rows) if rows else np.zeros((0, 4))
        return SphereSets(spheres=table, start=np.array(start), around=np.array(around).reshape(-1, 4))

    def gaps(self, positions: Array, rotations: Array) -> Array:
        """Return the (links, links) smallest distances between spheres of two links: upper triangle, else inf
        (m).

        Args:
            positions: (links, 3) of the link frames (m).
            rotations: (links, 3, 3) of the link frames.
        """
        count = len(self.around)
        out = np.full((count, count), np.inf)
        world, rough = _placed(positions, rotations, self.spheres, self.start, self.around)
        for i in range(count):
            for j in range(i + 1, count):
                out[i, j] = _gap(world, self.start, rough, i, j, np.inf, -np.inf)
        return out


@dataclass(frozen=True, kw_only=True, eq=False)
class PairCounts:
    """Counts over postures from which follows which pairs of links always or never collide.

    A pair is dropped once it can do neither, so `missed` is a lower bound.
    """

    missed: NDArray[np.int64]
    """(pairs,) number of postures without collision."""
    near: Mask
    """(pairs,) whether the distance was ever within the margin."""

    @staticmethod
    def empty(pairs: int) -> PairCounts:
        """Return zero counts."""
        return PairCounts(missed=np.zeros(pairs, dtype=np.int64), near=np.zeros(pairs, dtype=bool))

    def add(
        self,
        sets: SphereSets,
        pairs: NDArray[np.int64],
        positions: Array,
        rotations: Array,
        *,
        margin: float,
        patience: int,
    ) -> None:
        """Add postures to the counts.

        Args:
            sets: the links' spheres.
            pairs: (pairs, 2) indices of links.
            positions: (postures, links, 3) of the link frames (m).
            rotations: (postures, links, 3, 3) of the link frames.
            margin: distance within which a pair counts as near (m).
            patience: number of postures without collision after which a pair does not always collide.
        """
        count_pairs(
            positions,
            rotations,
            sets.spheres,
            sets.start,
            sets.around,
            pairs,
            margin,
            patience,
            self.missed,
            self.near,
        )


@njit(cache=True, nogil=True)
def _placed(positions, rotations, spheres, start, around):
    """Return the (s, 4) spheres and (links, 4) bounding spheres of one posture in the root's frame (m)."""
    world, rough = np.empty_like(spheres), np.empty_like(around)
    for link in range(around.shape[0]):
        rotation, at = rotations[link], positions[link]
        for k in range(3):
            middle = at[k]
            for m in range(3):
                middle += rotation[k, m] * around[link, m]
            rough[link, k] = middle
        rough[link, 3] = around[link, 3]
        for s in range(start[link], start[link + 1]):
            for k in range(3):
                middle = at[k]
                for m in range(3):
                    middle += rotation[k, m] * spheres[s, m]
                world[s, k] = middle
            world[s, 3] = spheres[s, 3]
    return world, rough


@njit(cache=True, nogil=True)
def _apart(a, b):
    """Return the distance between the surfaces of two spheres (m)."""
    x, y, z = a[0] - b[0], a[1] - b[1], a[2] - b[2]
    return np.sqrt(x * x + y * y + z * z) - a[3] - b[3]


@njit(cache=True, nogil=True)
def _gap(world, start, rough, i, j, reach, enough):
    """Return the smallest distance between spheres of links i and j, exact below `reach`; stops below
    `enough`.
    """
    least = reach
    if _apart(rough[i], rough[j]) > least:
        return least
    for a in range(start[i], start[i + 1]):
        if _apart(world[a], rough[j]) > least:
            continue
        for b in range(start[j], start[j + 1]):
            gap = _apart(world[a], world[b])
            if gap < least:
                least = gap
                if least < enough:
                    return least
    return least


@njit(cache=True, nogil=True)
def count_pairs(positions, rotations, spheres, start, around, pairs, margin, patience, missed, near):
    """See `PairCounts.add`; `missed` and `near` are updated in place."""
    for posture in range(positions.shape[0]):
        world, rough = _placed(positions[posture], rotations[posture], spheres, start, around)
        for k in range(pairs.shape[0]):
            if near[k] and missed[k] > patience:
                continue
            # once a pair has been near, only whether it touches matters
            reach = 0.0 if near[k] else margin
            gap = _gap(world, start, rough, pairs[k, 0], pairs[k, 1], reach, 0.0)
            if gap >= 0.0:
                missed[k] += 1
            if gap < margin:
                near[k] = True
