"""Up and left of a robot with limbs, from their symmetry and their names; some files are drawn with y up."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from roboyard.morphology.limbs.chains import Limb
from roboyard.morphology.limbs.pairs import Pair, similar_group
from roboyard.morphology.skeleton import Skeleton
from roboyard.morphology.words import count
from roboyard.transforms import Array

FLAT = 0.15
"""Largest spread of the hips of several legs along the upright axis, as a share of their largest spread."""


def find_directions(skeleton: Skeleton, limbs: Sequence[Limb], pairs: Sequence[Pair]) -> tuple[Array, Array]:
    """Return up and left, unit vectors (3,) along axes of the base link's frame: z and y where nothing
    speaks against them.
    """
    up = _up(skeleton, limbs, pairs)
    return up, _left(skeleton, limbs, pairs, up)


def _up(skeleton: Skeleton, limbs: Sequence[Limb], pairs: Sequence[Pair]) -> Array:
    group = similar_group(skeleton, limbs)
    if len(group) >= 4:
        hips = np.array([skeleton.origin(limb.joints[0]) for limb in group])
        spread = np.ptp(hips, axis=0)
        if spread[1] < FLAT * spread.max() and spread[2] > 2 * FLAT * spread.max():
            down = np.mean([skeleton.origin(limb.joints[-1])[1] for limb in group]) - hips[:, 1].mean()
            return np.array([0.0, 1.0 if down <= 0 else -1.0, 0.0])
        return np.array([0.0, 0.0, 1.0])
    normals = [pair.normal for pair in pairs if len(pair.first.joints) > 1]
    if normals and all(normal == 2 for normal in normals):
        return np.array([0.0, 1.0, 0.0])
    return np.array([0.0, 0.0, 1.0])


def _left(skeleton: Skeleton, limbs: Sequence[Limb], pairs: Sequence[Pair], up: Array) -> Array:
    across = _apart(skeleton, limbs, "left", "right", up)
    if across is not None:
        return across
    ahead = _apart(skeleton, limbs, "front", "rear", up)
    if ahead is not None:
        return np.cross(up, ahead)
    normals = [pair.normal for pair in pairs if abs(up[pair.normal]) < 0.5]
    if normals and sum(normal == 0 for normal in normals) > len(normals) / 2:
        return np.cross(up, [0.0, 1.0, 0.0]) if up[2] else np.array([-1.0, 0.0, 0.0])
    return np.cross(up, [1.0, 0.0, 0.0])


def _apart(skeleton: Skeleton, limbs: Sequence[Limb], one: str, other: str, up: Array) -> Array | None:
    """Return the axis from the limbs of one name to those of the other; None where names say nothing."""
    places: dict[str, list[Array]] = {one: [], other: []}
    for limb in limbs:
        names = [text for name in limb.joints for text in (name, skeleton.joint[name].child)]
        votes = count(one, names), count(other, names)
        if votes[0] != votes[1]:
            middle = np.mean([skeleton.origin(name) for name in limb.joints], axis=0)
            places[one if votes[0] > votes[1] else other].append(middle)
    if not places[one] or not places[other]:
        return None
    apart = np.mean(places[one], axis=0) - np.mean(places[other], axis=0)
    apart = apart - float(apart @ up) * up
    axis = int(np.abs(apart).argmax())
    if abs(apart[axis]) < 1e-3:
        return None
    found = np.zeros(3)
    found[axis] = np.sign(apart[axis])
    return found
