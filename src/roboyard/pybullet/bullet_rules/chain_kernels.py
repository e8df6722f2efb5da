"""Compiled pose of one link at the present joint positions, without those of all other bodies."""

from __future__ import annotations

from math import cos, sin, sqrt
from typing import Any, NamedTuple

from roboyard.native import Bundle, compiled, record
from roboyard.pybullet.state.state_kernels import link_pose

FREE, BALL, SLIDE = 0, 1, 2
"""MuJoCo's types of joints; the remaining one is a hinge."""


class Chain(NamedTuple):
    """MuJoCo's arrays, and room for a pose and for the bodies on the way to the world."""

    parents: Any
    counts: Any
    """Number of joints of each body."""
    first: Any
    """First joint of each body."""
    kinds: Any
    places: Any
    """First number of each joint in qpos."""
    axes: Any
    anchors: Any
    positions: Any
    turns: Any
    rest: Any
    qpos: Any
    stack: Any
    """(nbody,)"""
    at: Any
    """(1, 3) m"""
    turned: Any
    """(1, 4) w, x, y, z"""


CHAIN = Bundle(
    (
        record(
            Chain,
            "i4[::1] i4[::1] i4[::1] i4[::1] i4[::1] f8[:,::1] f8[:,::1] f8[:,::1] f8[:,::1] f8[::1] f8[::1] "
            "i8[::1] f8[:,::1] f8[:,::1]",
        ),
    )
)


def _turned(q, v):  # pragma: no cover
    """Return a vector rotated by a quaternion w, x, y, z."""
    tx, ty, tz = (
        q[0] * v[0] + q[2] * v[2] - q[3] * v[1],
        q[0] * v[1] + q[3] * v[0] - q[1] * v[2],
        q[0] * v[2] + q[1] * v[1] - q[2] * v[0],
    )
    return (
        v[0] + 2.0 * (q[2] * tz - q[3] * ty),
        v[1] + 2.0 * (q[3] * tx - q[1] * tz),
        v[2] + 2.0 * (q[1] * ty - q[2] * tx),
    )


def _times(a, b):  # pragma: no cover
    """Return the product of two quaternions w, x, y, z."""
    return (
        a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
        a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
        a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
        a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0],
    )


def _unit(q):  # pragma: no cover
    """Return a unit quaternion as MuJoCo does."""
    size = sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3])
    if size < 1e-15:
        return 1.0, 0.0, 0.0, 0.0
    s = 1.0 / size if abs(size - 1.0) > 1e-15 else 1.0
    return s * q[0], s * q[1], s * q[2], s * q[3]


def _three(values, row):  # pragma: no cover
    return values[row, 0], values[row, 1], values[row, 2]


def _four(values, first):  # pragma: no cover
    return values[first], values[first + 1], values[first + 2], values[first + 3]


@compiled(CHAIN, "f8[:,:] i8 i8 f8[:]")
def write_pose_of_chain(chain, frames, row, link, out):  # pragma: no cover
    """Write `link_pose` to `out` (14,) as it is once MuJoCo has computed the bodies' poses from qpos.

    frames, row, link: see `link_pose`.
    """
    count, body = 0, row
    while body > 0:
        chain.stack[count] = body
        count, body = count + 1, chain.parents[body]
    p, q = (0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0)
    for k in range(count - 1, -1, -1):
        body = chain.stack[k]
        joint = chain.first[body]
        if chain.counts[body] == 1 and chain.kinds[joint] == FREE:
            first = chain.places[joint]
            p = chain.qpos[first], chain.qpos[first + 1], chain.qpos[first + 2]
            q = _unit(_four(chain.qpos, first + 3))
            continue
        away = _turned(q, _three(chain.positions, body))
        p = p[0] + away[0], p[1] + away[1], p[2] + away[2]
        q = _times(
            q, (chain.turns[body, 0], chain.turns[body, 1], chain.turns[body, 2], chain.turns[body, 3])
        )
        for j in range(joint, joint + chain.counts[body]):
            first, axis, anchor = chain.places[j], _three(chain.axes, j), _three(chain.anchors, j)
            if chain.kinds[j] == SLIDE:
                axis, way = _turned(q, axis), chain.qpos[first] - chain.rest[first]
                p = p[0] + way * axis[0], p[1] + way * axis[1], p[2] + way * axis[2]
                continue
            away = _turned(q, anchor)
            if chain.kinds[j] == BALL:
                q = _times(q, _unit(_four(chain.qpos, first)))
            else:
                half = 0.5 * (chain.qpos[first] - chain.rest[first])
                s = sin(half)
                q = _times(q, (cos(half), s * axis[0], s * axis[1], s * axis[2]))
            back = _turned(q, anchor)
            p = p[0] + away[0] - back[0], p[1] + away[1] - back[1], p[2] + away[2] - back[2]
        q = _unit(q)
    for k in range(3):
        chain.at[0, k] = p[k]
    for k in range(4):
        chain.turned[0, k] = q[k]
    position, orientation, frame_position, frame_orientation = link_pose(
        chain.at, chain.turned, frames, 0, link
    )
    for k in range(3):
        out[k], out[7 + k] = position[k], frame_position[k]
    for k in range(4):
        out[3 + k], out[10 + k] = orientation[k], frame_orientation[k]
