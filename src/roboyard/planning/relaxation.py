"""Paddings that fit a start and goals closer to obstacles than the spheres allow."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from roboyard._lazy import lazy_module
from roboyard.planning.hull_judge import Clash
from roboyard.planning.kernels.arrays import Array, RobotArrays, WorldArrays, work_for
from roboyard.planning.spheres.sphere_model import SphereRobot

_checker = lazy_module("roboyard.planning.kernels.checker")

ROOM = 0.0025
"""Gap that starts and goals get (m): motion checks need more than their own padding of 1 mm."""
RAISE = 0.004
"""Padding added to a link that the judge finds touching (m)."""


def relax(robot: RobotArrays, world: WorldArrays, postures: Array) -> tuple[RobotArrays, bool]:
    """Return the robot with smaller paddings where its spheres overlap at one of (g, n) postures, and whether
    any changed.

    Spheres are larger than the shapes that they enclose; exact shapes have to judge paths found with these
    paddings.
    """
    links, pairs = _gaps(robot, world, postures)
    pad = robot.pad + np.minimum(links - ROOM, 0.0)
    pair_pad = robot.pair_pad + np.minimum(pairs - ROOM, 0.0)
    changed = bool((links < ROOM).any() or (pairs < ROOM).any())
    return (robot._replace(pad=pad, pair_pad=pair_pad), changed) if changed else (robot, False)


def raise_padding(
    robot: RobotArrays,
    spheres: SphereRobot,
    clashes: Sequence[Clash],
    world: WorldArrays,
    start: Array,
    goals: Array,
) -> RobotArrays:
    """Return the robot with more padding of links that touched, as start (n,) and goals (g, n) allow."""
    pad, pair_pad = robot.pad.copy(), robot.pair_pad.copy()
    links, pairs = _gaps(robot, world, np.concatenate([start[None], goals]))
    index = {name: i for i, name in enumerate(spheres.links)}
    for clash in clashes:
        if clash.is_self:
            chosen = {index.get(clash.link, -1), index.get(clash.other, -1)}
            for p, pair in enumerate(robot.pairs):
                if set(pair.tolist()) == chosen:
                    pair_pad[p] += max(min(RAISE, pairs[p] - ROOM / 2), 0.0)
        elif clash.link in index:
            l = index[clash.link]
            pad[l] += max(min(RAISE, links[l] - ROOM / 2), 0.0)
    return robot._replace(pad=pad, pair_pad=pair_pad)


def _gaps(robot: RobotArrays, world: WorldArrays, postures: Array) -> tuple[Array, Array]:
    """Return the smallest gaps (l,) of moving links and (p,) of pairs over (g, n) postures (m)."""
    links, pairs = np.full(len(robot.node), np.inf), np.full(len(robot.pairs), np.inf)
    one, two = links.copy(), pairs.copy()
    work = work_for(robot, world)
    for q in postures:
        _checker().all_gaps(robot, world, np.ascontiguousarray(q), 0.0, 1.0, work, one, two)
        np.minimum(links, one, out=links)
        np.minimum(pairs, two, out=pairs)
    links[robot.node < 0] = np.inf
    return links, pairs
