"""Rows of contacts that MuJoCo does not make, in worlds whose rows are all solved row by row.

To make the rows of a pile's contacts takes MuJoCo a sixth of a step, twice where points of earlier steps are
added or moved after it has found the contacts. Its rows of joints and equalities are copied here and those of
contacts numbered after them; their Jacobian is written as it is solved. MuJoCo's contacts have no rows then,
so that it knows no force of them; `forces` does.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from roboyard._lazy import lazy_module
from roboyard._mujoco import mujoco
from roboyard.sim.stepping.impulses import records as r
from roboyard.sim.stepping.step_row_kernels import Contacts, Rows
from roboyard.sim.stepping.step_rows import ALL, StepRows
from roboyard.transforms import Array

kernels = lazy_module("roboyard.sim.stepping.impulses.contact_row_kernels")

FEWEST = 8
"""Pairs with kept points in a step from which on the next one is executed in this way.

Results differ from those with MuJoCo's rows in the last digits; the pairs are part of a saved state, so that
it goes on to the last bit."""
_NO_CONTACTS = int(mujoco.mjtDisableBit.mjDSBL_CONTACT)


class ContactRows:
    """The rows of one world's steps."""

    def __init__(self) -> None:
        self.counts = np.zeros(6, np.int32)
        """Numbers of contacts, of rows (equalities, dry friction, limits, all), of the Jacobian's entries."""
        self._rows, self._address = _rows(0, 0), np.zeros(0, np.int32)
        self._bundle: Any = None
        self._made_of: Any = None
        """The bundle of MuJoCo's rows that the present one replaces."""

    def find(
        self, model: Any, data: Any, found: StepRows, collide: Callable[[Callable[..., None], Any, Any], None]
    ) -> int:
        """Compute all that mj_step1 does but rows; return the number of rows of joints and equalities.

        `collide` calls a function of MuJoCo that finds contacts.
        """
        _without_contacts(mujoco.mj_step1, model, data)
        count = found.counts_now()[ALL]
        collide(mujoco.mj_collision, model, data)
        return count

    def make_others(self, model: Any, data: Any) -> None:
        """Let MuJoCo make the rows of joints and equalities."""
        _without_contacts(mujoco.mj_makeConstraint, model, data)

    def take(self, found: StepRows, surface: Any) -> int:
        """Take MuJoCo's rows and number those of contacts; return what `take_rows` does."""
        while True:
            answer = kernels().take_rows(
                *(found.rows, found.contacts, found.search, self._rows, surface.margins, surface.reaches),
                *(self._address, self.counts),
            )
            if answer != r.ROOM:
                return answer
            contacts, rows, entries = (int(self.counts[k]) for k in (0, ALL, 5))
            self._rows = _rows(2 * rows, 2 * entries)
            self._address = np.full(2 * contacts, -1, np.int32)
            self._made_of = None

    def bundle_in_place_of(self, bundle: Any, found: StepRows) -> Any:
        """Return the arrays of a step with these rows instead of MuJoCo's."""
        if self._made_of is not bundle:
            search = found.search
            own = r.Search(
                *(np.zeros(0, np.int64), np.zeros(0, np.int64), self.counts, self._rows.starts),
                *(0, 0, search.contact, search.degrees, r.WITHOUT_CONTACTS),
            )
            contacts: Contacts = found.contacts._replace(address=self._address)
            self._bundle = r.EVERYTHING.of(self._rows, contacts, own, *bundle.records[3:])
            self._made_of = bundle
        return self._bundle

    def give_forces(self, found: StepRows) -> None:
        """Write the forces of joints and equalities into MuJoCo's array."""
        kernels().give_forces(found.rows, found.search, self._rows.force)

    def forces(self, found: StepRows, count: int) -> Array:
        """Return (n, 6) forces (N) and torques (N m) of the contacts that have rows here, 0 of others.

        The components are along the axes of the contacts' frames, on the second body.
        """
        out = np.zeros((count, 6))
        kernels().read_forces(found.contacts, count, self._rows.force, out)
        return out


def _without_contacts(call: Callable[[Any, Any], None], model: Any, data: Any) -> None:
    """Call one of MuJoCo's functions without contacts."""
    option = model.opt
    option.disableflags |= _NO_CONTACTS
    try:
        call(model, data)
    finally:
        option.disableflags &= ~_NO_CONTACTS


def contact_wrenches(model: Any, data: Any, forces: Array) -> Array:
    """Return (nbody, 6) forces (N) of contacts, and torques (N m) about the centres of mass, world frame.

    Args:
        model: MjModel.
        data: MjData.
        forces: (ncon, 6) along the axes of the contacts' frames.
    """
    out = np.zeros((model.nbody, 6))
    contact = data.contact
    pushing = np.flatnonzero(forces.any(axis=1))
    frame = contact.frame[pushing].reshape(-1, 3, 3)
    force = np.einsum("ij,ijk->ik", forces[pushing, :3], frame)
    torque = np.einsum("ij,ijk->ik", forces[pushing, 3:], frame)
    for side, sign in enumerate((-1.0, 1.0)):
        body = model.geom_bodyid[contact.geom[pushing, side]]
        arm = contact.pos[pushing] - data.xipos[body]
        np.add.at(out, body, sign * np.concatenate([force, torque + np.cross(arm, force)], axis=1))
    return out


def _rows(count: int, entries: int) -> Rows:
    """Return room for rows with so many entries of the Jacobian."""
    integers, numbers = np.zeros((4, count), np.int32), np.zeros((7, count))
    return Rows(
        kind=integers[0],
        ids=integers[1],
        jacobian=np.zeros(entries),
        position=numbers[0],
        loss=numbers[1],
        R=numbers[2],
        D=numbers[3],
        velocity=numbers[4],
        reference=numbers[5],
        force=numbers[6],
        entries=integers[2],
        addresses=integers[3],
        columns=np.zeros(entries, np.int32),
        starts=np.zeros(13, np.int64),
    )
