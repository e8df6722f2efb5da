"""Constraints between links besides joints: welds, slides, points and gears, with force bounds.

In the spec that is compiled, the frames of welds, slides and points belong to the world; which link each is
on, and where, is written into MuJoCo's arrays, as are the joints of gears. So a constraint that is removed
becomes inactive, and the next one of its size takes its rows, both without a compile; a gear of three joints
is compiled. A spec that is read has all frames on their links.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any, Literal

import numpy as np

from roboyard._arrays import ArrayLike
from roboyard._mujoco import mujoco
from roboyard.errors import RoboyardError, StaleHandleError
from roboyard.sim.body import Body
from roboyard.sim.constraints import spec_elements
from roboyard.sim.constraints.records import (
    Constraint,
    Elements,
    Kind,
    check_finite,
    check_force,
    checked_orientation,
    checked_position,
    size_of,
    unit_quaternion,
)
from roboyard.sim.constraints.rows import ConstraintRows
from roboyard.sim.constraints.spec_elements import PACK_POSITION, PACK_QUATERNION
from roboyard.sim.engine import Engine
from roboyard.sim.joint import Joint
from roboyard.sim.link import Link

MOST_INACTIVE = 8
"""Largest number of inactive constraints of each size that a compile keeps."""


class Constraints:
    """The constraints of one world."""

    def __init__(self, world: Engine[Body]) -> None:
        self._world = world
        self._by_id: dict[int, Constraint] = {}
        self._next = 1
        self._new: list[Constraint] = []
        """Those that are not in the spec yet; one that is removed before costs no compile."""
        self.before_entering: Callable[[], None] | None = None
        """Called before new constraints enter the spec: adds those that other layers have not added yet."""
        self.before_reuse: Callable[[], None] | None = None
        """Called before rows of a removed constraint become another's, while they hold the last step."""
        self._inactive: dict[str, list[Elements]] = {"weld": [], "point": [], "gear": []}
        """Elements of removed constraints in the spec, inactive, by kind; slides are welds."""
        self._geared: dict[str, tuple[int, int, str, str]] = {}
        """By name of a gear's element in the spec, the ids of two bodies and the names of their joints."""
        self._arrays: Any = None
        """The memory of MuJoCo's arrays."""
        self._edits = -1
        """Edits of the world so far, if they are the only ones since its compile; else -1."""
        self.rows = ConstraintRows(world, self._by_id)
        """What they do in a step."""

    def __len__(self) -> int:
        return len(self._by_id)

    @property
    def has_slides(self) -> bool:
        """Whether any constraint has an axis that steps must free."""
        return any(constraint.axis is not None for constraint in self._by_id.values())

    @property
    def is_bounded(self) -> bool:
        """Whether any constraint has a force bound or an axis that steps must apply."""
        return any(
            constraint.kind == "slide" or math.isfinite(constraint.max_force)
            for constraint in self._by_id.values()
        )

    @property
    def inactive_count(self) -> int:
        """Number of rows of removed constraints among MuJoCo's equalities."""
        return sum(map(len, self._inactive.values()))

    def add_weld(
        self,
        link_a: Link,
        link_b: Link | None,
        *,
        position_a: ArrayLike = (0, 0, 0),
        orientation_a: ArrayLike = (0, 0, 0, 1),
        position_b: ArrayLike = (0, 0, 0),
        orientation_b: ArrayLike = (0, 0, 0, 1),
        max_force: float = np.inf,
    ) -> Constraint:
        """Weld a frame of one link to a frame of another (or of the world).

        Args:
            link_a: first link.
            link_b: second link; None for the world.
            position_a: (3,) origin in the frame of link_a (m).
            orientation_a: (4,) quaternion x, y, z, w in the frame of link_a.
            position_b: (3,) origin in the frame of link_b (m).
            orientation_b: (4,) quaternion x, y, z, w in the frame of link_b.
            max_force: bound of each row (N or N m).
        """
        return self._between(
            "weld", link_a, link_b, position_a, orientation_a, position_b, orientation_b, max_force
        )

    def add_point(
        self,
        link_a: Link,
        link_b: Link | None,
        *,
        position_a: ArrayLike = (0, 0, 0),
        position_b: ArrayLike = (0, 0, 0),
        max_force: float = np.inf,
    ) -> Constraint:
        """Connect a point of one link to a point of another (or of the world); both turn freely.

        Args:
            link_a: first link.
            link_b: second link; None for the world.
            position_a: (3,) point in the frame of link_a (m).
            position_b: (3,) point in the frame of link_b (m).
            max_force: bound of each row (N).
        """
        none = (0.0, 0.0, 0.0, 1.0)
        return self._between("point", link_a, link_b, position_a, none, position_b, none, max_force)

    def add_slide(
        self,
        link_a: Link,
        link_b: Link | None,
        axis: ArrayLike,
        *,
        position_a: ArrayLike = (0, 0, 0),
        orientation_a: ArrayLike = (0, 0, 0, 1),
        position_b: ArrayLike = (0, 0, 0),
        orientation_b: ArrayLike = (0, 0, 0, 1),
        max_force: float = np.inf,
    ) -> Constraint:
        """Keep a frame of one link on a line through a frame of another, with equal orientations.

        Args:
            link_a: first link.
            link_b: second link; None for the world.
            axis: (3,) direction of the line, in the frame on link_a.
            position_a: (3,) origin in the frame of link_a (m).
            orientation_a: (4,) quaternion x, y, z, w in the frame of link_a.
            position_b: (3,) origin in the frame of link_b (m).
            orientation_b: (4,) quaternion x, y, z, w in the frame of link_b.
            max_force: bound of each row (N or N m).

        Raises:
            RoboyardError: the axis is zero.
        """
        direction = np.array(axis, dtype=float)
        length = math.hypot(*direction) if direction.shape == (3,) else 0.0
        if not 0 < length < np.inf:
            raise RoboyardError(f"a slide needs a non-zero axis of three numbers, got {axis}")
        made = self._between(
            "slide",
            link_a,
            link_b,
            position_a,
            orientation_a,
            position_b,
            orientation_b,
            max_force,
        )
        made.axis = direction / length
        self._world.constraints_changed()
        return made

    def add_gear(
        self,
        joint_a: Joint,
        joint_b: Joint,
        ratio: float,
        *,
        against: Joint | None = None,
        max_force: float = np.inf,
    ) -> Constraint:
        """Couple joints of one degree of freedom from now on: v_a + ratio v_b = 0, or v_against.

        Raises:
            RoboyardError: a joint is neither hinge nor slide.
        """
        for joint in (joint_a, joint_b, *(() if against is None else (against,))):
            if not joint.is_scalar:
                raise RoboyardError(f"joint {joint.name!r} is {joint.type}; gears couple hinges and slides")
        check_finite("the ratio", ratio)
        check_force(max_force)
        if self.before_entering is not None:
            self.before_entering()
        joints, found = (joint_a, joint_b), self._inactive["gear"]
        constraint = Constraint(id=self._next, kind="gear", link_a=joint_a.child, link_b=joint_b.child)
        if against is None and found and not self._world.is_stale:
            self._reuse_gear(constraint, joints, max_force)
        else:
            self.enter_new()
            if against is None and found:
                constraint.element = found.pop()[0]
                constraint.element.active = True
                self._name_joints(constraint.element, joints)
            else:
                self._add_gear(constraint, joints if against is None else (*joints, against), ratio)
            self._register(constraint, max_force)
            self._world.mark_stale()
        offset = joint_a.position + ratio * joint_b.position
        self.set_gear(constraint, ratio, offset if against is None else offset - against.position)
        return constraint

    def change_gear(
        self,
        constraint: Constraint,
        joints: tuple[Joint, Joint],
        ratio: float,
        *,
        target: float | None,
        share: float,
    ) -> None:
        """Give a gear of two joints another ratio, from now on.

        Args:
            constraint: the gear.
            joints: those that it couples.
            ratio: of `add_gear`.
            target: q_a + ratio q_b (rad or m), held from now on; None for that of the present positions.
            share: of the profile's error reduction.
        """
        now = joints[0].position + ratio * joints[1].position if target is None else target
        self.set_gear(constraint, ratio, now)
        if share != constraint.share:
            constraint.share = share
            self._world.constraints_changed()

    def _add_gear(self, constraint: Constraint, joints: Sequence[Joint], ratio: float) -> None:
        """Add the elements of a gear of two or three joints to the spec."""
        name, spec = f"constraint{constraint.id}", self._world.raw_spec
        kind, of = mujoco.mjtEq.mjEQ_JOINT, mujoco.mjtObj.mjOBJ_JOINT
        if len(joints) > 2:
            constraint.tendon = spec.add_tendon(name=name)
            for joint, coefficient in zip(joints, (1.0, ratio, -1.0), strict=True):
                constraint.tendon.wrap_joint(joint._built.joint_elements[0].name, coefficient)
            kind, of = mujoco.mjtEq.mjEQ_TENDON, mujoco.mjtObj.mjOBJ_TENDON
        constraint.element = spec.add_equality(name=name, type=kind, objtype=of, name1=name)
        if len(joints) == 2:
            self._name_joints(constraint.element, joints)
        spec_elements.stiffen(constraint.element)

    def _name_joints(self, element: Any, joints: Sequence[Joint]) -> None:
        """Write the names of a gear's joints into the spec."""
        one, two = joints
        names = one._built.joint_elements[0].name, two._built.joint_elements[0].name
        known, name = (one.body.id, two.body.id, *names), element.name
        if self._geared.get(name) != known:
            element.name1, element.name2 = names
            self._geared[name] = known

    def _reuse_gear(self, constraint: Constraint, joints: Sequence[Joint], max_force: float) -> None:
        """Let a new gear of two joints have the row of a removed one."""
        model, number = self._take_inactive(constraint, max_force)
        self._name_joints(constraint.element, joints)
        one, two = (joint._built.joint_elements[0].id for joint in joints)
        model.eq_obj1id[number], model.eq_obj2id[number] = one, two
        self._arrays.switch(number, on=True)
        self._changed()

    def _between(
        self,
        kind: Kind,
        link_a: Link,
        link_b: Link | None,
        position_a: ArrayLike,
        orientation_a: ArrayLike,
        position_b: ArrayLike,
        orientation_b: ArrayLike,
        max_force: float,
    ) -> Constraint:
        constraint = Constraint(
            id=self._next,
            kind=kind,
            link_a=link_a,
            link_b=link_b,
            position_a=checked_position("position_a", position_a),
            orientation_a=checked_orientation(orientation_a),
            position_b=checked_position("position_b", position_b),
            orientation_b=checked_orientation(orientation_b),
        )
        check_force(max_force)
        world = self._world
        if not world.is_stale and self._reuse(constraint, max_force):
            return constraint
        if not self._new:
            self._edits = -1 if world.is_stale else world.edits
        self._new.append(constraint)
        self._register(constraint, max_force)
        world.mark_stale(grows=True)
        if self._edits >= 0:
            self._edits += 1
        return constraint

    def _register(self, constraint: Constraint, max_force: float) -> None:
        constraint.max_force = max_force
        self._by_id[constraint.id] = constraint
        self._next += 1

    def enter_new(self) -> None:
        """Add new constraints to the spec, before it is compiled or read."""
        if self.before_entering is not None:
            self.before_entering()
        inactive = self._inactive
        for constraint in self._new:
            self._enter(constraint)
        self._new.clear()
        for constraint in self._by_id.values():
            if constraint.kind == "gear":
                self._write_gear(constraint)
        for found in inactive.values():
            for elements in found[MOST_INACTIVE:]:
                spec_elements.delete(self._world.raw_spec, elements)
            del found[MOST_INACTIVE:]
            for element, _, _ in found:
                element.active = False

    def key(self) -> tuple[tuple[int, str], ...] | None:
        """Return ids and sizes of all constraints that the next compile has, also of those that other layers
        have not added yet; None with gears or inactive ones.
        """
        if self.before_entering is not None:
            self.before_entering()
        found = tuple((constraint.id, size_of(constraint.kind)) for constraint in self._by_id.values())
        has_others = any(self._inactive.values()) or any(size == "gear" for _, size in found)
        return None if has_others else found

    def elements(self) -> tuple[Elements, ...]:
        """Return the elements of all constraints in the spec."""
        return tuple((c.element, c.site_a, c.site_b) for c in self._by_id.values())

    def take(self, elements: tuple[Elements, ...]) -> None:
        """Take over what `elements` returned of a world with an equal key."""
        self.leave()
        self._new.clear()
        for constraint, given in zip(self._by_id.values(), elements, strict=True):
            constraint.element, constraint.site_a, constraint.site_b = given

    def leave(self) -> None:
        """Note that the spec is another one, without constraints yet."""
        self._new = list(self._by_id.values())
        for constraint in self._new:
            constraint.element = constraint.site_a = constraint.site_b = None
        for found in self._inactive.values():
            found.clear()

    def complete_spec(self) -> None:
        """Put all frames on their links in the spec, and delete what is inactive, before the spec is read."""
        self.enter_new()
        self.delete_inactive()
        world, spec = self._world, self._world.raw_spec
        moved = [c for c in self._by_id.values() if c.has_frames and not c.is_in_place]
        for constraint in moved:
            spec_elements.delete(spec, (constraint.element, constraint.site_a, constraint.site_b))
        for constraint in moved:
            link_b = constraint.link_b
            parent_b = spec.worldbody if link_b is None else link_b._built.element
            spec_elements.add(spec, constraint, constraint.link_a._built.element, parent_b)
            constraint.is_in_place = True
        for constraint in self._by_id.values():
            if constraint.has_frames:
                spec_elements.place(constraint)
        if moved:
            world.mark_stale()

    def delete_inactive(self) -> None:
        """Delete what is inactive from the spec, before MuJoCo's arrays are read by others."""
        if not any(self._inactive.values()):
            return
        for found in self._inactive.values():
            for elements in found:
                spec_elements.delete(self._world.raw_spec, elements)
            found.clear()
        self._world.mark_stale()

    def _enter(self, constraint: Constraint) -> None:
        found = self._inactive[size_of(constraint.kind)]
        if found:
            constraint.element, constraint.site_a, constraint.site_b = found.pop()
            constraint.element.active = True
            return
        world_body = self._world.raw_spec.worldbody
        spec_elements.add(self._world.raw_spec, constraint, world_body, world_body)

    def _reuse(self, constraint: Constraint, max_force: float) -> bool:
        """Let a new constraint have the rows of a removed one; return whether there were any."""
        if not self._inactive[size_of(constraint.kind)]:
            return False
        self._take_inactive(constraint, max_force)
        self._arrays.write(constraint)
        self._changed()
        return True

    def _take_inactive(self, constraint: Constraint, max_force: float) -> tuple[Any, int]:
        """Give a new constraint the elements of a removed one; return MuJoCo's model and its row there."""
        world = self._world
        if self.before_reuse is not None:
            self.before_reuse()
        found = self._inactive[size_of(constraint.kind)].pop()
        constraint.element, constraint.site_a, constraint.site_b = found
        constraint.element.active = True
        self._register(constraint, max_force)
        model, data, number = world.live_model, world.live_data, constraint.element.id
        self._arrays.stiffen(constraint)
        count = data.ne
        if count:
            ours = data.efc_id[:count] == number
            data.efc_force[:count][ours] = 0.0  # of the removed one
        return model, number

    def _changed(self) -> None:
        """Note that a constraint came or went without a compile."""
        self.rows.refresh()
        self._world.mark_moved()
        self._world.constraints_changed()

    # --------------------------------------------------------------------------------------------- changing

    def get(self, constraint_id: int) -> Constraint:
        """Return the constraint of an id.

        Raises:
            StaleHandleError: it was removed or never existed.
        """
        if constraint_id not in self._by_id:
            raise StaleHandleError(f"there is no constraint {constraint_id}; it may have been removed")
        return self._by_id[constraint_id]

    @property
    def all(self) -> tuple[Constraint, ...]:
        """All constraints, in the order they were added."""
        return tuple(self._by_id.values())

    def set_frame(
        self,
        constraint: Constraint,
        side: Literal["a", "b"],
        position: ArrayLike | None = None,
        orientation: ArrayLike | None = None,
    ) -> None:
        """Move the frame of one side; takes effect at the next step without a compile.

        Args:
            constraint: a weld, slide or point.
            side: of link_a or link_b.
            position: (3,) in the link frame (m); None keeps it.
            orientation: (4,) quaternion x, y, z, w in the link frame; None keeps it.

        Raises:
            RoboyardError: the constraint is a gear.
        """
        if not constraint.has_frames:
            raise RoboyardError(f"constraint {constraint.id} is a gear and has no frames")
        place = None if position is None else checked_position("a position", position)
        turn = None if orientation is None else unit_quaternion(orientation)
        is_live = constraint.element is not None and self._world.takes_numbers()
        if side == "a":
            constraint.position_a = constraint.position_a if place is None else place
            constraint.orientation_a = constraint.orientation_a if turn is None else turn
        else:
            constraint.position_b = constraint.position_b if place is None else place
            constraint.orientation_b = constraint.orientation_b if turn is None else turn
        if not is_live:
            return
        row = constraint.rows[0 if side == "a" else 1]
        if place is not None:
            x, y, z = np.asarray(place).tolist() if type(place) is not tuple else place
            PACK_POSITION(self._arrays.position, 24 * row, x, y, z)
        if turn is not None:
            i, j, k, w = turn
            PACK_QUATERNION(self._arrays.quaternion, 32 * row, w, i, j, k)

    def set_gear(self, constraint: Constraint, ratio: float, offset: float) -> None:
        """Couple positions as q_a = offset - ratio q_b; with a third joint as q_a = offset - ratio q_b + q_c.

        Raises:
            RoboyardError: the ratio of a gear of three joints changes; make a new one instead.
        """
        if constraint.tendon is not None and ratio != constraint.gear_ratio and constraint.gear_ratio:
            raise RoboyardError(
                f"the ratio of a gear of three joints cannot change from {constraint.gear_ratio} to {ratio}; "
                "make a new gear"
            )
        check_finite("ratio and offset", (ratio, offset))
        constraint.gear_ratio, constraint.gear_offset = ratio, offset
        if self._world.takes_numbers():
            factor = 0.0 if constraint.tendon is not None else -ratio
            self._world.live_model.eq_data[constraint.element.id, :2] = offset, factor

    def _write_gear(self, constraint: Constraint) -> None:
        """Write the positions that a gear couples into the spec."""
        data = np.zeros(len(constraint.element.data))
        data[:2] = constraint.gear_offset, 0.0 if constraint.tendon is not None else -constraint.gear_ratio
        constraint.element.data = data

    def set_max_force(self, constraint: Constraint, max_force: float) -> None:
        """Set the force bound of each row (N or N m).

        Raises:
            RoboyardError: it is not a number.
        """
        check_force(max_force)
        if constraint.max_force == max_force:
            return
        was_bounded = math.isfinite(constraint.max_force)
        constraint.max_force = max_force
        if was_bounded and math.isfinite(max_force) and self.rows.write_bound(constraint):
            return
        self.rows.refresh()
        self._world.constraints_changed()

    def remove(self, constraint: Constraint) -> None:
        """Remove a constraint."""
        self.get(constraint.id)
        if constraint in self._new:
            self._drop_new(constraint)
            return
        world = self._world
        del self._by_id[constraint.id]
        self.rows.refresh()
        elements = constraint.element, constraint.site_a, constraint.site_b
        if constraint.tendon is None and not constraint.is_in_place:
            self._inactive[size_of(constraint.kind)].append(elements)
            if world.takes_numbers():
                self._arrays.switch(constraint.element.id, on=False)
                self._changed()
            return
        self.enter_new()
        spec = world.raw_spec
        spec_elements.delete(spec, elements)
        if constraint.tendon is not None:
            spec.delete(constraint.tendon)
        world.mark_stale()

    def _drop_new(self, constraint: Constraint) -> None:
        """Remove a constraint that is not in the spec yet; without other edits, none is compiled."""
        world = self._world
        self._new.remove(constraint)
        del self._by_id[constraint.id]
        if not self._new:
            world.forgo_compile(self._edits)
        world.constraints_changed()

    def forget(self, body_id: int) -> None:
        """Remove the constraints of a body that is removed."""
        for constraint in self.all:
            ends = (constraint.link_a, constraint.link_b)
            if any(link is not None and link.body.id == body_id for link in ends):
                self.remove(constraint)
        gears = self._inactive["gear"]
        ending = [elements for elements in gears if body_id in self._geared[elements[0].name][:2]]
        for elements in ending:  # they name joints that end
            gears.remove(elements)
            spec_elements.delete(self._world.raw_spec, elements)
        if ending:
            self._world.mark_stale()

    def invalidate(self) -> None:
        """Write into MuJoCo's arrays, which are new."""
        self.rows.invalidate()
        data = self._world.live_data
        arrays = self._arrays = spec_elements.Arrays(self._world.live_model, data)
        for constraint in self._by_id.values():
            constraint.ends, constraint.tuned = None, 0.0
            if constraint.element is None:
                continue
            if constraint.has_frames:
                arrays.write(constraint)
            else:
                arrays.switch(constraint.element.id, on=True)
        self._write_inactive(data.eq_active)

    def restore_active(self, active: np.ndarray, since: int) -> None:
        """Correct (neq,) which constraints were active at an earlier moment by those that came and went.

        Args:
            active: MuJoCo's array.
            since: first id of the constraints that came since.
        """
        for constraint in self._by_id.values():
            if constraint.id >= since and constraint.element is not None:
                active[constraint.element.id] = True
        self._write_inactive(active)

    def _write_inactive(self, active: np.ndarray) -> None:
        for found in self._inactive.values():
            for element, _, _ in found:
                active[element.id] = False

    @property
    def next_id(self) -> int:
        """The id that the next constraint gets."""
        return self._next
