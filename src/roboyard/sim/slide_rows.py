"""A weld that lets go along one axis: the rows that MuJoCo made for it, turned into the axis and across it."""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np

from roboyard.poses import Array


def free_axis(model: Any, data: Any, equality: int, site_a: int, site_b: int, axis: Array) -> None:
    """Between the halves of a step: let a weld's second frame slide along an axis fixed in the first.

    A weld holds three distances along world axes. They become distances along two directions across the
    axis, measured at the second frame's origin (so that it is carried round when the first body turns), and
    an empty row for the axis itself.

    Args:
        equality: index of the weld.
        site_a: the frame in which the axis is fixed.
        site_b: the frame that slides.
        axis: (3,) unit, in the axes of site_a.
    """
    rows = np.flatnonzero(data.efc_id[: data.ne] == equality)[:3]
    if len(rows) < 3:
        return
    at = data.site_xpos[site_b].copy()
    directions = across(data.site_xmat[site_a].reshape(3, 3) @ axis)
    jacobian = _velocity_of(model, data, site_a, at) - _velocity_of(model, data, site_b, at)
    distance = data.site_xpos[site_a] - at
    sparse = bool(mujoco.mj_isSparse(model))
    for row, direction in zip(rows, directions, strict=True):
        values = direction @ jacobian
        if sparse:
            start, count = data.efc_J_rowadr[row], data.efc_J_rownnz[row]
            data.efc_J[start : start + count] = values[data.efc_J_colind[start : start + count]]
        else:
            data.efc_J[row * model.nv : (row + 1) * model.nv] = values
        stiffness, damping, impedance, _ = data.efc_KBIP[row]
        position, velocity = direction @ distance, values @ data.qvel
        data.efc_pos[row], data.efc_vel[row] = position, velocity
        data.efc_aref[row] = -damping * velocity - stiffness * impedance * position


def across(axis: Array) -> Array:
    """(3, 3) rows: two unit directions across an axis, and zero in the place of the axis itself."""
    helper = np.eye(3)[np.argmin(np.abs(axis))]
    first = np.cross(axis, helper)
    first /= np.linalg.norm(first)
    return np.array([first, np.cross(axis, first), np.zeros(3)])


def _velocity_of(model: Any, data: Any, site: int, point: Array) -> Array:
    """(3, nv) Jacobian of a world point moving with the body of a site."""
    jacobian = np.zeros((3, model.nv))
    mujoco.mj_jac(model, data, jacobian, None, point, int(model.site_bodyid[site]))
    return jacobian
