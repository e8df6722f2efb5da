"""Layouts of the arrays that every planning kernel takes: the robot, its surroundings and work space.

All lengths are metres in the frame of the robot's root link. Angles are radians.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from roboyard._arrays import NDArray
from roboyard.native import Kernel, Record, compiled, record

Array = NDArray[np.float64]
Indices = NDArray[np.int64]


class RobotArrays(NamedTuple):
    """A robot whose links are sets of spheres. Sizes: n joints, m nodes, l links, s spheres, p pairs."""

    whole: Indices
    """(m, 3) parent, is_prismatic, entry of q: as `ChainArrays.nodes`."""
    real: Array
    """(m, 14) position, rotation by rows, multiplier, offset: as `ChainArrays.nodes`."""
    node: Indices
    """(l,) node that each link is fixed to; -1 for links that the joints do not move."""
    start: Indices
    """(l + 1,) first sphere of each link."""
    around: Array
    """(l, 4) sphere around the link's spheres, in the node's frame, without padding."""
    spheres: Array
    """(s, 4) centre and radius in the node's frame, without padding."""
    pad: Array
    """(l,) padding of each link's spheres against obstacles."""
    pair_pad: Array
    """(p,) padding between the spheres of each pair."""
    pairs: Indices
    """(p, 2) links that are checked against each other."""
    reach: Array
    """(l, n) most that a point of each link moves for each unit of each joint (m/rad or 1)."""
    pair_reach: Array
    """(p, n) most that two points of a pair move relative to each other for each unit of each joint."""
    lower: Array
    """(n,) lower limits, finite."""
    upper: Array
    """(n,) upper limits, finite."""


class WorldArrays(NamedTuple):
    """Obstacles: boxes apart from the others, since they are checked many at a time."""

    boxes: Array
    """(15, b) rows: centre, rotation by rows, half sizes."""
    kind: Indices
    """(k,) `CAPSULE`, `CYLINDER`, `HALF_SPACE` or `FIELD`; a sphere is a capsule of length zero."""
    frame: Array
    """(k, 12) position, rotation by rows."""
    size: Array
    """(k, 4) radius, half length; for a field the lower corner and the edge of a cell."""
    grid: Indices
    """(k, 4) for a field its first value in `values` and the number of cells along x, y, z."""
    around: Array
    """(k, 4) sphere that contains the obstacle, infinite for a half space."""
    values: NDArray[np.float32]
    """Signed distances of all fields (m), x slowest."""


class Work(NamedTuple):
    """Space that kernels write to; one for each thread."""

    frames: Array
    """(m, 12) frames of the nodes."""
    centers: Array
    """(l, 3) centres of the links' bounding spheres."""
    placed: Array
    """(s, 3) centres of the spheres, where `fresh` is set."""
    fresh: NDArray[np.uint8]
    """(l,) whether the link's spheres are placed for these frames."""
    square: Array
    """(b,) squared distances from one point to all boxes."""
    near: Indices
    """(b,) boxes near one link."""


ROBOT = record(
    RobotArrays,
    "i8[:,::1] f8[:,::1] i8[::1] i8[::1] f8[:,::1] f8[:,::1] f8[::1] f8[::1] i8[:,::1] f8[:,::1] f8[:,::1] "
    "f8[::1] f8[::1]",
)
WORLD = record(WorldArrays, "f8[:,::1] i8[::1] f8[:,::1] f8[:,::1] i8[:,::1] f8[:,::1] f4[::1]")
WORK = record(Work, "f8[:,::1] f8[:,::1] f8[:,::1] u1[::1] f8[::1] i8[::1]")


def kernel(*parts: str | Record) -> Callable[[Any], Kernel]:
    """Return the decorator of a compiled planning loop, with a signature as for `native.compiled`.

    Limits and the spheres around half spaces may be infinite; no planning loop computes with NaN.
    """
    return compiled(*parts, fast_math=True, no_nan=True, releases_gil=True)


CAPSULE, CYLINDER, HALF_SPACE, FIELD = 0, 1, 2, 3


def work_for(robot: RobotArrays, world: WorldArrays) -> Work:
    """Return work space for one thread."""
    nodes, links, boxes = len(robot.whole), len(robot.node), world.boxes.shape[1]
    return Work(
        frames=np.zeros((nodes, 12)),
        centers=np.zeros((links, 3)),
        placed=np.zeros((len(robot.spheres), 3)),
        fresh=np.zeros(links, dtype=np.uint8),
        square=np.zeros(boxes),
        near=np.zeros(boxes, dtype=np.int64),
    )
