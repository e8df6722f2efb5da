"""Elements of constraints in the spec and MuJoCo's arrays: equalities between sites."""

from __future__ import annotations

from typing import Any

import numpy as np

from roboyard._mujoco import mujoco
from roboyard.sim.constraints.records import Constraint, Elements
from roboyard.transforms import normalized, to_wxyz

STIFF_SOLREF = (0.005, 1.0)
STIFF_SOLIMP = (0.99, 0.999, 0.001, 0.5, 2.0)


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


def write(constraint: Constraint, model: Any, data: Any) -> None:
    """Write the frames of a constraint into MuJoCo's arrays, and that it is active."""
    link_b, number = constraint.link_b, constraint.element.id
    rows = constraint.rows = constraint.site_a.id, constraint.site_b.id
    owners = constraint.link_a._built.element.id, 0 if link_b is None else link_b._built.element.id
    for row, owner, position, orientation in (
        (rows[0], owners[0], constraint.position_a, constraint.orientation_a),
        (rows[1], owners[1], constraint.position_b, constraint.orientation_b),
    ):
        model.site_bodyid[row], model.site_sameframe[row] = owner, 0
        model.site_pos[row], model.site_quat[row] = position, to_wxyz(normalized(orientation))
    data.eq_active[number] = model.eq_active0[number] = True
