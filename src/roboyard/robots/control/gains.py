"""Gains of the drives where nobody gives any: from what each joint moves now, and what it can exert.

    position   kp = min(max(M ω², E / e), M ω_s², E / e_s),  kd = max(2 √(kp M), 2 kp / ω_d)
    velocity   kd = min(max(M ω_v, c), E / (0.1 v_max)),  c = d + f / (0.1 v_max)

M is the inertia that the joint sees in the present posture (all other joints held), E its effort limit; ω =
2π · 10 Hz, ω_s = 2π · 30 Hz, ω_v = 2π · 40 Hz, e = 0.2 rad or 0.05 m, e_s = 0.03 rad or 0.005 m. The second
term gives a joint that moves little (a finger, a wrist) a firm grip: full effort at an error of e. ω_d is
ω, and ω / 4 for grippers: a light finger under full effort closes at the speed of a real one and does not
bounce off what it grasps. A velocity drive is at least as firm as the joint's own damping d and dry
friction f, or its integral would take seconds to prevail over them. The last terms keep weak drives of
heavy parts out of saturation, where they would swing from one effort limit to the other.

Drives integrate kd implicitly, so these mean the same at every time step. Gains taken once for all postures
are too stiff in some: they saturate at small speeds and chatter there. (OmniGibson's kp = 1e7, kd = 1e5
mean "as stiff as the solver can" and depend on the time step.)
"""

from __future__ import annotations

import numpy as np

from roboyard.transforms import Array

NATURAL_FREQUENCY = 2 * np.pi * 10.0
STIFFEST_FREQUENCY = 2 * np.pi * 30.0
VELOCITY_FREQUENCY = 2 * np.pi * 40.0
GRIPPER_FREQUENCY = NATURAL_FREQUENCY / 4
"""rad/s. Below 1 over the time step, so that a saturated drive does not swing from one limit to the other."""
FULL_EFFORT_TURN, FULL_EFFORT_SLIDE = 0.2, 0.05
"""e; rad and m"""
SATURATED_TURN, SATURATED_SLIDE = 0.03, 0.005
"""e_s; rad and m"""
WHEEL_SHARE = 0.1
"""Of the mass that a wheel carries, as its motor's inertia."""
SATURATED_SPEED = 0.1
"""Share of the velocity limit."""


def effort_per_error(effort: Array, is_slide: np.ndarray) -> Array:
    """(n,) E / e of joints with these effort limits."""
    return np.where(np.isfinite(effort), effort, 0.0) / np.where(
        is_slide, FULL_EFFORT_SLIDE, FULL_EFFORT_TURN
    )


def position_gain(inertia: Array, firm: Array, is_slide: np.ndarray) -> Array:
    """(n,) kp in N m/rad or N/m, for joints that see this inertia; `firm` as `effort_per_error` gives it."""
    saturated = firm * np.where(
        is_slide, FULL_EFFORT_SLIDE / SATURATED_SLIDE, FULL_EFFORT_TURN / SATURATED_TURN
    )
    stiffest = np.minimum(inertia * STIFFEST_FREQUENCY**2, saturated)
    return np.minimum(np.maximum(inertia * NATURAL_FREQUENCY**2, firm), stiffest)


def position_damping(inertia: Array, kp: Array, frequency: Array) -> Array:
    """(n,) kd in N m s/rad or N s/m: critical or more; `frequency` is ω_d in rad/s."""
    return np.maximum(2.0 * np.sqrt(kp * inertia), 2.0 * kp / frequency)


def velocity_gain(inertia: Array, effort: Array, fastest: Array, resistance: Array) -> Array:
    """(n,) kd in N m s/rad or N s/m, for joints driven by velocity that resist by c per speed."""
    firm = np.maximum(inertia * VELOCITY_FREQUENCY, resistance)
    return np.minimum(firm, effort / (SATURATED_SPEED * fastest))


def motor_inertia(firm: Array) -> Array:
    """(n,) kg m² or kg: what a geared motor of this effort adds at the joint, so that M ω² = E / e.

    Without it a finger of 60 g under 100 N has no inertia to speak of, and chatters on what it holds; so does
    a leg on the floor. Nor have the joints of a trunk that carries much: all others held, joint 2 of R1 moves
    12 kg m², but against the free motion of its neighbours it has 0.1 kg m², and drives sized by the first
    would throw the second from one effort limit to the other after any shock.
    """
    return firm / NATURAL_FREQUENCY**2


def wheel_inertia(mass: float, radius: float) -> float:
    """Kg m²: what a geared motor adds to one of two wheels that carry a robot of this mass (kg); I = 0.1 m r²
    / 2.

    A tenth of what the wheel moves anyway. A bare wheel weighs so little beside its robot that contacts,
    whose softness goes by the lighter side, would let it slip as on ice.
    """
    return WHEEL_SHARE * mass * radius**2 / 2
