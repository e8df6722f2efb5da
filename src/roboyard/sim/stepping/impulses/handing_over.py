"""Compiled loops that hand rows over to MuJoCo's solver, where it has some to solve."""

from __future__ import annotations

from roboyard.native import compiled
from roboyard.sim.stepping.dynamics.inertia import accelerate
from roboyard.sim.stepping.impulses.asking import ask_of_rows
from roboyard.sim.stepping.impulses.records import (
    CONTACTS_ARE_HARD,
    ERP,
    EVERYTHING,
    SEARCH,
    SURFACE,
    TIMESTEP,
)  # fmt: skip
from roboyard.sim.stepping.kernels import correct_sliding, estimate_sliding, hard_equalities
from roboyard.sim.stepping.step_row_kernels import CONTACTS, ROWS


@compiled(EVERYTHING, fast_math=True, from_start=True)
def hand_over(  # pragma: no cover
    rows, contacts, search, mechanism, state, points, surface, solver, fields, own, own_contacts, own_search
):
    """Write what rows ask for, for MuJoCo's solver, and what forces alone lead to, drag among them.

    Done after `execute`, which has found the rows and has room for them.
    """
    at, count, rules = rows.starts, search.counts[4], solver.rules
    reference = rows.reference[at[8] : at[8] + count]
    velocity = rows.velocity[at[7] : at[7] + count]
    if rules[CONTACTS_ARE_HARD] > 0.0:
        position = rows.position[at[3] : at[3] + count]
        hard_equalities(position, velocity, search.counts[1], rules[TIMESTEP], rules[ERP], reference)
    ask_of_rows(rows, contacts, search, state, surface, solver, 0)
    estimate_sliding(
        contacts.dim, contacts.address[: search.counts[0]], contacts.friction, velocity, rules[TIMESTEP],
        surface.base, reference,
    )  # fmt: skip
    accelerate(mechanism, state, surface, solver)


@compiled(ROWS, CONTACTS, SEARCH, SURFACE, "f8[::1] f8 -> f8")
def correct_slides(rows, contacts, search, surface, acceleration, timestep):  # pragma: no cover
    """Do what `correct_sliding` does, in MuJoCo's block; return the largest change (m/s)."""
    at, count = rows.starts, search.counts[4]
    return correct_sliding(
        contacts.dim, contacts.address[: search.counts[0]], contacts.friction,
        rows.velocity[at[7] : at[7] + count], acceleration, rows.force[at[9] : at[9] + count], timestep,
        surface.base, rows.reference[at[8] : at[8] + count],
    )  # fmt: skip
