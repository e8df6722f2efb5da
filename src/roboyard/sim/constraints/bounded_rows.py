"""Rows of constraints in MuJoCo's arrays, changed between the halves of a step.

A slide is a weld that is free along one axis: its rows are rotated into the axis and across it. A row that
would need more force than its bound becomes a given force.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from roboyard._mujoco import mujoco
from roboyard.transforms import Array

BOUND_ROUNDS = 3
PARALLEL = 1e-3
"""Sine of the angle between directions below which they are parallel."""
HALF_ANGLE = 0.5
"""Unit of the force of a weld's rotational rows (N m)."""


def free_axis(
    model: Any, data: Any, equality: int, site_a: int, site_b: int, axis: Array, *, follows: bool = True
) -> None:
    """Free a weld's second frame along an axis fixed in the first, between the halves of a step.

    A weld constrains three distances along world axes. They become distances along two directions across the
    axis and an empty row for the axis itself.

    Args:
        model: MjModel.
        data: its MjData.
        equality: index of the weld.
        site_a: the frame in which the axis is fixed.
        site_b: the frame that slides.
        axis: (3,) unit, in the axes of site_a.
        follows: whether distances are measured at the second frame's origin, so that it follows when the
            first body turns; else at each body's own, as Bullet does, and the difference is an error.
    """
    rows = np.flatnonzero(data.efc_id[: data.ne] == equality)[:3]
    if len(rows) < 3:
        return
    at = data.site_xpos[site_b].copy()
    here = at if follows else data.site_xpos[site_a].copy()
    frame = data.site_xmat[site_a].reshape(3, 3)
    directions = across(frame @ axis, frame)
    jacobian = _velocity_of(model, data, site_a, here) - _velocity_of(model, data, site_b, at)
    distance = data.site_xpos[site_a] - at
    for row, direction in zip(rows, directions, strict=True):
        values = direction @ jacobian
        places, columns = _row(model, data, int(row))
        data.efc_J[places] = values[columns]
        stiffness, damping, impedance, _ = data.efc_KBIP[row]
        position, velocity = direction @ distance, values @ data.qvel
        data.efc_pos[row], data.efc_vel[row] = position, velocity
        data.efc_aref[row] = -damping * velocity - stiffness * impedance * position
    if not follows:
        _put_last_first(model, data, rows[0] + 3)


def _put_last_first(model: Any, data: Any, first: int) -> None:
    """Put the last of a weld's three turns in front of the others; see `free_slide`."""
    lines = [_row(model, data, first + k)[0] for k in range(3)]
    jacobian = [data.efc_J[line].copy() for line in lines]
    for line, source in zip(lines, (2, 0, 1), strict=True):
        data.efc_J[line] = jacobian[source]
    for values in (data.efc_pos, data.efc_vel, data.efc_aref):
        values[first : first + 3] = values[[first + 2, first, first + 1]]


def bound_rows(model: Any, data: Any, bound: Array) -> None:
    """Turn rows beyond their bound into forces of that size after the solver, and solve the rest again.

    This is repeated a few times for rows that exceed their bound then.

    Args:
        model: MjModel.
        data: its MjData.
        bound: (ne,) of each row of an equality (N or N m).
    """
    ne = data.ne
    if not (np.abs(data.efc_force[:ne]) > bound).any():  # no unit makes a bound smaller
        return
    bound = bound / row_scale(model, data)
    given = np.zeros(ne)
    is_given = np.zeros(ne, dtype=bool)
    for _ in range(BOUND_ROUNDS):
        force = data.efc_force[:ne]
        over = (np.abs(force) > (1.0 + 1e-3) * bound) & ~is_given
        if not over.any():
            break
        given[over] = np.clip(force[over], -bound[over], bound[over])
        is_given |= over
        for row in np.flatnonzero(over):
            _give_force(model, data, int(row), given[row])
        mujoco.mj_solveM(model, data, data.qacc_smooth[None], data.qfrc_smooth[None])
        data.qacc_warmstart[:] = data.qacc
        mujoco.mj_fwdConstraint(model, data)
    data.efc_force[:ne][is_given] = given[is_given]


def row_scale(model: Any, data: Any) -> Array:
    """Return the unit (ne,) of each row's force in N or N m: rotational rows of welds are half angles."""
    rows = data.efc_id[: data.ne]
    is_weld = model.eq_type[rows] == int(mujoco.mjtEq.mjEQ_WELD)
    first = np.concatenate(([0], np.flatnonzero(np.diff(rows)) + 1))
    place = np.arange(len(rows)) - np.repeat(first, np.diff(np.append(first, len(rows))))
    return np.where(is_weld & (place >= 3), HALF_ANGLE, 1.0)


def _give_force(model: Any, data: Any, row: int, force: float) -> None:
    """Clear a row and apply a force (in its own unit) instead; `qacc_smooth` must be recomputed then."""
    places, columns = _row(model, data, row)
    data.qfrc_smooth[columns] += data.efc_J[places] * force
    data.efc_J[places] = 0.0
    data.efc_aref[row] = 0.0


def _row(model: Any, data: Any, row: int) -> tuple[slice, Any]:
    """Return the slice of a row of the Jacobian, and the dofs of its numbers."""
    if mujoco.mj_isSparse(model):
        start, count = int(data.efc_J_rowadr[row]), int(data.efc_J_rownnz[row])
        return slice(start, start + count), data.efc_J_colind[start : start + count]
    return slice(row * model.nv, (row + 1) * model.nv), slice(None)


def across(axis: Array, frame: Array) -> Array:
    """Return (3, 3) rows: two unit directions across an axis (3,), and zeros for the axis itself.

    The first is across the first column of a frame (3, 3), too, that is not along the axis.
    """
    crosses = np.cross(frame.T, axis)
    lengths = np.linalg.norm(crosses, axis=1)
    column = int(np.argmax(lengths > PARALLEL))
    first = crosses[column] / lengths[column]
    return np.stack([first, np.cross(axis, first), np.zeros(3)]).astype(float)


def _velocity_of(model: Any, data: Any, site: int, point: Array) -> Array:
    """Return the (3, nv) Jacobian of a world point that moves with the body of a site."""
    jacobian = np.zeros((3, model.nv))
    mujoco.mj_jac(model, data, jacobian, None, point, int(model.site_bodyid[site]))
    return jacobian
