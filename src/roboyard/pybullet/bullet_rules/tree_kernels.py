"""Compiled dynamics of one tree of links with hinges and slides, in MuJoCo's arrays and Bullet's order.

All vectors are in the world frame while a loop runs. A row of `work` holds what is known of a link.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from roboyard.native import Bundle, compiled, record

HINGE, SLIDE = 1, 2
_ROTATION, _PLACE, _AXIS, _ANCHOR, _CENTRE, _SPIN, _TURN, _PULL, _FORCE, _TORQUE, _MASS, _INERTIA = (
    *(0, 9, 12, 15, 18, 21, 24, 27, 30, 33, 36, 37),
)
WIDTH = 43
"""Numbers of a row of `work`."""


class Tree(NamedTuple):
    """The links of one body, parents first, and MuJoCo's arrays."""

    rows: Any
    """(n,) MuJoCo's row of each link."""
    parents: Any
    """(n,) place of the parent; -1 for the base, the first."""
    kinds: Any
    """(n,) HINGE, SLIDE or 0 of the joint to the parent."""
    columns: Any
    """(n,) number of the joint among the movable ones, from 0."""
    joints: Any
    """(n,) MuJoCo's joint."""
    frame: Any
    """(7,) inertial frame of the base in its link frame (m; x, y, z, w)."""
    work: Any
    """(n, WIDTH) numbers of each link."""
    base: Any
    """(3, 4) axes of the base's inertial frame as columns, and its origin."""
    body_pos: Any
    body_quat: Any
    body_ipos: Any
    body_iquat: Any
    body_mass: Any
    body_inertia: Any
    jnt_axis: Any
    jnt_pos: Any
    jnt_qposadr: Any
    qpos0: Any
    is_floating: int


TREE = Bundle(
    (
        record(
            Tree,
            "i8[::1] i8[::1] i8[::1] i8[::1] i8[::1] f8[::1] f8[:,::1] f8[:,::1] f8[:,::1] f8[:,::1] "
            "f8[:,::1] f8[:,::1] f8[::1] f8[:,::1] f8[:,::1] f8[:,::1] i4[::1] f8[::1] i8",
        ),
    )
)


def _get(row, at):  # pragma: no cover
    return row[at], row[at + 1], row[at + 2]


def _put(row, at, v):  # pragma: no cover
    row[at], row[at + 1], row[at + 2] = v


def _cross(a, b):  # pragma: no cover
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def _dot(a, b):  # pragma: no cover
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _sum(a, b):  # pragma: no cover
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


def _less(a, b):  # pragma: no cover
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


def _times(s, a):  # pragma: no cover
    return s * a[0], s * a[1], s * a[2]


def _matrix(w, x, y, z):  # pragma: no cover
    """Return the nine entries, row-major, of a rotation; the quaternion may have any length."""
    s = 2.0 / (w * w + x * x + y * y + z * z)
    return (
        1.0 - s * (y * y + z * z),
        s * (x * y - w * z),
        s * (x * z + w * y),
        s * (x * y + w * z),
        1.0 - s * (x * x + z * z),
        s * (y * z - w * x),
        s * (x * z - w * y),
        s * (y * z + w * x),
        1.0 - s * (x * x + y * y),
    )


def _product(a, b):  # pragma: no cover
    """Return the product of two matrices of nine entries."""
    return (
        a[0] * b[0] + a[1] * b[3] + a[2] * b[6],
        a[0] * b[1] + a[1] * b[4] + a[2] * b[7],
        a[0] * b[2] + a[1] * b[5] + a[2] * b[8],
        a[3] * b[0] + a[4] * b[3] + a[5] * b[6],
        a[3] * b[1] + a[4] * b[4] + a[5] * b[7],
        a[3] * b[2] + a[4] * b[5] + a[5] * b[8],
        a[6] * b[0] + a[7] * b[3] + a[8] * b[6],
        a[6] * b[1] + a[7] * b[4] + a[8] * b[7],
        a[6] * b[2] + a[7] * b[5] + a[8] * b[8],
    )


def _turned(m, v):  # pragma: no cover
    return (
        m[0] * v[0] + m[1] * v[1] + m[2] * v[2],
        m[3] * v[0] + m[4] * v[1] + m[5] * v[2],
        m[6] * v[0] + m[7] * v[1] + m[8] * v[2],
    )


def _rotation(row):  # pragma: no cover
    return row[0], row[1], row[2], row[3], row[4], row[5], row[6], row[7], row[8]


def _by_inertia(row, v):  # pragma: no cover
    """Return the product of a link's inertia (xx, xy, xz, yy, yz, zz) and a vector."""
    a, b, c, d, e, f = row[37], row[38], row[39], row[40], row[41], row[42]
    return (
        a * v[0] + b * v[1] + c * v[2],
        b * v[0] + d * v[1] + e * v[2],
        c * v[0] + e * v[1] + f * v[2],
    )


def _place(t, pose, is_inertial, q):  # pragma: no cover
    """Write rotation, place, axis and anchor of each link, and the base's axes and origin.

    pose: (7,) m and quaternion of a floating base: of its inertial frame (x, y, z, w), or of its link frame
    as MuJoCo has it (w first). q: (m,) positions of the movable joints.
    """
    frame = t.frame
    in_link = _matrix(frame[6], frame[3], frame[4], frame[5])
    offset = (frame[0], frame[1], frame[2])
    for n in range(len(t.rows)):
        row, body, parent = t.work[n], t.rows[n], t.parents[n]
        if n == 0 and t.is_floating and is_inertial:
            turn = _matrix(pose[6], pose[3], pose[4], pose[5])
            back = (
                *(in_link[0], in_link[3], in_link[6]),
                *(in_link[1], in_link[4], in_link[7]),
                *(in_link[2], in_link[5], in_link[8]),
            )
            turn = _product(turn, back)
            place = _less((pose[0], pose[1], pose[2]), _turned(turn, offset))
        elif n == 0 and t.is_floating:
            turn = _matrix(pose[3], pose[4], pose[5], pose[6])
            place = (pose[0], pose[1], pose[2])
        else:
            quat, pos = t.body_quat[body], t.body_pos[body]
            turn, place = _matrix(quat[0], quat[1], quat[2], quat[3]), (pos[0], pos[1], pos[2])
            if parent >= 0:
                above = _rotation(t.work[parent])
                place = _sum(_get(t.work[parent], _PLACE), _turned(above, place))
                turn = _product(above, turn)
        kind = t.kinds[n]
        if kind:
            joint = t.joints[n]
            local, at = t.jnt_axis[joint], t.jnt_pos[joint]
            local, at = (local[0], local[1], local[2]), (at[0], at[1], at[2])
            axis = _turned(turn, local)
            anchor = _sum(place, _turned(turn, at))
            moved = q[t.columns[n]] - t.qpos0[t.jnt_qposadr[joint]]
            if kind == HINGE:
                half = 0.5 * moved
                s = np.sin(half)
                turn = _product(turn, _matrix(np.cos(half), s * local[0], s * local[1], s * local[2]))
                place = _less(anchor, _turned(turn, at))
            else:
                place = _sum(place, _times(moved, axis))
            _put(row, _AXIS, axis)
            _put(row, _ANCHOR, anchor)
        for k in range(9):
            row[k] = turn[k]
        _put(row, _PLACE, place)
    turn = _rotation(t.work[0])
    axes, origin = _product(turn, in_link), _sum(_get(t.work[0], _PLACE), _turned(turn, offset))
    for k in range(3):
        t.base[k, 0], t.base[k, 1], t.base[k, 2] = axes[3 * k], axes[3 * k + 1], axes[3 * k + 2]
        t.base[k, 3] = origin[k]


def _place_masses(t):  # pragma: no cover
    """Write centre of mass, mass and inertia of each link."""
    for n in range(len(t.rows)):
        row, body = t.work[n], t.rows[n]
        turn, at, quat = _rotation(row), t.body_ipos[body], t.body_iquat[body]
        _put(row, _CENTRE, _sum(_get(row, _PLACE), _turned(turn, (at[0], at[1], at[2]))))
        m = _product(turn, _matrix(quat[0], quat[1], quat[2], quat[3]))
        i, j, k = t.body_inertia[body, 0], t.body_inertia[body, 1], t.body_inertia[body, 2]
        row[_MASS] = t.body_mass[body]
        row[37] = i * m[0] * m[0] + j * m[1] * m[1] + k * m[2] * m[2]
        row[38] = i * m[0] * m[3] + j * m[1] * m[4] + k * m[2] * m[5]
        row[39] = i * m[0] * m[6] + j * m[1] * m[7] + k * m[2] * m[8]
        row[40] = i * m[3] * m[3] + j * m[4] * m[4] + k * m[5] * m[5]
        row[41] = i * m[3] * m[6] + j * m[4] * m[7] + k * m[5] * m[8]
        row[42] = i * m[6] * m[6] + j * m[7] * m[7] + k * m[8] * m[8]


def _base_axis(t, k):  # pragma: no cover
    return t.base[0, k], t.base[1, k], t.base[2, k]


def _from_base(t, given, first):  # pragma: no cover
    """Return a vector in world axes from three numbers in base axes."""
    x, y, z = given[first], given[first + 1], given[first + 2]
    return (
        t.base[0, 0] * x + t.base[0, 1] * y + t.base[0, 2] * z,
        t.base[1, 0] * x + t.base[1, 1] * y + t.base[1, 2] * z,
        t.base[2, 0] * x + t.base[2, 1] * y + t.base[2, 2] * z,
    )


@compiled(TREE, "f8[:] f8[:] f8[:] f8[:]")
def inverse_dynamics(t, gravity, pose, given, out):  # pragma: no cover
    """Write the (6 + m,) efforts of accelerations, the base's force before its torque; (m,) if it is fixed.

    gravity: (3,) m/s². pose: (7,) inertial frame of a floating base. given: positions, velocities and
    accelerations of the joints one after another, the last two after the base's angular and linear ones.
    """
    six = 6 if t.is_floating else 0
    count = len(out) - six
    qvel, qacc = count, count + six + count
    _place(t, pose, True, given)
    _place_masses(t)
    for n in range(len(t.rows)):
        row, parent = t.work[n], t.parents[n]
        place = _get(row, _PLACE)
        if parent < 0:
            spin, turn, pull = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
            if t.is_floating:
                spin, turn = _from_base(t, given, qvel), _from_base(t, given, qacc)
                lever = _less(_base_axis(t, 3), place)
                pull = _sum(_from_base(t, given, qacc + 3), _cross(lever, turn))
            pull = _less(pull, (gravity[0], gravity[1], gravity[2]))
        else:
            above = t.work[parent]
            spin, turn, pull = _get(above, _SPIN), _get(above, _TURN), _get(above, _PULL)
            start = _get(above, _PLACE)
            if t.kinds[n] == HINGE:
                axis, anchor = _get(row, _AXIS), _get(row, _ANCHOR)
                rate, change = given[qvel + six + t.columns[n]], given[qacc + six + t.columns[n]]
                lever = _less(anchor, start)
                pull = _sum(pull, _sum(_cross(turn, lever), _cross(spin, _cross(spin, lever))))
                turn = _sum(turn, _sum(_times(change, axis), _times(rate, _cross(spin, axis))))
                spin = _sum(spin, _times(rate, axis))
                start = anchor
            elif t.kinds[n] == SLIDE:
                axis = _get(row, _AXIS)
                rate, change = given[qvel + six + t.columns[n]], given[qacc + six + t.columns[n]]
                pull = _sum(pull, _sum(_times(change, axis), _times(2.0 * rate, _cross(spin, axis))))
            lever = _less(place, start)
            pull = _sum(pull, _sum(_cross(turn, lever), _cross(spin, _cross(spin, lever))))
        _put(row, _SPIN, spin)
        _put(row, _TURN, turn)
        _put(row, _PULL, pull)
        lever = _less(_get(row, _CENTRE), place)
        pull = _sum(pull, _sum(_cross(turn, lever), _cross(spin, _cross(spin, lever))))
        _put(row, _FORCE, _times(row[_MASS], pull))
        _put(row, _TORQUE, _sum(_by_inertia(row, turn), _cross(spin, _by_inertia(row, spin))))
    for n in range(len(t.rows) - 1, -1, -1):
        row, parent = t.work[n], t.parents[n]
        force, torque, centre = _get(row, _FORCE), _get(row, _TORQUE), _get(row, _CENTRE)
        if t.kinds[n] == HINGE:
            about = _sum(torque, _cross(_less(centre, _get(row, _ANCHOR)), force))
            out[six + t.columns[n]] = _dot(_get(row, _AXIS), about)
        elif t.kinds[n] == SLIDE:
            out[six + t.columns[n]] = _dot(_get(row, _AXIS), force)
        if parent >= 0:
            above = t.work[parent]
            about = _sum(torque, _cross(_less(centre, _get(above, _CENTRE)), force))
            _put(above, _FORCE, _sum(_get(above, _FORCE), force))
            _put(above, _TORQUE, _sum(_get(above, _TORQUE), about))
        elif t.is_floating:
            about = _sum(torque, _cross(_less(centre, _base_axis(t, 3)), force))
            for k in range(3):
                out[k], out[3 + k] = _dot(_base_axis(t, k), force), _dot(_base_axis(t, k), about)


@compiled(TREE, "f8[:] f8[:] i8 f8 f8 f8 f8[:,::1]")
def jacobian(t, pose, q, link, x, y, z, out):  # pragma: no cover
    """Write the (6, m) Jacobian, linear above angular, of a point of a link in base axes.

    pose: (7,) link frame of a floating base as MuJoCo has it; its six columns come first. x, y, z: the point
    from the link frame's origin in its axes (m).
    """
    six = 6 if t.is_floating else 0
    _place(t, pose, False, q)
    out[:] = 0.0
    row = t.work[link]
    point = _sum(_get(row, _PLACE), _turned(_rotation(row), (x, y, z)))
    while link >= 0:
        row = t.work[link]
        if t.kinds[link]:
            axis = _get(row, _AXIS)
            column = six + t.columns[link]
            moves = axis
            if t.kinds[link] == HINGE:
                moves = _cross(axis, _less(point, _get(row, _ANCHOR)))
                for k in range(3):
                    out[3 + k, column] = _dot(_base_axis(t, k), axis)
            for k in range(3):
                out[k, column] = _dot(_base_axis(t, k), moves)
        link = t.parents[link]
    if six:
        lever = _less(point, _base_axis(t, 3))
        for column in range(3):
            moves = _cross(_base_axis(t, column), lever)
            for k in range(3):
                out[k, column] = _dot(_base_axis(t, k), moves)
            out[3 + column, column] = out[column, 3 + column] = 1.0


@compiled(TREE, "f8[:] f8[:] i8 f8[:,::1]")
def mass_matrix(t, pose, q, is_inertial, out):  # pragma: no cover
    """Write the (6 + m, 6 + m) mass matrix, (m, m) with a fixed base.

    pose: (7,) of a floating base: of its inertial frame where `is_inertial`, else of its link frame as in
    MuJoCo.
    """
    six = 6 if t.is_floating else 0
    _place(t, pose, is_inertial != 0, q)
    _place_masses(t)
    out[:] = 0.0
    for n in range(len(t.rows) - 1, -1, -1):  # row n now has the mass of all links below it
        row = t.work[n]
        mass, centre = row[_MASS], _get(row, _CENTRE)
        if t.kinds[n]:
            axis, column = _get(row, _AXIS), six + t.columns[n]
            if t.kinds[n] == HINGE:
                force = _times(mass, _cross(axis, _less(centre, _get(row, _ANCHOR))))
                torque = _by_inertia(row, axis)
            else:
                force, torque = _times(mass, axis), (0.0, 0.0, 0.0)
            above = n
            while above >= 0:
                other = t.work[above]
                if t.kinds[above]:
                    value = _dot(_get(other, _AXIS), force)
                    if t.kinds[above] == HINGE:
                        about = _sum(torque, _cross(_less(centre, _get(other, _ANCHOR)), force))
                        value = _dot(_get(other, _AXIS), about)
                    out[column, six + t.columns[above]] = out[six + t.columns[above], column] = value
                above = t.parents[above]
            if six:
                about = _sum(torque, _cross(_less(centre, _base_axis(t, 3)), force))
                for k in range(3):
                    out[column, k] = out[k, column] = _dot(_base_axis(t, k), about)
                    out[column, 3 + k] = out[3 + k, column] = _dot(_base_axis(t, k), force)
        parent = t.parents[n]
        if parent >= 0:
            _add_mass(t.work[parent], row)
    if six:
        row = t.work[0]
        lever = _less(_get(row, _CENTRE), _base_axis(t, 3))
        for column in range(3):
            axis = _base_axis(t, column)
            force = _times(row[_MASS], _cross(axis, lever))
            about = _sum(_by_inertia(row, axis), _cross(lever, force))
            for k in range(3):
                out[column, k] = _dot(_base_axis(t, k), about)
                out[column, 3 + k] = out[3 + k, column] = _dot(_base_axis(t, k), force)
            out[3 + column, 3 + column] = row[_MASS]


def _add_mass(into, row):  # pragma: no cover
    """Add mass, centre and inertia of a link to those of another."""
    a, b = into[_MASS], row[_MASS]
    total = a + b
    apart = _less(_get(row, _CENTRE), _get(into, _CENTRE))
    x, y, z = apart
    part = b / total if total > 0.0 else 0.0
    share = a * part
    into[37] += row[37] + share * (y * y + z * z)
    into[38] += row[38] - share * x * y
    into[39] += row[39] - share * x * z
    into[40] += row[40] + share * (x * x + z * z)
    into[41] += row[41] - share * y * z
    into[42] += row[42] + share * (x * x + y * y)
    _put(into, _CENTRE, _sum(_get(into, _CENTRE), _times(part, apart)))
    into[_MASS] = total
