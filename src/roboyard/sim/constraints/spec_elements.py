"""Elements of constraints in the spec and MuJoCo's arrays: equalities between sites."""

from __future__ import annotations

from struct import Struct
from typing import Any

import numpy as np

from roboyard._arrays import ArrayLike
from roboyard._mujoco import mujoco
from roboyard.sim.constraints.records import Constraint, Elements, unit_quaternion
from roboyard.transforms import normalized, to_wxyz

STIFF_SOLREF = (0.005, 1.0)
STIFF_SOLIMP = (0.99, 0.999, 0.001, 0.5, 2.0)
PACK_POSITION, PACK_QUATERNION = Struct("3d").pack_into, Struct("4d").pack_into
"""Write a row of MuJoCo's positions, quaternions (w, x, y, z), of three and four numbers."""
_PACK_STIFFNESS, _PACK_IMPEDANCE = Struct("2d").pack_into, Struct("5d").pack_into


def add(spec: Any, constraint: Constraint, parent_a: Any, parent_b: Any) -> None:
    """Add the elements of a constraint to the spec, with its frames on these bodies."""
    name = f"constraint{constraint.id}"
    constraint.site_a = parent_a.add_site(name=f"{name}/a", group=5)
    constraint.site_b = parent_b.add_site(name=f"{name}/b", group=5)
    is_point = constraint.kind == "point"
    constraint.element = element = spec.add_equality(
        name=name,
        type=mujoco.mjtEq.mjEQ_CONNECT if is_point else mujoco.mjtEq.mjEQ_WELD,
        objtype=mujoco.mjtObj.mjOBJ_SITE,
        name1=constraint.site_a.name,
        name2=constraint.site_b.name,
    )
    if not is_point:
        data = np.array(element.data)
        data[10] = 1.0
        element.data = data
    stiffen(element)


def delete(spec: Any, elements: Elements) -> None:
    """Delete the elements of a constraint from the spec."""
    for element in elements:
        if element is not None:
            spec.delete(element)


def place(constraint: Constraint) -> None:
    """Write the frames of a constraint into the spec."""
    a, b = constraint.site_a, constraint.site_b
    a.pos, a.quat = constraint.position_a, to_wxyz(normalized(constraint.orientation_a))
    b.pos, b.quat = constraint.position_b, to_wxyz(normalized(constraint.orientation_b))


def stiffen(element: Any) -> None:
    """Give an equality of the spec the stiffness of constraints."""
    element.solref = STIFF_SOLREF
    element.solimp = STIFF_SOLIMP


class Arrays:
    """The memory of MuJoCo's arrays that constraints are written into."""

    __slots__ = ("_solimp", "_solref", "active", "active0", "body", "position", "quaternion", "same")

    def __init__(self, model: Any, data: Any) -> None:
        self.position, self.quaternion = model.site_pos.data, model.site_quat.data
        self.body, self.same = model.site_bodyid.data, model.site_sameframe.data
        self.active, self.active0 = data.eq_active.data, model.eq_active0.data
        self._solref, self._solimp = model.eq_solref.data, model.eq_solimp.data

    def stiffen(self, constraint: Constraint) -> None:
        """Give the rows of a constraint the stiffness that they have without a bound."""
        number = constraint.element.id
        _PACK_STIFFNESS(self._solref, 16 * number, *STIFF_SOLREF)
        _PACK_IMPEDANCE(self._solimp, 40 * number, *STIFF_SOLIMP)
        constraint.tuned = 0.0

    def switch(self, number: int, *, on: bool) -> None:
        """Let an equality act, or not."""
        self.active[number] = self.active0[number] = on

    def write(self, constraint: Constraint) -> None:
        """Write the frames of a constraint, and that it is active."""
        link_b = constraint.link_b
        first, second = constraint.rows = constraint.site_a.id, constraint.site_b.id
        owner = 0 if link_b is None else link_b._built.element.id
        self._place(
            first, constraint.link_a._built.element.id, constraint.position_a, constraint.orientation_a
        )
        self._place(second, owner, constraint.position_b, constraint.orientation_b)
        self.switch(constraint.element.id, on=True)

    def _place(self, row: int, owner: int, position: Any, orientation: ArrayLike) -> None:
        self.body[row], self.same[row] = owner, 0
        x, y, z = position
        i, j, k, w = unit_quaternion(orientation)
        PACK_POSITION(self.position, 24 * row, x, y, z)
        PACK_QUATERNION(self.quaternion, 32 * row, w, i, j, k)
