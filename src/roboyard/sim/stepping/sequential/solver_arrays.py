"""Arrays of the solver of rows in turn: MuJoCo's of a model and of a state, and room for rows."""

from __future__ import annotations

import itertools
from functools import cache
from typing import Any

import numpy as np

from roboyard.sim.stepping.impulses import records as r
from roboyard.sim.stepping.impulses.layout import PLACES, STRIDE

_LINE = 64
"""Bytes of a line of the processor's cache."""


def of_model(model: Any) -> tuple[r.Mechanism, np.ndarray]:
    """Return the arrays of a model, without the order of solution, and (n,) the memory of that order's."""
    nv, neq, parts = model.nv, model.neq, 2 * model.njnt + model.neq + 1
    memory = np.full(2 * nv + r.PART * parts + 7 * neq, -1, np.int32)
    taken = itertools.accumulate((0, nv, nv, r.PART * parts, neq, neq, 2 * neq, neq, 2 * neq))
    slot, limit_slot, listed, order, place, tree, aux, site = (
        memory[first:last] for first, last in itertools.pairwise(taken)
    )
    mechanism = r.Mechanism(
        geom_type=model.geom_type,
        geom_body=model.geom_bodyid,
        geom_tree=model.body_treeid[model.geom_bodyid].astype(np.int32),
        geom_weld=model.body_weldid[model.geom_bodyid].astype(np.int32),
        contype=model.geom_contype,
        conaffinity=model.geom_conaffinity,
        excluded=model.exclude_signature,
        dof_tree=model.dof_treeid,
        dof_joint=model.dof_jntid,
        dof_body=model.dof_bodyid,
        joint_dof=model.jnt_dofadr,
        joint_type=model.jnt_type,
        joint_qpos=model.jnt_qposadr,
        limits=model.jnt_range,
        limited=model.jnt_limited.view(np.uint8),
        limit_margin=model.jnt_margin,
        armature=model.dof_armature,
        dry=model.dof_frictionloss,
        body_parent=model.body_parentid,
        body_root=model.body_rootid,
        body_tree=model.body_treeid,
        body_dof=model.body_dofadr,
        body_dofs=model.body_dofnum,
        mass=model.body_mass,
        inertia=model.body_inertia,
        centre=model.body_ipos,
        tree_dof=model.tree_dofadr,
        tree_dofs=model.tree_dofnum,
        factor_count=model.M_rownnz,
        factor_start=model.M_rowadr,
        factor_column=model.M_colind,
        slot=slot,
        limit_slot=limit_slot,
        parts=listed.reshape(r.PART, parts),
        equality_order=order,
        equality_slot=place,
        equality_tree=tree.reshape(neq, 2),
        equality_aux=aux,
        equality_site=site.reshape(neq, 2),
        site_body=model.site_bodyid,
        equality_bound=np.zeros((neq, 2)),
        equality_share=np.zeros(neq),
    )
    mechanism.equality_tree[:] = -2
    return mechanism, memory


def of_data(data: Any) -> r.State:
    """Return the arrays of a world's state."""
    return r.State(
        qpos=data.qpos,
        qvel=data.qvel,
        xpos=data.xpos,
        xmat=data.xmat,
        xipos=data.xipos,
        ximat=data.ximat,
        subtree_com=data.subtree_com,
        cvel=data.cvel,
        cdof=data.cdof,
        wrench=data.xfrc_applied,
        passive=data.qfrc_passive,
        bias=data.qfrc_bias,
        applied=data.qfrc_applied,
        actuated=data.qfrc_actuator,
        factor=data.qLD,
        factor_inverse=data.qLDiagInv,
        smooth_force=data.qfrc_smooth,
        smooth=data.qacc_smooth,
        qacc=data.qacc,
        constraint=data.qfrc_constraint,
        site_xpos=data.site_xpos,
        site_xmat=data.site_xmat,
        link_inertia=data.cinert,
    )


def of_solver(
    rows: int, nv: int, bodies: int, trees: int, entries: int, *, has_balls: bool = False
) -> r.Solver:
    """Return the arrays for so many rows of constraints with so many entries each.

    Args:
        rows: of constraints.
        nv: degrees of freedom.
        bodies: of MuJoCo.
        trees: kinematic trees.
        entries: of a row.
        has_balls: whether any joint is spherical.
    """
    dense = min(rows, r.DENSE)
    width = dense + -dense % r.BLOCK
    return r.Solver(
        motors=np.zeros((nv, 5)),
        targets=np.zeros((nv, 4)),
        largest=np.zeros(nv),
        rules=np.zeros(r.RULES),
        taken=np.zeros(trees, np.uint8),
        groups=np.zeros(trees, np.int32),
        places=np.zeros(0, np.int32),
        parts=np.zeros((max(trees, 1) + 1, 10), np.int32),  # the row with their number is no group's
        ends=np.full(6, -1, np.int32),
        order=np.zeros((rows, 4), np.int32),
        spans=np.zeros((rows, 4), np.int32),
        jacobian=np.zeros((rows, entries)),
        scaled=np.zeros((rows, entries)),
        roots=np.zeros(nv),
        goals=np.zeros((rows, 6)),
        mu=np.zeros(rows),
        soft=np.zeros(rows),
        diagonal=np.zeros(trees, np.uint8),
        slots=np.zeros(trees, np.int32),
        places_of_rows=np.zeros((rows, PLACES), np.int32),
        lanes=_aligned(rows * (STRIDE + entries)),
        velocities=_aligned(nv + r.BLOCK * (trees + 1)),
        across=_aligned(nv * width),
        table=_aligned(dense * width),
        lines=_aligned(r.LINES * width),
        change=np.zeros(nv),
        wrenches=np.zeros((bodies, 6)),
        links=np.zeros((bodies if has_balls else 0, 36)),
        neighbours=np.zeros((nv if has_balls else 0, 8)),
        pair=np.zeros(42 if has_balls else 0),
    )


@cache
def no_solver() -> r.Solver:
    """Return arrays for no rows, which nothing is written into."""
    return of_solver(0, 0, 0, 0, 0)


def _aligned(count: int) -> np.ndarray:
    """Return zeros (count,) of which no block of eight is in two lines of the processor's cache."""
    memory = np.zeros(count + _LINE // 8)
    start = -memory.ctypes.data % _LINE // 8
    return memory[start : start + count]
