"""The drive law: stiffness, damping and motor inertia of drives without given gains.

A drive applies kp (target - q) + kd (target velocity - v). The law sizes kp and kd by the inertia M that the
joint moves and by its effort limit E:

    stiffness      kp = min(max(M ω², min(E / e, M ω_s²)), E / e_s)
    damping        kd = max(2 √(kp M), 2 kp / ω_d)
    velocity       kd = min(max(M ω_v, c), E / (0.1 v_max))
    motor inertia  J = max(kp / ω_m² - M, 0)

- M ω² is the usual stiffness: every joint follows its target with the same natural frequency ω.
- E / e makes a joint that moves little (a finger, a wrist, a knee) use its full effort at an error of e; the
  time step bounds it (M ω_s²).
- E / e_s prevents saturation: a weak drive of a heavy part would swing from one effort limit to the other.
- The damping is critical at least.
- A velocity drive is at least as stiff as the joint's own resistance c (N m s/rad), or its integral would
  need seconds to overcome it.
- J is the inertia of a geared motor, which robot files rarely give. Without it joints chatter in
  contact: contacts are solved for the bare M, while the implicit step moves M + kd Δt, up to three times
  as much.

MuJoCo integrates kd implicitly, so the same gains mean the same at every time step. Gains that are constant
in all postures are too stiff in some; OmniGibson's kp = 1e7 and kd = 1e5 mean "as stiff as the solver can"
and depend on the time step.

The users of the law differ in constants only; each has a `DriveProfile`.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from roboyard._records import dataclass

SATURATED_SPEED = 0.1
"""Share of the velocity limit at which a velocity drive may reach its effort limit."""
NOMINAL_VELOCITY = 20.0
"""Velocity limits above this (rad/s or m/s) are a motor's without its gear, or "none": no loaded joint gets
near them, and a drive that saturated at a share of them would be too soft to follow."""
CARRIED_SHARE = 0.1
"""Inertia of the motor of a joint that carries the robot, as a share of the inertia it carries."""


@dataclass(frozen=True, kw_only=True, slots=True)
class DriveProfile:
    """Constants of the drive law for one kind of user."""

    frequency: float
    """Natural frequency ω (rad/s)."""
    stiffest_frequency: float
    """Bound ω_s (rad/s) on the natural frequency of light joints; keep it below 1 / time step."""
    motor_frequency: float
    """Natural frequency ω_m (rad/s) that sizes the motor inertia."""
    velocity_frequency: float = 2 * np.pi * 40.0
    """kd / M of a velocity drive, ω_v (rad/s)."""
    full_effort_turn: float = 0.15
    """Error e (rad) at which a light hinge uses its full effort."""
    full_effort_slide: float = 0.02
    """The same of a prismatic joint (m)."""
    saturated_turn: float | None = None
    """Least error e_s (rad) at which a hinge may use its full effort. None: no bound."""
    saturated_slide: float | None = None
    """The same of a prismatic joint (m)."""


JOINT = DriveProfile(
    frequency=2 * np.pi * 10.0, stiffest_frequency=2 * np.pi * 30.0, motor_frequency=2 * np.pi * 8.0
)
"""`Joint.drive_position` without gains. M is the inertia at the zero pose (MuJoCo's `dof_M0`). Every joint
gets its motor, half of what a shoulder moves and several times what a wrist does (0.1 kg m² in common robots,
close to manufacturers' data), so it is critically damped at ω_m."""

CONTROLLER = DriveProfile(
    frequency=2 * np.pi * 10.0,
    stiffest_frequency=2 * np.pi * 30.0,
    motor_frequency=2 * np.pi * 10.0,
    full_effort_turn=0.2,
    full_effort_slide=0.05,
    saturated_turn=0.03,
    saturated_slide=0.005,
)
"""Controllers of a `Robot`. M is the inertia that the joint moves in the present posture, all others held."""
GRIPPER_FREQUENCY = CONTROLLER.frequency / 4
"""ω_d (rad/s) of fingers: at full effort a light finger closes at the speed of a real one and does not bounce
off the grasped object."""


def effort_per_error(profile: DriveProfile, effort: Any, is_slide: Any) -> Any:
    """Return E / e (n,) in N m/rad or N/m; 0 where the effort limit is infinite.

    Args:
        profile: constants of the law.
        effort: (n,) effort limits (N m or N).
        is_slide: (n,) whether the joint is prismatic.
    """
    error = np.where(is_slide, profile.full_effort_slide, profile.full_effort_turn)
    return np.where(np.isfinite(effort), effort, 0.0) / error


def position_stiffness(
    profile: DriveProfile, inertia: Any, per_error: Any, is_slide: Any, *, light_inertia: Any = None
) -> Any:
    """Return kp (n,) of position drives (N m/rad or N/m); scalars give a scalar.

    Args:
        profile: constants of the law.
        inertia: (n,) inertia M that each joint moves (kg m² or kg).
        per_error: (n,) from `effort_per_error`.
        is_slide: (n,) whether the joint is prismatic.
        light_inertia: (n,) inertia in the bound M ω_s², where `inertia` includes more than the time step
            allows to rely on (a share of the whole robot).
    """
    light = inertia if light_inertia is None else light_inertia
    stiff = np.minimum(per_error, light * profile.stiffest_frequency**2)
    kp = np.maximum(inertia * profile.frequency**2, stiff)
    if profile.saturated_turn is None or profile.saturated_slide is None:
        return kp
    slide, turn = (
        profile.full_effort_slide / profile.saturated_slide,
        profile.full_effort_turn / profile.saturated_turn,
    )
    return np.minimum(kp, per_error * np.where(is_slide, slide, turn))


def position_damping(inertia: Any, kp: Any, frequency: Any = np.inf) -> Any:
    """Return kd (n,) of position drives (N m s/rad or N s/m), critical or more.

    Args:
        inertia: (n,) inertia that each joint moves (kg m² or kg).
        kp: (n,) stiffness (N m/rad or N/m).
        frequency: (n,) ω_d (rad/s): a drive at its effort limit approaches the target no faster than a
            critically damped joint of this natural frequency.
    """
    return np.maximum(2.0 * np.sqrt(kp * inertia), 2.0 * kp / frequency)


def velocity_damping(
    profile: DriveProfile,
    inertia: Any,
    *,
    resistance: Any = 0.0,
    effort: Any = np.inf,
    largest_velocity: Any = 1.0,
) -> Any:
    """Return kd (n,) of velocity drives (N m s/rad or N s/m).

    Args:
        profile: constants of the law.
        inertia: (n,) inertia that each joint moves (kg m² or kg).
        resistance: (n,) resistance c of the joint itself (N m s/rad or N s/m).
        effort: (n,) effort limits (N m or N).
        largest_velocity: (n,) velocity limits (rad/s or m/s).
    """
    kd = np.maximum(inertia * profile.velocity_frequency, resistance)
    return np.minimum(kd, effort / (SATURATED_SPEED * np.minimum(largest_velocity, NOMINAL_VELOCITY)))


def motor_inertia(profile: DriveProfile, stiffness: Any, inertia: Any = 0.0) -> Any:
    """Return the inertia (n,) that a geared motor adds at the joint (kg m² or kg): kp = (M + J) ω_m².

    With `stiffness` from `effort_per_error` and no `inertia` it depends on the effort limit alone. A finger
    of 60 g with a limit of 100 N has almost no inertia of its own and would chatter on what it grasps, and so
    would a leg on the floor. The joints of a trunk need it too: with all others fixed, joint 2 of R1 moves
    12 kg m², but only 0.1 kg m² when its neighbours are free, and drives sized by the first would throw the
    second from one effort limit to the other after any shock.

    Args:
        profile: constants of the law.
        stiffness: (n,) kp, or E / e (N m/rad or N/m).
        inertia: (n,) M (kg m² or kg).
    """
    return np.maximum(stiffness / profile.motor_frequency**2 - inertia, 0.0)


def carrying_motor_inertia(mass: float, lever: float) -> float:
    """Return the inertia (kg m²) that the geared motor of a wheel or knee adds, which carries `mass` (kg).

    It is a tenth of the inertia that the joint moves with the robot, m r² with r = `lever` (m), a wheel's
    radius. A bare wheel is so light beside its robot that contacts, whose softness follows the lighter side,
    would let it slip as on ice.
    """
    return CARRIED_SHARE * mass * lever**2
