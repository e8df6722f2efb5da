"""Compiled pose, velocity and box of one link in the present state, without those of all other bodies."""

from __future__ import annotations

from math import cos, sin, sqrt
from typing import Any, NamedTuple

from roboyard.native import Bundle, compiled, record
from roboyard.pybullet.state.state_kernels import link_pose, write_box

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
    dofs: Any
    """First number of each joint in qvel."""
    qvel: Any
    centres: Any
    """(nbody, 3) centres of mass in the bodies' frames (m)."""
    moving: Any
    """(2, 3) room for the velocity of the frame's origin (m/s) and the angular velocity (rad/s)."""


CHAIN = Bundle(
    (
        record(
            Chain,
            "i4[::1] i4[::1] i4[::1] i4[::1] i4[::1] f8[:,::1] f8[:,::1] f8[:,::1] f8[:,::1] f8[::1] f8[::1] "
            "i8[::1] f8[:,::1] f8[:,::1] i4[::1] f8[::1] f8[:,::1] f8[:,::1]",
        ),
    )
)


def turned(q, v):  # pragma: no cover
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


def times(a, b):  # pragma: no cover
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


def _cross(a, b):  # pragma: no cover
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def _sum(a, b):  # pragma: no cover
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


def _scaled(a, s):  # pragma: no cover
    return a[0] * s, a[1] * s, a[2] * s


def follow_chain(chain, row, is_moving):  # pragma: no cover
    """Write the pose of a body, and its velocity if that is asked for, as MuJoCo computes them."""
    count, body = 0, row
    while body > 0:
        chain.stack[count] = body
        count, body = count + 1, chain.parents[body]
    p, q = (0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0)
    v, w = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    for k in range(count - 1, -1, -1):
        body = chain.stack[k]
        joint = chain.first[body]
        if chain.counts[body] == 1 and chain.kinds[joint] == FREE:
            first, dof = chain.places[joint], chain.dofs[joint]
            p = chain.qpos[first], chain.qpos[first + 1], chain.qpos[first + 2]
            q = _unit(_four(chain.qpos, first + 3))
            if is_moving:
                v = chain.qvel[dof], chain.qvel[dof + 1], chain.qvel[dof + 2]
                w = turned(q, (chain.qvel[dof + 3], chain.qvel[dof + 4], chain.qvel[dof + 5]))
            continue
        away = turned(q, _three(chain.positions, body))
        p = _sum(p, away)
        if is_moving:
            v = _sum(v, _cross(w, away))
        q = times(q, (chain.turns[body, 0], chain.turns[body, 1], chain.turns[body, 2], chain.turns[body, 3]))
        for j in range(joint, joint + chain.counts[body]):
            first, axis, anchor = chain.places[j], _three(chain.axes, j), _three(chain.anchors, j)
            if chain.kinds[j] == SLIDE:
                axis, way = turned(q, axis), chain.qpos[first] - chain.rest[first]
                way_there = _scaled(axis, way)
                p = _sum(p, way_there)
                if is_moving:
                    v = _sum(_sum(v, _cross(w, way_there)), _scaled(axis, chain.qvel[chain.dofs[j]]))
                continue
            away = turned(q, anchor)
            if is_moving:
                v = _sum(v, _cross(w, away))
            if chain.kinds[j] == BALL:
                q = times(q, _unit(_four(chain.qpos, first)))
                if is_moving:
                    dof = chain.dofs[j]
                    spin = chain.qvel[dof], chain.qvel[dof + 1], chain.qvel[dof + 2]
                    w = _sum(w, turned(q, spin))
            else:
                if is_moving:
                    w = _sum(w, _scaled(turned(q, axis), chain.qvel[chain.dofs[j]]))
                half = 0.5 * (chain.qpos[first] - chain.rest[first])
                s = sin(half)
                q = times(q, (cos(half), s * axis[0], s * axis[1], s * axis[2]))
            back = turned(q, anchor)
            p = p[0] + away[0] - back[0], p[1] + away[1] - back[1], p[2] + away[2] - back[2]
            if is_moving:
                v = _sum(v, _cross(back, w))
        q = _unit(q)
    for k in range(3):
        chain.at[0, k], chain.moving[0, k], chain.moving[1, k] = p[k], v[k], w[k]
    for k in range(4):
        chain.turned[0, k] = q[k]


@compiled(CHAIN, "f8[:,:] i8 i8 f8[:]")
def write_pose_of_chain(chain, frames, row, link, out):  # pragma: no cover
    """Write `link_pose` to `out` (14,) as it is once MuJoCo has computed the bodies' poses from qpos.

    frames, row, link: see `link_pose`.
    """
    follow_chain(chain, row, False)
    _write_pose(chain.at, chain.turned, frames, 0, link, out)


def _write_pose(at, turned, frames, row, link, out):  # pragma: no cover
    position, orientation, frame_position, frame_orientation = link_pose(at, turned, frames, row, link)
    for k in range(3):
        out[k], out[7 + k] = position[k], frame_position[k]
    for k in range(4):
        out[3 + k], out[10 + k] = orientation[k], frame_orientation[k]


@compiled(CHAIN, "f8[:,:] f8[:,:] f8[:,:] i8 i8 i8 f8[:]")
def write_state_of_chain(chain, xpos, xquat, frames, row, link, is_fresh, out):  # pragma: no cover
    """Write `link_state` to `out` (20,) as it is once MuJoCo has computed poses and velocities of bodies.

    xpos, xquat: poses that are shown, unless is_fresh is 1: then those of the present positions are.
    frames, row, link: see `link_pose`.
    """
    follow_chain(chain, row, True)
    v, w = _three(chain.moving, 0), _three(chain.moving, 1)
    q = chain.turned[0, 0], chain.turned[0, 1], chain.turned[0, 2], chain.turned[0, 3]
    v = _sum(v, _cross(w, turned(q, _three(chain.centres, row))))
    if is_fresh == 1:
        _write_pose(chain.at, chain.turned, frames, 0, link, out)
    else:
        _write_pose(xpos, xquat, frames, row, link, out)
        shown = xquat[row, 0], xquat[row, 1], xquat[row, 2], xquat[row, 3]
        back = times(shown, (q[0], -q[1], -q[2], -q[3]))
        v, w = turned(back, v), turned(back, w)
    for k in range(3):
        out[14 + k], out[17 + k] = v[k], w[k]


@compiled(CHAIN, "f8[:,:] f8[:,:] i8 i8 f8[:]")
def write_box_of_chain(chain, frames, boxes, row, link, out):  # pragma: no cover
    """Write `link_box` to `out` (6,) as it is once MuJoCo has computed the bodies' poses from qpos.

    frames, boxes, row, link: see `link_box`.
    """
    follow_chain(chain, row, False)
    write_box(chain.at, chain.turned, frames, boxes, 0, link, out)


@compiled(CHAIN, "f8[:,::1] i8[::1] i8 f8[:,::1] f8[:,::1] i8")
def carry_rays(chain, frames, rows, link, starts, ends, count):  # pragma: no cover
    """Bring the ends of `count` rays from a link's inertial frame to the world, at the present positions.

    frames, rows: (n, 7) inertial frames in link frames and (n,) MuJoCo's bodies of the links. link: from -1;
    with one that is not there, rays stay where they are. starts, ends: (k, 3) (m), changed.
    """
    place = link + 1
    if not 0 <= place < len(rows):
        return
    follow_chain(chain, rows[place], False)
    q = chain.turned[0, 0], chain.turned[0, 1], chain.turned[0, 2], chain.turned[0, 3]
    at = _sum(_three(chain.at, 0), turned(q, _three(frames, place)))
    q = times(q, (frames[place, 6], frames[place, 3], frames[place, 4], frames[place, 5]))
    for n in range(count):
        start, end = _sum(at, turned(q, _three(starts, n))), _sum(at, turned(q, _three(ends, n)))
        for k in range(3):
            starts[n, k], ends[n, k] = start[k], end[k]
