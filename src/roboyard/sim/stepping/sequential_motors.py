"""Robots with motors solved row by row, as Bullet solves them.

An impulse solver improves all impulses in turn and stops after a number of rounds. Where joints act on each
other strongly, as the first and third of an arm, or motors are at their largest force, it has not arrived at
the solution by then: with PyBullet, arms under `POSITION_CONTROL` and cars move by what the rounds leave
over, and so do bodies in a pile. Where soft bodies touch something, only robots with motors or constraints
and what touches them are solved that way and all else is left to MuJoCo, as are worlds with equalities of
files.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from roboyard._lazy import lazy_module
from roboyard.sim.actuation.velocity_motors import VelocityMotors
from roboyard.sim.body import Body
from roboyard.sim.engine import Engine
from roboyard.sim.stepping.constraints import Constraints
from roboyard.sim.stepping.impulses import records as r
from roboyard.sim.stepping.impulses.lanes import HEAD, PLACES
from roboyard.sim.stepping.manifolds import Manifolds
from roboyard.sim.stepping.step_rows import ALL, StepRows
from roboyard.sim.stepping.surfaces import Surfaces

handing_over = lazy_module("roboyard.sim.stepping.impulses.handing_over")
order = lazy_module("roboyard.sim.stepping.impulses.order")
solving = lazy_module("roboyard.sim.stepping.impulses.solving")

LIMIT, MOTOR, EQUALITY = range(3)
_LINE = 64
"""Bytes of a line of the processor's cache."""


class SequentialMotors:
    """The solver of the robots with motors of one world."""

    def __init__(
        self,
        world: Engine[Body],
        motors: VelocityMotors,
        surfaces: Surfaces,
        manifolds: Manifolds,
        constraints: Constraints,
    ) -> None:
        self._world, self._motors, self._surfaces = world, motors, surfaces
        self._manifolds, self._constraints = manifolds, constraints
        self._rounds: int = world.profile.motor_rounds
        self._residual: float = world.profile.motor_residual
        self._largest: np.ndarray | None = None
        self._mechanism: r.Mechanism | None = None
        self._state: Any = None
        self._surface: Any = None
        self._solver = _solver(0, 0, 0, 0, 0, 0)
        self._width = 0
        """Most degrees of freedom that a row moves."""
        self._bundle: Any = None
        """All of these as one argument of compiled loops; None where one is another now."""
        self._known: tuple[Any, ...] = ()
        """Revision, time step and profile whose rules are written."""

    def set_rounds(self, rounds: int, residual: float) -> None:
        """Set when the solver ends.

        Args:
            rounds: rounds in a step; 0 leaves all trees to MuJoCo.
            residual: square of the change of velocity (rad/s or m/s) below which the rounds end.
        """
        self._rounds, self._residual = rounds, residual
        self.refresh()

    def bound_velocities(self, largest: np.ndarray | None) -> None:
        """Set the (nv,) bounds on velocities (rad/s or m/s) after a step; None for none."""
        self._largest = largest
        self.refresh()

    def refresh(self) -> None:
        """Note that a rule was changed."""
        self._known = ()

    def invalidate(self) -> None:
        """Note that MuJoCo's arrays are new, or that bodies were added or removed."""
        self._mechanism = None
        self._known = ()

    def prepare(self, model: Any, data: Any, timestep: float) -> None:
        """Look up arrays and rules that have changed, before a step."""
        world, known = self._world, self._known
        if (
            not known
            or known[0] != world.revision
            or known[1] != timestep
            or known[2] is not world.profile
            or known[3] is not self._motors.arrays
        ):
            self._look_up(model, data, timestep)

    def arrange(self, found: StepRows) -> bool:
        """List the rows of robots with motors, and of what touches them, after MuJoCo has made the rows.

        Returns:
            Whether these are all rows, so that MuJoCo's solver has nothing left to do.
        """
        return self.execute(found, r.ARRANGE, r.ARRANGE) == r.DONE

    def finish(self, found: StepRows, *, remade: bool = False) -> None:
        """Compute accelerations and forces after `arrange`, where its rows are all.

        Args:
            found: the contacts and rows.
            remade: whether the rows were made again, without their velocities.
        """
        self.execute(found, r.ASK, r.SOLVE, remade=1 if remade else 0)

    def solve(self, found: StepRows) -> None:
        """Solve the rows that are arranged, after `mj_fwdAcceleration`.

        The solution is written where these are all rows; `write` does it otherwise, after MuJoCo's solver.
        """
        if self._solver.ends.item(5) >= 0:
            self.execute(found, r.SOLVE, r.SOLVE)

    def hand_over(self, found: StepRows) -> None:
        """Write what rows ask for into MuJoCo's, for its solver, and what forces alone lead to.

        The rows must be in MuJoCo's block.
        """
        handing_over().hand_over(self._bundle_of(found))

    def correct_slides(self, found: StepRows, acceleration: np.ndarray, timestep: float) -> float:
        """Remove the lift of sliding contacts after MuJoCo's solver; return the largest change (m/s).

        Args:
            found: the contacts and rows, whose references are changed.
            acceleration: (nefc,) of rows, m/s² or rad/s².
            timestep: duration of the step (s).
        """
        return handing_over().correct_slides(
            found.rows, found.contacts, found.search, self._surface, acceleration, timestep
        )

    def execute(self, found: StepRows, first: int, last: int, remade: int = 0) -> int:
        """Execute parts of a step in the compiled loop of that name; return what it returns.

        Args:
            found: the contacts and rows.
            first: part to begin with.
            last: part to end with.
            remade: 1 where rows were made again, without their velocities.
        """
        while True:
            answer = order().execute(self._bundle_of(found), first, last, remade)
            if answer == r.ROOM:
                counts = found.look()
                self._grow(counts[0], counts[ALL])
            elif answer == r.LOST:
                found.leave_memory()
            else:
                return answer

    def _bundle_of(self, found: StepRows) -> Any:
        """Return all arrays of a step as one argument of compiled loops."""
        if not found.is_direct:
            found.look()
            self._bundle = None
        bundle = self._bundle
        if (
            bundle is None
            or bundle.records[2] is not found.search
            or bundle.records[5] is not self._manifolds.points
        ):
            bundle = self._bundle = r.EVERYTHING.of(
                *(found.rows, found.contacts, found.search, self._mechanism, self._state),
                *(self._manifolds.points, self._surface, self._solver),
            )
        return bundle

    def write(self, found: StepRows, timestep: float) -> None:
        """Write the solution over MuJoCo's, after its solver, which had other rows."""
        solver, mechanism, state = self._solver, self._mechanism, self._state
        if mechanism is None or solver.ends.item(5) < 0:
            return
        start, count = found.rows.starts[9], found.counts[ALL]
        solving().write_solution(
            *(solver.order, solver.spans, solver.goals, solver.ends, solver.jacobian, solver.change),
            *(state.smooth, solver.taken, mechanism.dof_tree, timestep),
            *(state.qacc, found.rows.force[start : start + count], state.constraint),
        )

    # ----------------------------------------------------------------------------------------- book-keeping

    def _grow(self, contacts: int, rows: int) -> None:
        self._manifolds.grow(contacts)
        solver = self._solver
        if rows > len(solver.order):
            lengths = (len(a) for a in (self._state.qvel, solver.wrenches, solver.taken, solver.places))
            keeps = {name: getattr(solver, name) for name in ("motors", "targets", "largest", "rules")}
            self._solver = _solver(2 * rows, *lengths, entries=self._width)._replace(**keeps)
            self._manifolds.points.notes[r.SORTED] = 0  # its groups are not known
        self._surface = self._surface._replace(base=self._surfaces.normal_references(len(self._solver.order)))
        self._bundle = None

    def _look_up(self, model: Any, data: Any, timestep: float) -> None:
        world, motors = self._world, self._motors.arrays
        self._bundle = None
        if self._mechanism is None:
            trees = self._constraints.trees(model)
            self._mechanism, places = _mechanism(model, list(world.body_by_id.values()), *trees)
            self._state = _state(data)
            rows = max(len(self._solver.order), 16)
            self._width = min(model.nv, 2 * int(max(model.tree_dofnum, default=0)))
            self._solver = _solver(rows, model.nv, model.nbody, model.ntree, places, self._width)
            self._manifolds.points.notes[r.SORTED] = 0  # its groups are not known
        bound, share = self._constraints.bounds_and_shares(model)
        self._mechanism = self._mechanism._replace(equality_bound=bound, equality_share=share)
        profile, surfaces, solver = world.profile, self._surfaces, self._solver
        self._surface = surfaces.record(model, data, len(solver.order))
        largest = np.full(model.nv, np.inf) if self._largest is None else self._largest
        self._solver = solver._replace(motors=motors[0], targets=motors[1], largest=largest)
        rules = solver.rules
        rules[r.TIMESTEP], rules[r.ERP], rules[r.CONTACT_ERP] = timestep, profile.erp, profile.contact_erp
        rules[r.DEEP], rules[r.SLOW], rules[r.RESIDUAL] = profile.deep, profile.slow, self._residual
        rules[r.ROUNDS] = self._rounds
        rules[r.IS_PRODUCT], rules[r.IS_COMPLIANT] = profile.product_friction, surfaces.are_compliant
        rules[r.LIMITS_ARE_HARD], rules[r.CONTACTS_ARE_HARD] = profile.hard_contacts, world.hard_contacts
        rules[r.KEEPS_POINTS], rules[r.SEEN] = self._manifolds.keeps, 2 * profile.contact_margin
        rules[r.IS_BOUNDED], rules[r.SLOP] = self._largest is not None, profile.contact_slop
        self._known = world.revision, timestep, profile, motors


def _mechanism(
    model: Any,
    bodies: list[Body],
    equality_tree: np.ndarray,
    equality_aux: np.ndarray,
    equality_site: np.ndarray,
) -> tuple[r.Mechanism, int]:
    """Return the arrays of a model, and the number of places in the order of solution."""
    nv = model.nv
    slot, limit_slot = np.full(nv, -1, np.int32), np.full(nv, -1, np.int32)
    equality_slot = np.full(model.neq, -1, np.int32)
    places = 0
    for index, kind in solution_order(bodies, model, equality_tree):
        if kind == EQUALITY:
            equality_slot[index] = places
            places += r.EQUALITY_ROWS
        elif kind == LIMIT:
            limit_slot[index] = places
            places += 2
        else:
            slot[index] = places
            places += 1
    return (
        r.Mechanism(
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
            body_parent=model.body_parentid,
            body_root=model.body_rootid,
            body_dof=model.body_dofadr,
            body_dofs=model.body_dofnum,
            mass=model.body_mass,
            inertia=model.body_inertia,
            tree_dof=model.tree_dofadr,
            tree_dofs=model.tree_dofnum,
            factor_count=model.M_rownnz,
            factor_start=model.M_rowadr,
            factor_column=model.M_colind,
            slot=slot,
            limit_slot=limit_slot,
            equality_slot=equality_slot,
            equality_tree=np.where(equality_slot[:, None] >= 0, equality_tree, -2).astype(np.int32),
            equality_aux=equality_aux,
            equality_site=equality_site,
            site_body=model.site_bodyid,
            equality_bound=np.zeros((model.neq, 2)),
            equality_share=np.zeros(model.neq),
        ),
        places,
    )


def _state(data: Any) -> r.State:
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
        site_xmat=data.site_xmat,
    )


def _solver(rows: int, nv: int, bodies: int, trees: int, places: int, entries: int) -> r.Solver:
    """Return the arrays for so many rows of constraints with so many entries each."""
    dense = min(rows, r.DENSE)
    width = dense + -dense % r.BLOCK
    wide = entries + 2 * r.BLOCK  # of both trees, rounded up to whole blocks
    return r.Solver(
        motors=np.zeros((nv, 5)),
        targets=np.zeros((nv, 4)),
        largest=np.zeros(nv),
        rules=np.zeros(r.RULES),
        taken=np.zeros(trees, np.uint8),
        groups=np.zeros(trees, np.int32),
        places=np.full(places, -1, np.int32),
        parts=np.zeros((trees + 1, 10), np.int32),
        ends=np.full(6, -1, np.int32),
        order=np.zeros((rows, 4), np.int32),
        spans=np.zeros((rows, 4), np.int32),
        jacobian=np.zeros((rows, entries)),
        response=np.zeros((rows, entries)),
        goals=np.zeros((rows, 5)),
        mu=np.zeros(rows),
        soft=np.zeros(rows),
        diagonal=np.zeros(trees, np.uint8),
        slots=np.zeros(trees, np.int32),
        places_of_rows=np.zeros((rows, PLACES), np.int32),
        lanes=_aligned(1, rows * (HEAD + 2 * wide))[0],
        velocities=_aligned(1, nv + r.BLOCK * trees)[0],
        across=_aligned(nv, width),
        influence=_aligned(dense, width),
        lines=_aligned(r.LINES, width),
        change=np.zeros(nv),
        wrenches=np.zeros((bodies, 6)),
    )


def _aligned(rows: int, width: int) -> np.ndarray:
    """Return zeros (rows, width) of which no block of eight is in two lines of the processor's cache."""
    memory = np.zeros(rows * width + _LINE // 8)
    start = -memory.ctypes.data % _LINE // 8
    return memory[start : start + rows * width].reshape(rows, width)


def solution_order(bodies: list[Body], model: Any, equality_tree: np.ndarray) -> list[tuple[int, int]]:
    """Return joint limits, motors and equalities in Bullet's order: (dof or equality, kind).

    Each body has its limits when it is loaded and its motors then, joint by joint, constraints follow; Bullet
    sorts them by groups of bodies that constraints connect, with a quicksort that leaves equals in another
    order than it finds them.

    Args:
        bodies: in the order in which they were loaded.
        model: MjModel.
        equality_tree: (neq, 2) trees, -1 for none, -2 for equalities that MuJoCo solves.
    """
    body_of = {
        tree: key for key, body in enumerate(bodies) for tree in model.body_treeid[body.mujoco_ids].tolist()
    }
    body_of.pop(-1, None)
    group = list(range(len(bodies)))
    members: list[tuple[int, int]] = []
    for equality, (a, b) in enumerate(equality_tree.tolist()):
        ends = [body_of[tree] for tree in (a, b) if tree in body_of]
        if ends:
            members.append((ends[0], equality))
            old, new = group[ends[0]], group[ends[-1]]
            group = [new if key == old else key for key in group]
    items: list[tuple[int, int, int]] = []
    for place, body in enumerate(bodies):
        key = group[place]
        starts = [
            (int(body.dof_addresses[j.index]), j) for j in body.joints if body.dof_addresses[j.index] >= 0
        ]
        for dof, joint in starts:
            if joint.is_scalar and model.jnt_limited[model.dof_jntid[dof]]:
                items.append((key, dof, LIMIT))
        for _, joint in starts:
            size = joint.dof_slice
            items += [(key, d, MOTOR) for d in range(size.start, size.stop)]
    items += [(group[place], equality, EQUALITY) for place, equality in members]
    quicksort(items)
    return [(index, kind) for _, index, kind in items]


def quicksort(items: list[tuple[int, int, int]]) -> None:
    """Sort items by their first number in place, by Hoare's partition about the middle one."""
    ranges = [(0, len(items) - 1)] if len(items) > 1 else []
    while ranges:
        low, high = ranges.pop()
        pivot = items[(low + high) // 2][0]
        i, j = low, high
        while i <= j:
            while items[i][0] < pivot:
                i += 1
            while items[j][0] > pivot:
                j -= 1
            if i <= j:
                items[i], items[j] = items[j], items[i]
                i, j = i + 1, j - 1
        ranges += [(a, b) for a, b in ((low, j), (i, high)) if a < b]
