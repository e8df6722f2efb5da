"""Limbs that mirror each other, and the axes of the robot that follow from them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from roboyard.morphology.limbs.chains import Limb
from roboyard.morphology.skeleton import Skeleton
from roboyard.transforms import Array

LENGTH_TOLERANCE = 0.15
"""Largest difference of two limbs' segments, as a share of their length."""
PLACE_TOLERANCE = 0.12
"""Largest distance of a limb's beginning from the other's mirror image, as a share of their distance."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Pair:
    """Two limbs of a hub that mirror each other."""

    first: Limb
    second: Limb
    normal: int
    """Index of the axis across the mirror plane: 0 for x, 1 for y, 2 for z."""
    error: float
    """Distance from symmetry; 0 for perfect."""


def alike(skeleton: Skeleton, a: Limb, b: Limb) -> bool:
    """Return whether two limbs have joints of equal types and segments of equal lengths."""
    if len(a.joints) != len(b.joints):
        return False
    if [_kind(skeleton, n) for n in a.joints] != [_kind(skeleton, n) for n in b.joints]:
        return False
    one, two = segments(skeleton, a), segments(skeleton, b)
    total = max(one.sum(), two.sum(), 1e-9)
    return float(np.abs(one - two).max(initial=0.0)) <= LENGTH_TOLERANCE * total


def similar_group(skeleton: Skeleton, limbs: Sequence[Limb]) -> list[Limb]:
    """Return the most limbs of one hub with equally many joints, at least two, and about equal lengths."""
    best: list[Limb] = []
    for limb in limbs:
        group = [other for other in limbs if other.hub == limb.hub and _similar(skeleton, limb, other)]
        best = max(best, group, key=len)
    return best


def _similar(skeleton: Skeleton, a: Limb, b: Limb) -> bool:
    if len(a.joints) != len(b.joints) or len(a.joints) < 2:
        return False
    one, two = skeleton.reach(a.joints[0]), skeleton.reach(b.joints[0])
    return alike(skeleton, a, b) or min(one, two) > 0.7 * max(one, two)


def segments(skeleton: Skeleton, limb: Limb) -> Array:
    """Return the (n,) distances between a limb's joints (m)."""
    spots = np.array([skeleton.origin(name) for name in limb.joints]).reshape(-1, 3)
    return np.linalg.norm(np.diff(spots, axis=0), axis=1)


def find_pairs(skeleton: Skeleton, limbs: Sequence[Limb]) -> tuple[Pair, ...]:
    """Return the mirrored pairs, each limb in one at most; the most symmetrical first."""
    found = []
    for index, first in enumerate(limbs):
        for second in limbs[index + 1 :]:
            if first.hub == second.hub and alike(skeleton, first, second):
                pair = _mirrored(skeleton, first, second)
                if pair is not None:
                    found.append(pair)
    found.sort(key=lambda pair: (round(pair.error, 2), pair.normal != 1, pair.normal))
    chosen: list[Pair] = []
    for pair in found:
        if not any(limb in (p.first, p.second) for p in chosen for limb in (pair.first, pair.second)):
            chosen.append(pair)
    return tuple(chosen)


def _mirrored(skeleton: Skeleton, first: Limb, second: Limb) -> Pair | None:
    here = np.array([skeleton.origin(name) for name in first.joints])
    there = np.array([skeleton.origin(name) for name in second.joints])
    between = here.mean(axis=0) - there.mean(axis=0)
    start = here[0] - there[0]
    if np.linalg.norm(start) > 0.2 * np.linalg.norm(
        between
    ):  # where limbs begin says more than how they hang
        between = start
    apart = float(np.linalg.norm(between))
    if apart < 1e-4:
        return None
    errors = []
    for normal in range(3):
        rest = [axis for axis in range(3) if axis != normal]
        errors.append(float(np.linalg.norm(between[rest])) / apart)
    normal = int(np.argmin(errors))
    if errors[normal] > PLACE_TOLERANCE:
        return None
    return Pair(first=first, second=second, normal=normal, error=errors[normal])


def _kind(skeleton: Skeleton, name: str) -> str:
    kind = skeleton.joint[name].type
    return "revolute" if kind == "continuous" else kind
