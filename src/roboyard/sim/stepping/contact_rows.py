"""Rows that MuJoCo does not make, in worlds whose rows are all solved row by row.

To make the rows of a pile's contacts takes MuJoCo a sixth of a step, twice where points of earlier steps are
added or moved after it has found the contacts. Those of joints are made here, or copied from MuJoCo's where
it has others, and those of contacts numbered after them; their Jacobian is written as it is solved. MuJoCo
knows no force of them; `forces` and `motor_efforts` do.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from roboyard._lazy import lazy_module
from roboyard._mujoco import mujoco
from roboyard.sim.stepping.impulses import records as r
from roboyard.sim.stepping.manifolds import Manifolds
from roboyard.sim.stepping.points.bound_points import FIRST_CONTACTS
from roboyard.sim.stepping.step_row_kernels import Contacts, Rows
from roboyard.sim.stepping.step_rows import ALL, StepRows
from roboyard.transforms import Array

kernels = lazy_module("roboyard.sim.stepping.impulses.contact_row_kernels")
effort_kernels = lazy_module("roboyard.sim.stepping.effort_kernels")
finding = lazy_module("roboyard.sim.stepping.impulses.finding")

FEWEST = 8
"""Pairs with kept points in a step from which on the next one is executed in this way where MuJoCo has to
make rows besides those of contacts.

Results differ from those with MuJoCo's rows in the last digits; the pairs are part of a saved state, so that
it goes on to the last bit."""
FIRST_ROWS = 48, 512
"""Rows, and entries of their Jacobian, for which a world has room before it has more."""
_NO_CONTACTS = int(mujoco.mjtDisableBit.mjDSBL_CONTACT)
_NO_ROWS = int(mujoco.mjtDisableBit.mjDSBL_CONSTRAINT)
Collide = Callable[[Callable[..., None], Any, Any], None]


def first_half(
    lengths: np.ndarray | None,
    welds: np.ndarray | None,
    model: Any,
    data: Any,
    *,
    merge: Callable[[Any, Any], None] | None = None,
) -> None:
    """Do what mj_step1 does.

    Args:
        lengths: (nv,) of axes; see `Engine.axis_lengths`.
        welds: (2, nbody) of `touching_welds`.
        model: MjModel.
        data: MjData.
        merge: called with both once contacts are found, before they have rows.
    """
    if merge is None:
        mujoco.mj_step1(model, data)
    else:
        without(_NO_CONTACTS, mujoco.mj_step1, model, data)
    if welds is not None or merge is not None:
        find_with_welds(welds, model, data)
    if merge is not None:
        merge(model, data)
    if lengths is not None:
        data.cdof *= lengths[:, None]
        mujoco.mj_makeM(model, data)
        mujoco.mj_factorM(model, data)
    if merge is not None and welds is None and lengths is None:
        mujoco.mj_makeConstraint(model, data)
        mujoco.mj_island(model, data)
        mujoco.mj_projectConstraint(model, data)
        mujoco.mj_referenceConstraint(model, data)
    elif welds is not None or lengths is not None:
        mujoco.mj_makeConstraint(model, data)
        mujoco.mj_island(model, data)
        mujoco.mj_projectConstraint(model, data)
        mujoco.mj_fwdVelocity(model, data)


def find_with_welds(welds: np.ndarray | None, model: Any, data: Any) -> None:
    """Do what mj_collision does, with links that are fixed to each other as `touching_welds` has them.

    Args:
        welds: (2, nbody) that it returned; None for MuJoCo's own.
        model: MjModel, whose arrays are exchanged during the call.
        data: its MjData.
    """
    if welds is None:
        mujoco.mj_collision(model, data)
        return
    kept = model.body_weldid.copy(), model.body_dofnum.copy()
    model.body_weldid[:], model.body_dofnum[:] = welds
    try:
        mujoco.mj_collision(model, data)
    finally:
        model.body_weldid[:], model.body_dofnum[:] = kept


class ContactRows:
    """The rows of one world's steps."""

    def __init__(self) -> None:
        self.counts = np.zeros(6, np.int32)
        """Numbers of contacts, of rows (equalities, dry friction, limits, all), of the Jacobian's entries."""
        self._rows, self._address = _rows(*FIRST_ROWS), np.full(FIRST_CONTACTS, -1, np.int32)
        self._counted: Any = None
        """The search among these rows."""
        self._model: Any = None
        self._makes_joints = False
        self.has_equalities = False
        """Whether any equality of the model may act."""
        self._data: Any = None
        self._lengths: np.ndarray | None = None
        self.welds: np.ndarray | None = None
        """(2, nbody) of `touching_welds`; a new array where it changes."""
        self.links_touch = False
        """Whether links of a robot touch one another, of which MuJoCo leaves rows out that Bullet has."""
        self._known_welds: np.ndarray | None = None
        self._addresses: tuple[int, ...] | None = None
        """Arguments of `find_contacts` for the model and this data, none where they are not known."""
        self.last: Rows | None = None
        """Arrays with all rows of the last step, these or MuJoCo's; None where it is not known where they
        are."""

    def invalidate(self) -> None:
        """Note that MuJoCo's arrays are new."""
        self._model = self.welds = self.last = None

    @property
    def is_last(self) -> bool:
        """Whether all rows of the last step are here."""
        return self.last is self._rows

    def note_none(self) -> None:
        """Note that all rows are here and that there are none, before the first step."""
        self.counts[:] = 0
        self.last = self._rows

    def makes_joints(self, model: Any) -> bool:
        """Return whether rows of joints are made here, too: there are no others but those of contacts."""
        if self._model is not model:
            turning = model.jnt_type == int(mujoco.mjtJoint.mjJNT_BALL)
            self._makes_joints = not (model.ntendon or turning.any())
            self._model, self._addresses = model, None
        return self._makes_joints and not self.has_equalities

    def serves(self, model: Any, manifolds: Manifolds) -> bool:
        """Return whether the next step is to be executed in this way."""
        return self.makes_joints(model) or self.links_touch or manifolds.pair_count >= FEWEST

    def find(self, model: Any, data: Any, flags: int, lengths: np.ndarray | None) -> None:
        """Compute all that mj_step1 does but rows.

        Args:
            model: MjModel.
            data: MjData.
            flags: those of MuJoCo while contacts are found.
            lengths: (nv,) of axes; see `Engine.axis_lengths`.
        """
        self.locate(model, data, lengths)
        if self._addresses:
            finding().find_contacts(*self._addresses, flags)
            return
        without(_NO_CONTACTS | _NO_ROWS, partial(first_half, lengths, None), model, data)
        without(flags, partial(find_with_welds, self.welds), model, data)

    def locate(self, model: Any, data: Any, lengths: np.ndarray | None) -> None:
        """Look up the arguments of `find_contacts`, where these are others than before.

        Args:
            model: MjModel.
            data: MjData.
            lengths: (nv,) of axes; see `Engine.axis_lengths`.
        """
        if (
            self._addresses is None
            or self._data is not data
            or self._lengths is not lengths
            or self._known_welds is not self.welds
        ):
            self._data, self._lengths, place = data, lengths, finding().flags_place()
            welds = self._known_welds = self.welds
            disabled = model.opt.gravity.ctypes.data + place
            scaled = (
                (0, 0, 0) if lengths is None else (lengths.ctypes.data, data.cdof.ctypes.data, len(lengths))
            )
            swapped = (
                (0, 0, 0, 0)
                if welds is None
                else (
                    *(array.ctypes.data for array in (model.body_weldid, model.body_dofnum, welds)),
                    model.nbody,
                )
            )
            self._addresses = (
                (model._address, data._address, disabled, *scaled, *swapped) if place >= 0 else ()
            )

    def known_addresses(self, data: Any) -> tuple[int, ...] | None:
        """Return the arguments of `find_contacts`, as found last; none for other data."""
        return self._addresses if self._data is data and self._known_welds is self.welds else None

    def find_with_others(
        self, model: Any, data: Any, found: StepRows, collide: Collide, lengths: np.ndarray | None
    ) -> int:
        """Do what `find` does; return the number of rows of joints and equalities that MuJoCo has to make.

        Args:
            model: MjModel.
            data: MjData.
            found: the contacts and rows.
            collide: calls a function of MuJoCo that finds contacts.
            lengths: (nv,) of axes; see `Engine.axis_lengths`.
        """
        without(_NO_CONTACTS, partial(first_half, lengths, None), model, data)
        count = found.counts_now()[ALL]
        collide(partial(find_with_welds, self.welds), model, data)
        return count

    def make_others(self, model: Any, data: Any) -> None:
        """Let MuJoCo make the rows of joints and equalities."""
        without(_NO_CONTACTS, mujoco.mj_makeConstraint, model, data)

    def records(self, found: StepRows) -> tuple[Rows, Contacts, r.Search]:
        """Return the arrays of rows and contacts as arguments of compiled loops, until they grow."""
        known = found.own_records
        if known is None or known[0] is not self._rows:
            search = found.search
            own = r.Search(
                *(np.zeros(0, np.int64), np.zeros(0, np.int64), self.counts, self._rows.starts),
                *(0, 0, search.contact, search.degrees, r.WITHOUT_CONTACTS),
            )
            known = found.own_records = self._rows, found.contacts._replace(address=self._address), own
        self._counted = known[2]
        return known

    def grow(self) -> None:
        """Make room for as many contacts, rows and entries as `counts` says."""
        contacts, rows, entries = (int(self.counts[k]) for k in (0, ALL, 5))
        if contacts > len(self._address) or rows > len(self._rows.kind) or entries > len(self._rows.jacobian):
            is_last = self.is_last
            self._rows = _rows(2 * rows, 2 * entries)
            if is_last:
                self.last = self._rows
            self._address = np.full(2 * contacts, -1, np.int32)

    def motor_efforts(self) -> Array:
        """Return the (nv,) efforts of motors in the last step (N m or N)."""
        counted = self._counted
        out = np.zeros(counted.degrees)
        effort_kernels().motor_efforts(self._rows, counted, out)
        return out

    def add_limit_efforts(self, model: Any, out: Array) -> None:
        """Add the efforts of limits in the last step to (nv,) (N m or N)."""
        effort_kernels().limit_efforts(self._rows, self._counted, model.jnt_dofadr, out)

    def add_wrenches(
        self,
        model: Any,
        data: Any,
        found: StepRows,
        forces: Array,
        surface: r.Surface | None,
        points: r.Points,
        wrenches: Array,
        *,
        are_whole: bool = True,
    ) -> None:
        """Add the wrenches of contacts to those on bodies.

        Args:
            model: MjModel.
            data: MjData.
            found: the contacts.
            forces: (n, 6), as of `forces`.
            surface: of the shapes, if it is known.
            points: that contacts keep.
            wrenches: (nbody, 6) forces (N) and torques (N m) about centres of mass.
            are_whole: whether all of them are added, or only what they are more than at the places of
                MuJoCo's contacts, where it adds them itself.
        """
        count, slots = len(forces), points.slots
        if surface is None or not len(surface.boxes) or len(slots) < count:
            slots = np.full(count, -1, np.int32)
        margins = np.zeros(model.ngeom) if surface is None or not len(surface.margins) else surface.margins
        kernels().add_wrenches(
            *(found.contacts, count, forces, model.geom_bodyid, data.xipos, data.xpos, data.xmat),
            *(margins, slots, points.points[points.notes.item(r.TABLE)], float(are_whole), wrenches),
        )

    def give_forces(self, found: StepRows) -> None:
        """Write the forces of joints and equalities into MuJoCo's array."""
        kernels().give_forces(found.rows, found.search, self._rows.force)

    @property
    def arrays(self) -> Rows:
        """The arrays of the rows, until there are more."""
        return self._rows

    def forces(self, found: StepRows, count: int) -> Array:
        """Return (n, 6) forces (N) and torques (N m) of the contacts that have rows here, 0 of others.

        The components are along the axes of the contacts' frames, on the second body.
        """
        out = np.zeros((count, 6))
        kernels().read_forces(found.contacts, count, self._rows.force, out)
        return out


def without(flags: int, call: Callable[[Any, Any], None], model: Any, data: Any) -> None:
    """Call one of MuJoCo's functions with more flags of what is disabled."""
    option = model.opt
    kept = option.disableflags
    option.disableflags = kept | flags
    try:
        call(model, data)
    finally:
        option.disableflags = kept


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
