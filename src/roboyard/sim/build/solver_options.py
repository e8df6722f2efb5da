"""Solver options of a world, with their reasons."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

if TYPE_CHECKING:
    from roboyard._mujoco import mujoco
    from roboyard.sim.physics_profile import PhysicsProfile

Solver = Literal["auto", "newton", "cg"]

PILE_DOFS = 250
"""Degrees of freedom of free bases from which "auto" solves a world as a pile.

Newton factorises a matrix of all dofs in contact with one another, at a cost that grows with its square, and
needs two or three iterations; conjugate gradients cost a matrix product an iteration. Forty boxes in one heap
have 240. Joints do not count: a robot with 120 of them is one body among others, and where its limits and
drives act on light fingers, conjugate gradients end far from the solution.
"""
PILE_ITERATIONS = 50
"""Iterations of a pile; most steps at rest need fewer than ten with a warm start."""
PILE_SOLREF = (0.02, 1.0)
PILE_SOLIMP = (0.8, 0.9, 0.001, 0.5, 2.0)
"""Contacts of a pile are softer, or conjugate gradients do not converge in time and the remaining error
throws boxes about. A box at rest sinks in by under 1 mm, the lowest of a heap of 500 by 2 mm."""
CONTACT_SOLREF = (0.008, 1.0)
"""Time constant (s) and damping ratio with which penetration is corrected: critically, in two steps."""
CONTACT_SOLIMP = (0.95, 0.99, 0.001, 0.5, 2.0)
"""Nearly rigid: at rest a body sinks in by well under 0.1 mm."""
LIMIT_SOLIMP = (0.99, 0.9999, 0.001, 0.5, 2.0)
"""Of joint limits: more rigid than contacts. A limit gives way by (1 - d) F / (k m) under an effort F, with m
the inertia that moves: 0.02 rad for a wrist of 1e-4 kg m² that other limbs press, with the d of contacts."""


DENSE_DOFS = 1500
"""Degrees of freedom below which Newton works on dense matrices in a world with joints.

MuJoCo takes sparse ones from 60 on. Where limbs of a robot touch each other and the floor, MuJoCo 4.0's
sparse Newton may stop at forces of 20 to 1000 times the solution, on which its dense form, conjugate
gradients and Gauss-Seidel agree, and the robot flies apart. Dense matrices cost no time in a furnished flat,
whose objects sleep; 40 free boxes on each other would cost 1.8 times as much. Rows that are solved in turn
are sparse: a robot among 60 cubes takes three fifths of the time.
"""


FEW_DOFS = 7
"""Degrees of freedom up to which inertias are summed up one by one, as NumPy does, in less time."""
IMMOVABLE = 1e12
"""Inertia (kg m² or kg) from which on a joint is held for good."""
TOLERANCE = 1e-8
"""At which Newton ends."""
HARD_SOLIMP = (0.9999, 0.9999, 0.001, 0.5, 2.0)
"""Impedance of contacts on the velocity level: MuJoCo's largest. `hard_contacts` raises it further."""


def new_spec() -> mujoco.MjSpec:
    """Return an empty spec that keeps given masses and inertias."""
    from roboyard._mujoco import mujoco

    spec = mujoco.MjSpec()
    spec.compiler.degree = False
    spec.compiler.inertiafromgeom = mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_FALSE
    spec.compiler.boundmass = 0.0
    return spec


def apply_options(
    option: Any,
    *,
    timestep: float,
    gravity: tuple[float, float, float],
    dofs: int,
    free_dofs: int,
    has_joints: bool,
    has_soft_bodies: bool,
    solver: Solver,
    profile: PhysicsProfile,
) -> None:
    """Write a world's options into those of its spec before it compiles, or of its MjModel.

    The plain integrator is `implicitfast`, so that stiff drives and joint damping are stable at large
    steps; friction cones are elliptic (the exact ones), with ten times more friction impedance than normal
    impedance, so that grasped objects do not creep. Rigid contacts are mostly solved row by row, without
    MuJoCo's solver, and its search for groups of bodies that touch takes longer than it saves there; bodies
    that may sleep need it, and with soft bodies, of which each node is a body, it saves half of the time.
    """
    from roboyard._mujoco import mujoco

    option.timestep = timestep
    option.gravity = gravity
    flags = int(mujoco.mjtDisableBit.mjDSBL_AUTORESET)
    if profile.integrator == "euler":
        option.integrator = mujoco.mjtIntegrator.mjINT_EULER
        flags |= int(mujoco.mjtDisableBit.mjDSBL_EULERDAMP)
    else:
        option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    option.impratio = profile.impratio
    chosen = chosen_solver(solver, free_dofs, profile)
    may_sleep = option.enableflags & int(mujoco.mjtEnableBit.mjENBL_SLEEP)
    if profile.hard_contacts and chosen == "newton" and not may_sleep and not has_soft_bodies:
        flags |= int(mujoco.mjtDisableBit.mjDSBL_ISLAND)
    if not profile.parents_pass:
        flags |= int(mujoco.mjtDisableBit.mjDSBL_FILTERPARENT)
    option.disableflags = flags
    if chosen == "cg":
        option.solver = mujoco.mjtSolver.mjSOL_CG
        option.iterations = PILE_ITERATIONS
        option.tolerance = 1e-6
        option.impratio = 1.0
    else:
        option.solver = mujoco.mjtSolver.mjSOL_NEWTON
        option.iterations = 100
        option.tolerance = TOLERANCE
        kinds = mujoco.mjtJacobian
        in_turn = profile.motor_rounds > 0 and not has_soft_bodies
        is_dense = has_joints and dofs < DENSE_DOFS and not in_turn
        option.jacobian = kinds.mjJAC_DENSE if is_dense else kinds.mjJAC_AUTO


@cache
def _without_islands() -> int:
    from roboyard._mujoco import mujoco

    return int(mujoco.mjtDisableBit.mjDSBL_ISLAND)


def total_inertia(inertias: np.ndarray) -> float:
    """Return the sum of (n,) inertias of degrees of freedom (kg m² or kg), without those that nothing moves.

    Those would hide all others, in the sum and in what MuJoCo measures by it.
    """
    total = sum(inertias.tolist()) if len(inertias) <= FEW_DOFS else float(np.add.reduce(inertias))
    return total if total < IMMOVABLE else float(np.add.reduce(inertias[inertias < IMMOVABLE]))


def scale_tolerance(option: Any, share: float) -> None:
    """Let the solver end at the same place with inactive bodies as without them.

    Where MuJoCo looks for no groups of bodies that touch, it measures what an iteration improves by the
    inertia of all bodies.

    Args:
        option: of an MjModel, as `apply_options` has written them.
        share: of active bodies in the inertia of all.
    """
    if option.disableflags & _without_islands():
        option.tolerance = TOLERANCE * share


def chosen_solver(solver: Solver, free_dofs: int, profile: PhysicsProfile) -> Literal["newton", "cg"]:
    """Return the solver of a world whose free bases have so many degrees of freedom.

    Where rows are solved in turn, MuJoCo's solver has few left, however many bodies there are.
    """
    if solver != "auto":
        return solver
    if profile.hard_contacts and profile.motor_rounds > 0:
        return "newton"
    return "cg" if free_dofs >= PILE_DOFS else "newton"
