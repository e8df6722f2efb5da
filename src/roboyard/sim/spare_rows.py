"""Rows of MuJoCo's arrays that change hands: a spare becomes a body, a body is parked."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from roboyard.poses import Array
from roboyard.sim.moulds import Mould, row_starts
from roboyard.sim.records import Built

if TYPE_CHECKING:
    from roboyard.sim.engine import Engine

PARKED_FIELDS = ("geom_contype", "geom_conaffinity", "geom_rgba", "body_contype", "body_conaffinity")
"""What tells a parked body from one in use."""


@dataclass(kw_only=True, slots=True, eq=False)
class Spare:
    """Rows of one body in MuJoCo's arrays, and its elements in the spec."""

    name: str
    """While it is nobody's."""
    mould: Mould
    """What its elements in the spec say."""
    element: Any
    free_joint: Any
    geoms: list[Any]
    owner: int = -1
    """Id of the body that lives here; -1 while it is parked."""
    is_pristine: bool = True
    """Nobody has had it yet."""
    starts: dict[str, int] = field(default_factory=dict)
    """First row by kind of array."""


class SpareRows:
    """Writes single bodies into a compiled world's arrays."""

    def __init__(self, engine: Engine) -> None:
        self._engine = engine
        self._arrays: dict[str, np.ndarray] = {}
        self._mass = self._inertia = 0.0
        self._dofs = 0

    def look(self, spares: list[Spare]) -> None:
        """After a compile: see where spares lie, and park them."""
        model = self._engine.live_model
        self._arrays = {}
        self._mass, self._inertia = float(model.body_mass.sum()), float(model.dof_M0.sum())
        self._dofs = int(model.nv)
        for spare in spares:
            spare.starts = row_starts(model, spare.element.id)
            self._park(spare.starts, len(spare.geoms))
        if spares:
            self._weigh()

    def fill(self, spare: Spare, mould: Mould, name: str, position: Array, wxyz: Array) -> None:
        """Make a parked spare the body of a mould.

        Args:
            spare: of the mould's make.
            mould: what it becomes.
            name: of its elements in the spec.
            position: (3,) m.
            wxyz: (4,) unit.
        """
        element, starts = spare.element, spare.starts
        related = spare.is_pristine and spare.mould.family is mould.family
        if not (related and spare.mould is mould):
            _write_elements(spare, mould, plainly=related)
        element.name = name
        element.pos, element.quat = position, wxyz
        if not related:
            names: Any = mould.blocks
        elif spare.mould is mould:
            names = PARKED_FIELDS
        else:
            names = (*PARKED_FIELDS, *mould.varied, *spare.mould.varied)
        blocks, kinds = mould.blocks, mould.kinds
        for label in names:
            block, start = blocks[label], starts[kinds[label]]
            self._array(label)[start : start + len(block)] = block
        spare.mould, spare.is_pristine = mould, False
        row = starts["body"]
        self._array("body_pos")[row] = position
        self._array("body_quat")[row] = wxyz
        if spare.free_joint is not None:
            spare.free_joint.name = f"{name}/free"
            first = starts["qpos"]
            data = self._engine.live_data
            for values in (self._array("qpos0"), self._array("qpos_spring"), data.qpos):
                values[first : first + 3] = position
                values[first + 3 : first + 7] = wxyz
            self._rest(starts)
        self._count(self._array("body_mass")[row], starts, 1)
        self._weigh()

    def park(self, spare: Spare) -> None:
        """Nobody's from now on."""
        spare.owner = -1
        spare.element.name = spare.name
        if spare.free_joint is not None:
            spare.free_joint.name = spare.name
        self._put_away(spare.starts, len(spare.geoms))

    def park_body(self, built: Built, name: str) -> None:
        """A body of one link is gone; its rows stay for now, under another name."""
        record = built.links[0]
        record.element.name = name
        if built.free_joint is not None:
            built.free_joint.name = name
        starts = row_starts(self._engine.live_model, record.element.id)
        self._put_away(starts, len(record.geoms) + len(record.visuals))

    def _put_away(self, starts: dict[str, int], geoms: int) -> None:
        if starts["dof"] >= 0:
            self._rest(starts)
        self._park(starts, geoms)
        self._weigh()

    def _park(self, starts: dict[str, int], geoms: int) -> None:
        """Out of the way: nothing touches it, no ray meets it, nothing draws it."""
        row, first = starts["body"], starts["geom"]
        for name in PARKED_FIELDS:
            where = slice(first, first + geoms) if name.startswith("geom") else row
            self._array(name)[where] = 0
        self._count(self._array("body_mass")[row], starts, -1)

    def _rest(self, starts: dict[str, int]) -> None:
        """No velocity, nothing that pushes, nothing remembered of the last step."""
        data, first = self._engine.live_data, starts["dof"]
        for values in (data.qvel, data.qacc, data.qacc_warmstart, data.qfrc_applied):
            values[first : first + 6] = 0.0
        data.xfrc_applied[starts["body"]] = 0.0

    def _count(self, mass: float, starts: dict[str, int], sign: int) -> None:
        self._mass += sign * float(mass)
        first = starts["dof"]
        if first >= 0:
            self._inertia += sign * float(self._array("dof_M0")[first : first + 6].sum())
            self._dofs += 6 * sign

    def _weigh(self) -> None:
        """Parked bodies count neither for the mass of the whole world nor for its mean inertia.

        By the latter MuJoCo measures how far its solvers have come.
        """
        self._array("body_subtreemass")[0] = self._mass
        self._engine.live_model.stat.meaninertia = self._inertia / self._dofs if self._dofs else 1.0

    def _array(self, name: str) -> np.ndarray:
        found = self._arrays.get(name)
        if found is None:
            found = self._arrays[name] = getattr(self._engine.live_model, name)
        return found


def _write_elements(spare: Spare, mould: Mould, *, plainly: bool) -> None:
    """Make a body of a spec and its geoms what a mould says; `plainly`: only numbers differ."""
    pairs = [(spare.element, mould.body, spare.mould.body)]
    pairs += zip(spare.geoms, mould.geoms, spare.mould.geoms, strict=True)
    for element, fields, before in pairs:
        for name, value in fields.items():
            if not (plainly and value is before[name]):
                setattr(element, name, value)
