"""Constraints between links besides joints: welds, slides, points and gears, with force bounds.

In the spec that is compiled, the frames of welds, slides and points belong to the world; which link each is
on, and where, is written into MuJoCo's arrays, as are the joints of gears. So a constraint that is removed
becomes inactive, and the next one of its size takes its rows, both without a compile; a gear of three joints
is compiled. A spec that is read has all frames on their links.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from struct import Struct
from typing import Any, Literal

import numpy as np

from roboyard._arrays import ArrayLike
from roboyard._mujoco import mujoco
from roboyard._records import dataclass
from roboyard.errors import RoboyardError, StaleHandleError
from roboyard.sim.body import Body
from roboyard.sim.engine import Engine
from roboyard.sim.joint import Joint
from roboyard.sim.link import Link
from roboyard.sim.stepping.constraint_rows import HALF_ANGLE, bound_rows, free_axis
from roboyard.transforms import Array, normalized, to_wxyz

Kind = Literal["weld", "slide", "point", "gear"]
STIFF_SOLREF = (0.005, 1.0)
STIFF_SOLIMP = (0.99, 0.999, 0.001, 0.5, 2.0)
LARGEST_FORCE = 1e10
"""Largest force of a constraint without a bound (N or N m), where rows are solved in turn."""
_WELDED = ("weld", "slide")
MOST_INACTIVE = 8
"""Largest number of inactive constraints of each size that a compile keeps."""
_PACK_POSITION, _PACK_QUATERNION = Struct("3d").pack_into, Struct("4d").pack_into
_ROWS = {"weld": 6, "slide": 6, "point": 3, "gear": 1}
"""Number of rows of a constraint in MuJoCo's arrays."""
CORRECTION = 0.2
"""Share of a bounded constraint's error corrected in a step. It requests a velocity, so that a bound that is
too low to brake in time cannot make it oscillate."""


@dataclass(kw_only=True, slots=True, eq=False)
class Constraint:
    """One constraint. Frames are relative to link frames; without a second link, to the world."""

    id: int
    kind: Kind
    link_a: Link
    link_b: Link | None
    element: Any = None
    """Its equality in the spec; None before it is there."""
    site_a: Any = None
    site_b: Any = None
    is_in_place: bool = False
    """Whether the spec has its frames on their links."""
    position_a: ArrayLike | None = None
    """Position of the frame in the first link (m); None for a gear."""
    orientation_a: ArrayLike = (0.0, 0.0, 0.0, 1.0)
    position_b: ArrayLike = (0.0, 0.0, 0.0)
    """Position of the frame in the second link (m)."""
    orientation_b: ArrayLike = (0.0, 0.0, 0.0, 1.0)
    rows: tuple[int, int] = (-1, -1)
    """Rows of its frames in MuJoCo's arrays; -1 for a gear."""
    first_row: int = 0
    """Where its rows were in MuJoCo's arrays when they were last read."""
    max_force: float = np.inf
    """Force bound (N or N m) of each row: three for a point, six for a weld or slide, one for a gear."""
    gear_ratio: float = 0.0
    axis: Array | None = None
    """Unit axis (3,) of a slide, in the frame of link_a."""
    tendon: Any = None
    """The tendon of a gear with a third joint."""
    share: float = 1.0
    """Share of the profile's error reduction, where rows are solved in turn; 0 holds velocities alone."""

    @property
    def has_frames(self) -> bool:
        """Whether it is no gear."""
        return self.position_a is not None


Elements = tuple[Any, Any, Any]
"""The equality and the sites of a constraint in the spec."""


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
        self._geared: dict[str, tuple[int, int]] = {}
        """By name of a gear's element in the spec, the ids of the bodies whose joints it names."""
        self._positions: Any = None
        self._quaternions: Any = None
        """The memory of MuJoCo's positions and quaternions of sites."""
        self._edits = -1
        """Edits of the world so far, if they are the only ones since its compile; else -1."""
        self._bounds: np.ndarray | None = None
        self._tuned_timestep = 0.0

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
            constraint.kind == "slide" or np.isfinite(constraint.max_force)
            for constraint in self._by_id.values()
        )

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
        self._world.refresh_stepping()
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
        _check_finite("the ratio", ratio)
        _check_force(max_force)
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
        _stiffen(constraint.element)

    def _name_joints(self, element: Any, joints: Sequence[Joint]) -> None:
        """Write the names of a gear's joints into the spec."""
        element.name1, element.name2 = (joint._built.joint_elements[0].name for joint in joints)
        self._geared[element.name] = joints[0].body.id, joints[1].body.id

    def _reuse_gear(self, constraint: Constraint, joints: Sequence[Joint], max_force: float) -> None:
        """Let a new gear of two joints have the row of a removed one."""
        model, number = self._take_inactive(constraint, max_force)
        self._name_joints(constraint.element, joints)
        one, two = (joint._built.joint_elements[0].id for joint in joints)
        model.eq_obj1id[number], model.eq_obj2id[number] = one, two
        self._world.live_data.eq_active[number] = model.eq_active0[number] = True
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
            position_a=_position("position_a", position_a),
            orientation_a=_orientation(orientation_a),
            position_b=_position("position_b", position_b),
            orientation_b=_orientation(orientation_b),
        )
        _check_force(max_force)
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
        for found in inactive.values():
            for elements in found[MOST_INACTIVE:]:
                _delete(self._world.raw_spec, elements)
            del found[MOST_INACTIVE:]
            for element, _, _ in found:
                element.active = False

    def key(self) -> tuple[tuple[int, str], ...] | None:
        """Return ids and sizes of all constraints that the next compile has, also of those that other layers
        have not added yet; None with gears or inactive ones.
        """
        if self.before_entering is not None:
            self.before_entering()
        found = tuple((constraint.id, _size(constraint.kind)) for constraint in self._by_id.values())
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
            _delete(spec, (constraint.element, constraint.site_a, constraint.site_b))
        for constraint in moved:
            link_b = constraint.link_b
            parent_b = spec.worldbody if link_b is None else link_b._built.element
            self._add(constraint, constraint.link_a._built.element, parent_b)
            constraint.is_in_place = True
        for constraint in self._by_id.values():
            if constraint.has_frames:
                _place(constraint)
        if moved:
            world.mark_stale()

    def delete_inactive(self) -> None:
        """Delete what is inactive from the spec, before MuJoCo's arrays are read by others."""
        if not any(self._inactive.values()):
            return
        for found in self._inactive.values():
            for elements in found:
                _delete(self._world.raw_spec, elements)
            found.clear()
        self._world.mark_stale()

    def _enter(self, constraint: Constraint) -> None:
        found = self._inactive[_size(constraint.kind)]
        if found:
            constraint.element, constraint.site_a, constraint.site_b = found.pop()
            constraint.element.active = True
            return
        world_body = self._world.raw_spec.worldbody
        self._add(constraint, world_body, world_body)

    def _add(self, constraint: Constraint, parent_a: Any, parent_b: Any) -> None:
        """Add the elements of a constraint to the spec, with its frames on these bodies."""
        spec, name = self._world.raw_spec, f"constraint{constraint.id}"
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
        _stiffen(element)

    def _reuse(self, constraint: Constraint, max_force: float) -> bool:
        """Let a new constraint have the rows of a removed one; return whether there were any."""
        if not self._inactive[_size(constraint.kind)]:
            return False
        model, _ = self._take_inactive(constraint, max_force)
        self._write(constraint, model, self._world.live_data)
        self._changed()
        return True

    def _take_inactive(self, constraint: Constraint, max_force: float) -> tuple[Any, int]:
        """Give a new constraint the elements of a removed one; return MuJoCo's model and its row there."""
        world = self._world
        if self.before_reuse is not None:
            self.before_reuse()
        found = self._inactive[_size(constraint.kind)].pop()
        constraint.element, constraint.site_a, constraint.site_b = found
        constraint.element.active = True
        self._register(constraint, max_force)
        model, data, number = world.live_model, world.live_data, constraint.element.id
        model.eq_solref[number], model.eq_solimp[number] = STIFF_SOLREF, STIFF_SOLIMP
        ours = data.efc_id[: data.ne] == number
        data.efc_force[: data.ne][ours] = 0.0  # of the removed one
        return model, number

    def _changed(self) -> None:
        """Note that a constraint came or went without a compile."""
        self._bounds = None
        self._tuned_timestep = 0.0
        self._world.mark_moved()
        self._world.constraints_changed()

    def _write(self, constraint: Constraint, model: Any, data: Any) -> None:
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
        place = None if position is None else _position("a position", position)
        turn = None if orientation is None else _unit(orientation)
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
            _PACK_POSITION(self._positions, 24 * row, x, y, z)
        if turn is not None:
            i, j, k, w = turn
            _PACK_QUATERNION(self._quaternions, 32 * row, w, i, j, k)

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
        _check_finite("ratio and offset", (ratio, offset))
        constraint.gear_ratio = ratio
        data = np.zeros(len(constraint.element.data))
        data[:2] = offset, 0.0 if constraint.tendon is not None else -ratio
        constraint.element.data = data
        if self._world.takes_numbers():
            self._world.live_model.eq_data[constraint.element.id, :2] = data[:2]

    def set_max_force(self, constraint: Constraint, max_force: float) -> None:
        """Set the force bound of each row (N or N m).

        Raises:
            RoboyardError: it is not a number.
        """
        _check_force(max_force)
        if constraint.max_force == max_force:
            return
        constraint.max_force = max_force
        self._bounds = None
        self._tuned_timestep = 0.0
        self._world.refresh_stepping()

    def remove(self, constraint: Constraint) -> None:
        """Remove a constraint."""
        self.get(constraint.id)
        if constraint in self._new:
            self._drop_new(constraint)
            return
        world = self._world
        del self._by_id[constraint.id]
        self._bounds = None
        elements = constraint.element, constraint.site_a, constraint.site_b
        if constraint.tendon is None and not constraint.is_in_place:
            self._inactive[_size(constraint.kind)].append(elements)
            if world.takes_numbers():
                model, number = world.live_model, constraint.element.id
                world.live_data.eq_active[number] = model.eq_active0[number] = False
                self._changed()
            return
        self.enter_new()
        spec = world.raw_spec
        _delete(spec, elements)
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
        world.refresh_stepping()

    def forget(self, body_id: int) -> None:
        """Remove the constraints of a body that is removed."""
        for constraint in self.all:
            ends = (constraint.link_a, constraint.link_b)
            if any(link is not None and link.body.id == body_id for link in ends):
                self.remove(constraint)
        gears = self._inactive["gear"]
        ending = [elements for elements in gears if body_id in self._geared[elements[0].name]]
        for elements in ending:  # they name joints that end
            gears.remove(elements)
            _delete(self._world.raw_spec, elements)
        if ending:
            self._world.mark_stale()

    def invalidate(self) -> None:
        """Write into MuJoCo's arrays, which are new."""
        self._bounds = None
        self._tuned_timestep = 0.0
        model, data = self._world.live_model, self._world.live_data
        self._positions, self._quaternions = model.site_pos.data, model.site_quat.data
        for constraint in self._by_id.values():
            if constraint.has_frames and constraint.element is not None:
                self._write(constraint, model, data)
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

    # --------------------------------------------------------------------------------------------- in a step

    def applied(self, constraint: Constraint) -> Array:
        """Return the efforts of a constraint in the last step, in the world frame.

        Returns:
            (1,), (3,) or (6,) forces (N) and torques (N m).
        """
        return np.array(self.applied_numbers(constraint))

    def applied_numbers(self, constraint: Constraint) -> list[float]:
        """Return the numbers of `applied`."""
        world = self._world
        data, number, count = world.live_data, constraint.element.id, _ROWS[constraint.kind]
        owners, first = data.efc_id, constraint.first_row
        if (
            first + count > data.ne
            or owners.item(first) != number
            or (first and owners.item(first - 1) == number)
        ):
            equalities = owners[: data.ne].tolist()
            if number not in equalities:
                return []
            first = constraint.first_row = equalities.index(number)  # its rows are one after another
        forces: list[float] = data.efc_force[first : first + count].tolist()
        if constraint.kind in _WELDED:
            forces[3:] = [HALF_ANGLE * moment for moment in forces[3:]]
        return forces

    def prepare(self, model: Any) -> None:
        """Set the stiffness of bounded constraints, which depends on the time step, before a step."""
        timestep = model.opt.timestep
        if timestep == self._tuned_timestep:
            return
        self._tuned_timestep = timestep
        most = STIFF_SOLIMP[1]
        for constraint in self._by_id.values():
            if np.isfinite(constraint.max_force):
                pull = (-CORRECTION * most**2 / timestep**2, -most / timestep)
                model.eq_solref[constraint.element.id] = pull

    def write_trees(self, model: Any, trees: np.ndarray, aux: np.ndarray, places: np.ndarray) -> None:
        """Write what the solver of rows in turn needs to know of all equalities.

        Args:
            model: MjModel.
            trees: (neq, 2) kinematic trees, -1 for none, -2 for equalities that are not of these constraints.
            aux: (neq,) degree of freedom of a gear's third joint, -1 for none.
            places: (neq, 2) sites of the frames, -1 for none.
        """
        trees[:], aux[:], places[:] = -2, -1, -1
        owner_of, tree_of = model.site_bodyid.item, model.body_treeid.item
        for constraint in self._by_id.values():
            equality = constraint.element.id
            if constraint.tendon is not None:
                first = model.tendon_adr[constraint.tendon.id]
                dofs = model.jnt_dofadr[model.wrap_objid[first : first + 3]]
                aux[equality] = dofs[2]
                found = model.dof_treeid[dofs[:2]]
            elif constraint.kind == "gear":
                joints = model.eq_obj1id[equality], model.eq_obj2id[equality]
                found = model.dof_treeid[model.jnt_dofadr[list(joints)]]
            else:
                sites = constraint.rows
                found = tree_of(owner_of(sites[0])), tree_of(owner_of(sites[1]))
                places[equality] = sites
            trees[equality] = found

    @property
    def equalities(self) -> list[int]:
        """Rows of all constraints among MuJoCo's equalities, in the order in which they were added."""
        return [constraint.element.id for constraint in self._by_id.values()]

    def write_bounds(self, bounds: np.ndarray, shares: np.ndarray) -> None:
        """Write (neq, 2) bounds of rows, the last three of a weld's apart, and (neq,) shares.

        The bounds are in the rows' units, of which a weld's last are half angles.
        """
        bounds[:], shares[:] = LARGEST_FORCE, 1.0
        for constraint in self._by_id.values():
            force, equality = min(constraint.max_force, LARGEST_FORCE), constraint.element.id
            bounds[equality] = force, 2.0 * force
            shares[equality] = constraint.share

    def free_axes(self, model: Any, data: Any) -> None:
        """Free slides along their axes, between the halves of a step."""
        for constraint in self._by_id.values():
            if constraint.axis is not None:
                free_axis(
                    model,
                    data,
                    constraint.element.id,
                    constraint.site_a.id,
                    constraint.site_b.id,
                    constraint.axis,
                    follows=not self._world.hard_contacts,
                )

    def bound_forces(self, model: Any, data: Any) -> None:
        """Apply the force bounds of rows, after the solver."""
        bounds = self._bounds
        if bounds is None:
            bounds = self._bounds = np.full(model.neq, np.inf)
            for constraint in self._by_id.values():
                bounds[constraint.element.id] = constraint.max_force
        if data.ne:
            bound_rows(model, data, bounds[data.efc_id[: data.ne]])


def _check_finite(what: str, values: ArrayLike) -> None:
    # plain numbers are much faster than arrays
    if type(values) is tuple and len(values) == 3:
        x, y, z = values
        total = x + y + z
        if type(total) is float and total - total == 0.0:
            return
    if not all(map(math.isfinite, np.asarray(values, dtype=float).ravel().tolist())):
        raise RoboyardError(f"{what} of a constraint must be finite, got {values}")


def _position(what: str, values: ArrayLike) -> ArrayLike:
    """Return finite numbers (3,) that the caller does not change."""
    _check_finite(what, values)
    if type(values) is tuple and len(values) == 3:
        return values
    made = np.array(values, dtype=float)
    if made.shape != (3,):
        raise RoboyardError(f"{what} of a constraint must be three numbers, got {values}")
    return made


def _orientation(values: ArrayLike) -> ArrayLike:
    """Return a quaternion (4,) that the caller does not change; raise what `normalized` does."""
    if type(values) is tuple and len(values) == 4:
        x, y, z, w = values
        square = x * x + y * y + z * z + w * w
        if type(square) is float and 0.5 < square < 2.0:
            return values
    return normalized(np.array(values, dtype=float))


def _unit(values: ArrayLike) -> tuple[float, float, float, float]:
    """Return a quaternion (4,) of length 1."""
    if type(values) is tuple and len(values) == 4:
        x, y, z, w = values
        length = math.sqrt(x * x + y * y + z * z + w * w)
        if 0.5 < length < 2.0:
            return (x / length, y / length, z / length, w / length)
    i, j, k, r = normalized(values).tolist()
    return i, j, k, r


def _size(kind: Kind) -> str:
    """Return the kind of the constraints with as many rows."""
    return "weld" if kind == "slide" else kind


def _delete(spec: Any, elements: Elements) -> None:
    """Delete the elements of a constraint from the spec."""
    for element in elements:
        if element is not None:
            spec.delete(element)


def _place(constraint: Constraint) -> None:
    """Write the frames of a constraint into the spec."""
    a, b = constraint.site_a, constraint.site_b
    a.pos, a.quat = constraint.position_a, to_wxyz(normalized(constraint.orientation_a))
    b.pos, b.quat = constraint.position_b, to_wxyz(normalized(constraint.orientation_b))


def _stiffen(element: Any) -> None:
    element.solref = STIFF_SOLREF
    element.solimp = STIFF_SOLIMP


def _check_force(max_force: float) -> None:
    if max_force != max_force:
        raise RoboyardError("the largest force of a constraint must be a number, got nan; inf is no bound")
