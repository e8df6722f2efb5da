"""Links as bundles of balls: how far apart two are, and which pairs always or never meet in many postures."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from roboyard.description.robot_model import CollisionSphere
from roboyard.transforms import Array

Mask = NDArray[np.bool_]


@dataclass(frozen=True, kw_only=True, eq=False)
class SphereSets:
    """Balls of all links in one array, with one ball round each link."""

    balls: Array
    """(s, 4) centre and radius in the link's frame; m"""
    start: NDArray[np.int64]
    """(links + 1,) first ball of each link."""
    around: Array
    """(links, 4) a ball that holds all of a link's."""

    @staticmethod
    def of(names: Sequence[str], spheres: Mapping[str, Sequence[CollisionSphere]]) -> SphereSets:
        """The named links' balls; each has at least one."""
        rows, start, around = [], [0], []
        for name in names:
            own = np.array([(*ball.center, ball.radius) for ball in spheres[name]], dtype=float)
            middle = 0.5 * ((own[:, :3] - own[:, 3:]).min(axis=0) + (own[:, :3] + own[:, 3:]).max(axis=0))
            reach = float((np.linalg.norm(own[:, :3] - middle, axis=1) + own[:, 3]).max())
            rows.append(own)
            around.append((*middle, reach))
            start.append(start[-1] + len(own))
        balls = np.concatenate(rows) if rows else np.zeros((0, 4))
        return SphereSets(balls=balls, start=np.array(start), around=np.array(around).reshape(-1, 4))

    def gaps(self, positions: Array, rotations: Array) -> Array:
        """(links, links) least distance between the balls of two links, upper triangle, infinite below; m.

        Args:
            positions: (links, 3) of the link frames; m.
            rotations: (links, 3, 3) of the same.
        """
        count = len(self.around)
        out = np.full((count, count), np.inf)
        world, rough = _placed(positions, rotations, self.balls, self.start, self.around)
        for i in range(count):
            for j in range(i + 1, count):
                out[i, j] = _gap(world, self.start, rough, i, j, np.inf, -np.inf)
        return out


@dataclass(frozen=True, kw_only=True, eq=False)
class PairCounts:
    """How pairs of links fare over postures, as far as is needed to tell which always or never meet.

    A pair is dropped once both are out of the question, so `missed` is a lower bound.
    """

    missed: NDArray[np.int64]
    """(pairs,) postures in which the two were apart."""
    near: Mask
    """(pairs,) whether they ever came within the margin of each other."""

    @staticmethod
    def empty(pairs: int) -> PairCounts:
        """Nothing seen yet."""
        return PairCounts(missed=np.zeros(pairs, dtype=np.int64), near=np.zeros(pairs, dtype=bool))

    def add(
        self,
        bundles: SphereSets,
        pairs: NDArray[np.int64],
        positions: Array,
        rotations: Array,
        *,
        margin: float,
        patience: int,
    ) -> None:
        """Count more postures.

        Args:
            bundles: the links' balls.
            pairs: (pairs, 2) links to watch.
            positions: (postures, links, 3) of the link frames; m.
            rotations: (postures, links, 3, 3) of the same.
            margin: distance within which a pair counts as near; m.
            patience: postures apart after which a pair cannot be said to meet always.
        """
        count_pairs(
            positions,
            rotations,
            bundles.balls,
            bundles.start,
            bundles.around,
            pairs,
            margin,
            patience,
            self.missed,
            self.near,
        )


@njit(cache=True)
def _placed(positions, rotations, balls, start, around):
    """World (s, 4) balls and (links, 4) balls round links of one posture."""
    world, rough = np.empty_like(balls), np.empty_like(around)
    for link in range(around.shape[0]):
        turn, at = rotations[link], positions[link]
        for k in range(3):
            middle = at[k]
            for m in range(3):
                middle += turn[k, m] * around[link, m]
            rough[link, k] = middle
        rough[link, 3] = around[link, 3]
        for s in range(start[link], start[link + 1]):
            for k in range(3):
                middle = at[k]
                for m in range(3):
                    middle += turn[k, m] * balls[s, m]
                world[s, k] = middle
            world[s, 3] = balls[s, 3]
    return world, rough


@njit(cache=True)
def _apart(a, b):
    """Distance between the surfaces of two balls."""
    x, y, z = a[0] - b[0], a[1] - b[1], a[2] - b[2]
    return np.sqrt(x * x + y * y + z * z) - a[3] - b[3]


@njit(cache=True)
def _gap(world, start, rough, i, j, reach, enough):
    """Least distance between the balls of links i and j, exact below `reach`; stops at one below `enough`."""
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


@njit(cache=True)
def count_pairs(positions, rotations, balls, start, around, pairs, margin, patience, missed, near):
    """See `PairCounts.add`; `missed` and `near` are updated in place."""
    for posture in range(positions.shape[0]):
        world, rough = _placed(positions[posture], rotations[posture], balls, start, around)
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
