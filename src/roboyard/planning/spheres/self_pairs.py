"""Pairs of links that need no check: adjacent ones, and those that always or never come close."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from roboyard._lazy import lazy_module
from roboyard.description.model import RobotDescription
from roboyard.planning.kernels.arrays import work_for
from roboyard.planning.obstacles import Obstacles
from roboyard.planning.spheres.sphere_model import Pair, SphereModel, link_contents, sphere_robot
from roboyard.shapes.cache import content_key, load_arrays, store_arrays

_checker = lazy_module("roboyard.planning.kernels.checker")

SAMPLES = 10_000
ALWAYS = 0.95
"""Share of postures with a collision from which a pair counts as always colliding."""
NEVER = 0.02
"""Smallest distance in every posture for a pair to count as never colliding (m)."""
ROUGH = 0.2
"""Share of postures in which spheres of a pair overlap from which its hulls are looked at."""
JUDGED = 5_000
"""Postures in which hulls must not touch for spheres to count as too rough, and overlaps are measured."""
FALSE = 0.01
"""Share of postures in which spheres of a pair overlap and its hulls do not that allows overlaps."""
MISSED = 3.0
"""How much worse an allowed overlap is where hulls touch than a forbidden one where they do not."""
VERSION = 1


def ignored_pairs(model: SphereModel, seed: int = 0) -> frozenset[Pair]:
    """Return pairs of links, names sorted, that may touch or never do; cached on disk.

    Adjacent links, links that overlap at rest, links that overlap in nearly all random postures, and links
    that stay apart in all of them.
    """
    names = [link.name for link in model.description.links if model.spheres.get(link.name)]
    adjacent = adjacent_pairs(model.description, names)
    key = content_key("pairs", VERSION, *link_contents(model), dict(model.retract), sorted(adjacent), seed)
    stored = load_arrays("pairs", key)
    if stored is None:
        stored = {"pairs": np.array(sorted(adjacent | _sampled(model, adjacent, seed)), dtype=str)}
        store_arrays("pairs", key, stored)
    return frozenset((str(a), str(b)) for a, b in stored["pairs"].reshape(-1, 2))


def _sampled(model: SphereModel, adjacent: set[Pair], seed: int) -> set[Pair]:
    if not model.coordinate_names:
        return set()
    from dataclasses import replace

    robot = sphere_robot(replace(model, ignore=frozenset(adjacent)), model.coordinate_names)
    arrays = robot.arrays
    work = work_for(arrays, Obstacles().arrays)
    rest = np.array([model.retract.get(name, 0.0) for name in robot.joint_names])
    postures = np.random.default_rng(seed).uniform(arrays.lower, arrays.upper, (SAMPLES, len(rest)))
    postures[0] = np.clip(rest, arrays.lower, arrays.upper)
    touching = np.zeros(len(arrays.pairs), dtype=np.int64)
    near = np.zeros(len(arrays.pairs), dtype=np.int64)
    _checker().count_pairs(arrays, postures[:1], NEVER, work, touching, near)
    at_rest = touching > 0
    _checker().count_pairs(arrays, postures[1:], NEVER, work, touching, near)
    chosen = at_rest | (touching >= ALWAYS * SAMPLES) | (near == 0)
    named = [(robot.links[a], robot.links[b]) for a, b in arrays.pairs]
    return {(min(pair), max(pair)) for pair, use in zip(named, chosen, strict=True) if use}


def rough_pairs(model: SphereModel, seed: int = 0) -> frozenset[Pair]:
    """Return pairs of links, names sorted, whose spheres often overlap where their hulls never do; cached.

    Their spheres would close postures that are free, so that only exact shapes judge them.
    """
    key = content_key("rough", VERSION, ROUGH, *link_contents(model), seed)
    stored = load_arrays("rough", key)
    if stored is None:
        found = sorted(_rough(model, seed))
        stored = {"pairs": np.array(found, dtype=str).reshape(-1, 2)}
        store_arrays("rough", key, stored)
    return frozenset((str(a), str(b)) for a, b in stored["pairs"].reshape(-1, 2))


def allowed_overlaps(model: SphereModel, seed: int = 0) -> dict[Pair, float]:
    """Return pairs of links, names sorted, and how deep their spheres may overlap in a search (m); cached.

    Spheres are larger than the hulls that they enclose. The depth is the one that separates random postures
    whose hulls touch from the others with the fewest errors; exact shapes judge what a search with it finds.
    """
    key = content_key(
        "overlaps", VERSION, FALSE, MISSED, *link_contents(model), sorted(model.rough | model.apart), seed
    )
    stored = load_arrays("overlaps", key)
    if stored is None:
        found = _overlaps(model, seed)
        stored = {
            "pairs": np.array(list(found), dtype=str).reshape(-1, 2),
            "depths": np.array(list(found.values()), dtype=float),
        }
        store_arrays("overlaps", key, stored)
    rows = zip(stored["pairs"].reshape(-1, 2), stored["depths"], strict=True)
    return {(str(a), str(b)): float(depth) for (a, b), depth in rows}


def _overlaps(model: SphereModel, seed: int) -> dict[Pair, float]:
    if not model.coordinate_names:
        return {}
    from roboyard.planning.hull_judge import judge_of

    robot = sphere_robot(model, model.coordinate_names)
    arrays, world = robot.arrays, Obstacles().arrays
    if not len(arrays.pairs):
        return {}
    random = np.random.default_rng(seed)
    postures = random.uniform(arrays.lower, arrays.upper, (JUDGED, len(arrays.lower)))
    work = work_for(arrays, world)
    depths, links = np.zeros((JUDGED, len(arrays.pairs))), np.zeros(len(arrays.node))
    for q, row in zip(postures, depths, strict=True):
        _checker().all_gaps(arrays, world, q, 0.0, 0.0, work, links, row)
    depths = -depths
    named = [tuple(sorted((robot.links[a], robot.links[b]))) for a, b in arrays.pairs]
    touching = np.zeros(depths.shape, dtype=bool)
    column = {pair: p for p, pair in enumerate(named)}
    judge = judge_of(robot, ())
    for i in np.flatnonzero((depths > 0).any(axis=1)):
        for clash in judge.clashes(postures[i]):
            p = column.get((min(clash.link, clash.other), max(clash.link, clash.other)))
            if p is not None:
                touching[i, p] = True
    found = {}
    for p, pair in enumerate(named):
        free, hit = np.sort(depths[~touching[:, p], p]), np.sort(depths[touching[:, p], p])
        free = free[free > 0]
        if len(free) < FALSE * JUDGED:
            continue
        forbidden = len(free) - 1 - np.arange(len(free))  # of the free ones, with the depth of each allowed
        allowed = np.searchsorted(hit, free, side="right")
        cost = forbidden + MISSED * allowed
        best = int(np.argmin(cost))
        if cost[best] < len(free):
            found[pair] = float(free[best])
    return found


def _rough(model: SphereModel, seed: int) -> set[Pair]:
    if not model.coordinate_names:
        return set()
    from roboyard.planning.hull_judge import judge_of

    robot = sphere_robot(model, model.coordinate_names)
    arrays = robot.arrays
    if not len(arrays.pairs):
        return set()
    random = np.random.default_rng(seed)
    postures = random.uniform(arrays.lower, arrays.upper, (SAMPLES, len(arrays.lower)))
    work = work_for(arrays, Obstacles().arrays)
    touching, near = np.zeros((2, len(arrays.pairs)), dtype=np.int64)
    _checker().count_pairs(arrays, postures, NEVER, work, touching, near)
    named = [(robot.links[a], robot.links[b]) for a, b in arrays.pairs]
    often = {(min(pair), max(pair)) for pair, n in zip(named, touching, strict=True) if n >= ROUGH * SAMPLES}
    if not often:
        return set()
    judge = judge_of(robot, ())
    for q in postures[:JUDGED]:
        for clash in judge.clashes(q):
            often.discard((min(clash.link, clash.other), max(clash.link, clash.other)))
        if not often:
            break
    return often


def adjacent_pairs(description: RobotDescription, names: Sequence[str]) -> set[Pair]:
    """Return pairs of named links, sorted, that one joint connects, directly or through links not named, and
    pairs that cannot move relative to each other.
    """
    named, pairs = set(names), set()
    above: dict[str, str | None] = {description.root.name: None}
    body = {description.root.name: description.root.name}
    members: dict[str, list[str]] = {}
    for joint in description.depth_first_joints:
        near = joint.parent if joint.parent in named else above[joint.parent]
        above[joint.child] = near
        body[joint.child] = joint.child if joint.is_moving else body[joint.parent]
        if joint.child in named and near is not None:
            pairs.add((min(near, joint.child), max(near, joint.child)))
    for name in names:
        members.setdefault(body[name], []).append(name)
    for group in members.values():
        pairs |= {(min(a, b), max(a, b)) for i, a in enumerate(group) for b in group[i + 1 :]}
    # links fixed to the two sides of a joint meet there as the two links themselves do
    for joint in description.joints:
        if joint.is_moving:
            for a in members.get(body[joint.parent], []):
                for b in members.get(joint.child, []):
                    pairs.add((min(a, b), max(a, b)))
    return pairs
