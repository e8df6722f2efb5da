"""Constraints that no joint of a tree makes: welds, ball joints and gears, each with a force bound."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

import mujoco
import numpy as np
from numpy.typing import ArrayLike

from roboyard.errors import RoboyardError, StaleHandleError
from roboyard.poses import Array, normalized, to_wxyz

if TYPE_CHECKING:
    from roboyard.sim.joint import Joint
    from roboyard.sim.link import Link
    from roboyard.sim.world import World

Kind = Literal["weld", "point", "gear"]
STIFF_SOLREF = (0.005, 1.0)
STIFF_SOLIMP = (0.99, 0.999, 0.001, 0.5, 2.0)
FORCE_ITERATIONS = 3


@dataclass(kw_only=True, slots=True, eq=False)
class Constraint:
    """One constraint of a world. Frames are relative to link frames; without a second link, to the world."""

    id: int
    kind: Kind
    link_a: Link
    link_b: Link | None
    element: Any
    site_a: Any = None
    site_b: Any = None
    max_force: float = np.inf
    """N or N m, on each row: three for a point, six for a weld, one for a gear."""
    gear_ratio: float = 0.0


class Constraints:
    """The constraints of one world."""

    def __init__(self, world: World) -> None:
        self._world = world
        self._by_id: dict[int, Constraint] = {}
        self._next = 1
        self._bounds: np.ndarray | None = None

    def __len__(self) -> int:
        return len(self._by_id)

    @property
    def is_bounded(self) -> bool:
        """Whether any constraint has a force bound that steps have to watch."""
        return any(np.isfinite(constraint.max_force) for constraint in self._by_id.values())

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
        """Hold a frame of one link on a frame of another (or of the world)."""
        kind = mujoco.mjtEq.mjEQ_WELD
        return self._between(
            "weld", kind, link_a, link_b, position_a, orientation_a, position_b, orientation_b, max_force
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
        """Hold a point of one link on a point of another (or of the world); both turn freely."""
        kind, none = mujoco.mjtEq.mjEQ_CONNECT, (0, 0, 0, 1)
        return self._between("point", kind, link_a, link_b, position_a, none, position_b, none, max_force)

    def add_gear(
        self, joint_a: Joint, joint_b: Joint, ratio: float, *, max_force: float = np.inf
    ) -> Constraint:
        """Couple two joints of one degree of freedom from here on: v_a + ratio v_b = 0."""
        for joint in (joint_a, joint_b):
            if not joint.is_scalar:
                raise RoboyardError(f"joint {joint.name!r} is {joint.type}; gears couple hinges and slides")
        element = self._world.spec.add_equality(
            name=f"constraint{self._next}",
            type=mujoco.mjtEq.mjEQ_JOINT,
            objtype=mujoco.mjtObj.mjOBJ_JOINT,
            name1=joint_a._built.joint_elements[0].name,
            name2=joint_b._built.joint_elements[0].name,
        )
        constraint = Constraint(
            id=self._next, kind="gear", link_a=joint_a.child, link_b=joint_b.child, element=element
        )
        self._register(constraint, max_force)
        self.set_gear(constraint, ratio, joint_a.position + ratio * joint_b.position)
        return constraint

    def _between(
        self,
        kind: Kind,
        equality: Any,
        link_a: Link,
        link_b: Link | None,
        position_a: ArrayLike,
        orientation_a: ArrayLike,
        position_b: ArrayLike,
        orientation_b: ArrayLike,
        max_force: float,
    ) -> Constraint:
        world = self._world
        name = f"constraint{self._next}"
        parent_b = world.spec.worldbody if link_b is None else link_b._built.element
        site_a = link_a._built.element.add_site(
            name=f"{name}/a", pos=position_a, quat=to_wxyz(normalized(orientation_a)), group=5
        )
        site_b = parent_b.add_site(
            name=f"{name}/b", pos=position_b, quat=to_wxyz(normalized(orientation_b)), group=5
        )
        element = world.spec.add_equality(
            name=name,
            type=equality,
            objtype=mujoco.mjtObj.mjOBJ_SITE,
            name1=site_a.name,
            name2=site_b.name,
        )
        if kind == "weld":
            data = np.array(element.data)
            data[10] = 1.0
            element.data = data
        constraint = Constraint(
            id=self._next,
            kind=kind,
            link_a=link_a,
            link_b=link_b,
            element=element,
            site_a=site_a,
            site_b=site_b,
        )
        self._register(constraint, max_force)
        return constraint

    def _register(self, constraint: Constraint, max_force: float) -> None:
        constraint.element.solref = STIFF_SOLREF
        constraint.element.solimp = STIFF_SOLIMP
        constraint.max_force = max_force
        self._by_id[constraint.id] = constraint
        self._next += 1
        self._world.mark_stale()

    # --------------------------------------------------------------------------------------------- changing

    def get(self, constraint_id: int) -> Constraint:
        """The constraint of this id.

        Raises:
            StaleHandleError: it was removed, or never was.
        """
        if constraint_id not in self._by_id:
            raise StaleHandleError(f"there is no constraint {constraint_id}; it may have been removed")
        return self._by_id[constraint_id]

    @property
    def all(self) -> tuple[Constraint, ...]:
        return tuple(self._by_id.values())

    def set_frame(
        self,
        constraint: Constraint,
        side: Literal["a", "b"],
        position: ArrayLike | None = None,
        orientation: ArrayLike | None = None,
    ) -> None:
        """Move one side's frame; takes effect at the next step without a recompile."""
        site = constraint.site_a if side == "a" else constraint.site_b
        if site is None:
            raise RoboyardError("a gear has no frames")
        world = self._world
        if position is not None:
            site.pos = np.asarray(position, dtype=float)
        if orientation is not None:
            site.quat = to_wxyz(normalized(orientation))
        if not world.is_stale:
            world.model.site_pos[site.id] = site.pos
            world.model.site_quat[site.id] = site.quat
            world.model.site_sameframe[site.id] = 0

    def set_gear(self, constraint: Constraint, ratio: float, offset: float) -> None:
        """Couple positions as q_a = offset - ratio q_b."""
        constraint.gear_ratio = ratio
        data = np.zeros(len(constraint.element.data))
        data[:2] = offset, -ratio
        constraint.element.data = data
        if not self._world.is_stale:
            self._world.model.eq_data[constraint.element.id, :2] = data[:2]

    def set_max_force(self, constraint: Constraint, max_force: float) -> None:
        """N or N m, on each row."""
        constraint.max_force = max_force
        self._bounds = None
        self._world.stepping.refresh()

    def remove(self, constraint: Constraint) -> None:
        """Let go."""
        self.get(constraint.id)
        spec = self._world.spec
        spec.delete(constraint.element)
        for site in (constraint.site_a, constraint.site_b):
            if site is not None:
                spec.delete(site)
        del self._by_id[constraint.id]
        self._bounds = None
        self._world.mark_stale()

    def forget(self, body_id: int) -> None:
        """A body goes, and its constraints with it."""
        for constraint in self.all:
            ends = (constraint.link_a, constraint.link_b)
            if any(link is not None and link.body.id == body_id for link in ends):
                self.remove(constraint)

    def invalidate(self) -> None:
        """MuJoCo's arrays are new."""
        self._bounds = None

    # --------------------------------------------------------------------------------------------- in a step

    def applied(self, constraint: Constraint) -> Array:
        """(1,), (3,) or (6,) N and N m that the constraint applied in the last step, in world axes."""
        data = self._world.data
        rows = np.arange(data.ne)
        mine = data.efc_id[: data.ne] == constraint.element.id
        return np.asarray(data.efc_force)[rows[mine]].copy()

    def bound_forces(self, model: Any, data: Any) -> None:
        """After the solver: where a row exceeds its bound, ask for less and solve again.

        A row's force grows with the acceleration it asks for, by about one over the row's inverse inertia;
        a few repetitions bring it to the bound.
        """
        bounds = self._bounds
        if bounds is None:
            bounds = self._bounds = np.full(model.neq, np.inf)
            for constraint in self._by_id.values():
                bounds[constraint.element.id] = constraint.max_force
        ne = data.ne
        if ne == 0:
            return
        bound = bounds[data.efc_id[:ne]]
        impedance = data.efc_KBIP[:ne, 2]
        inverse = data.efc_R[:ne] * impedance / (1.0 - impedance)  # MuJoCo's estimate of J M^-1 J'
        acceleration = np.empty(data.nefc)
        for _ in range(FORCE_ITERATIONS):
            force = data.efc_force[:ne]
            excess = force - np.clip(force, -bound, bound)
            if not (np.abs(excess) > 1e-3 * bound).any():
                return
            mujoco.mj_mulJacVec(model, data, acceleration, data.qacc)
            over = excess != 0
            data.efc_aref[:ne][over] = (acceleration[:ne] - inverse * excess)[over]
            data.qacc_warmstart[:] = data.qacc
            mujoco.mj_fwdConstraint(model, data)
