"""The rules of a world's engine: MuJoCo's in a plain world, Bullet's for PyBullet scripts."""

from __future__ import annotations

from roboyard._records import dataclass


@dataclass(frozen=True, kw_only=True, slots=True)
class PhysicsProfile:
    """The rules of the engine.

    How a description is read (which inertia, which frames) is not among them.
    """

    integrator: str = "implicitfast"
    """"implicitfast": damping and drives implicit. "euler": semi-implicit Euler, joint damping explicit."""
    impratio: float = 10.0
    """Ratio of friction impedance to normal impedance."""
    product_friction: bool = False
    """Whether the friction of a pair is the product of its coefficients; otherwise the larger one."""
    hard_contacts: bool = False
    """Whether contacts constrain the velocity after the step, from a small gap on; otherwise soft springs."""
    contact_margin: float = 0.0
    """Contribution (m) of each shape, boxes excepted, to the gap at which a contact becomes active; the
    largest one where more is known of shapes."""
    contact_reach: float = float("inf")
    """Gap (m) from which on contacts do not push, where nothing else is known of a shape."""
    box_margin: float = 0.0
    """Contribution (m) of boxes to that gap."""
    erp: float = 0.2
    """Share of the error of a hard joint limit or constraint that is corrected in a step."""
    contact_erp: float = 0.2
    """Share of a penetration that a hard contact corrects in a step."""
    deep: float = 0.04
    """Distance (rad or m) beyond a limit from which a joint is stopped, but not moved back."""
    contact_slop: float = 0.0
    """Penetration (m) that hard contacts leave: bodies come to rest so deep."""
    slow: float = 0.05
    """Closing speed (m/s) below which contacts do not bounce."""
    largest_velocity: float | None = None
    """Bound on every joint and base velocity component (rad/s or m/s)."""
    motor_rounds: int = 0
    """Rounds in which the rows of robots with motors are solved in turn; 0: MuJoCo solves all together."""
    motor_residual: float = 0.0
    """Square of the change of velocity (rad/s or m/s) in a round below which the rounds end."""
    pid_drives: bool = True
    """Whether joints have PID actuators (`Joint.drive_position` and its siblings)."""
    joint_friction: bool = True
    """Whether the joint friction of descriptions acts."""
    parents_pass: bool = True
    """Whether rigid parts pass through those they hang on by a joint; otherwise only excluded pairs do."""
    angular_impedance: float = 0.9999
    """Impedance of motors, joint limits and hard contacts, below 1."""

    hull_steps: int = 0
    """Number of steps over the extent of a convex hull to which its corners are rounded; 0: not rounded."""
    keeps_textures: bool = False
    """Whether the texture of a mesh file is multiplied by the description's colour instead of replaced."""

    @property
    def needs_halves(self) -> bool:
        """Whether each step is split into two halves with Roboyard's rules between."""
        return self.product_friction or self.hard_contacts or self.largest_velocity is not None


PLAIN = PhysicsProfile()

BULLET = PhysicsProfile(
    integrator="euler",
    impratio=1.0,
    product_friction=True,
    hard_contacts=True,
    contact_margin=0.02,
    contact_reach=0.004,
    box_margin=5e-4,
    erp=0.2,
    contact_erp=0.08,
    contact_slop=1e-5,
    slow=0.2,
    largest_velocity=100.0,
    motor_rounds=50,
    motor_residual=1e-7,
    pid_drives=False,
    joint_friction=False,
    parents_pass=False,
    hull_steps=10216,
    keeps_textures=True,
)
"""Bullet's multibody world: friction by product, contacts on the velocity level with a look-ahead of 4 mm,
velocities bounded at 100, explicit joint damping. Inertia from shapes and mass 1 without inertial are edits
of the description, and the drag of 0.04 is set link by link; `roboyard.pybullet` does both.
"""
