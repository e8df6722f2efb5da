"""Rules of a world as a whole: MuJoCo's in a plain world, Bullet's habits under PyBullet scripts."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True, slots=True)
class PhysicsProfile:
    """What a world takes for granted.

    Everything here is a rule of the engine; what a description means (which inertia, which frames) is not.
    """

    integrator: str = "implicitfast"
    """"implicitfast": damping and drives implicit. "euler": semi-implicit Euler, joint damping explicit."""
    impratio: float = 10.0
    """Friction impedance over normal impedance."""
    product_friction: bool = False
    """Friction of a pair is the product of its coefficients; else the larger one."""
    hard_contacts: bool = False
    """Contacts are constraints on the velocity after the step, from a small gap on; else soft springs."""
    contact_margin: float = 0.0
    """m: each shape's share of the gap from which a contact is a constraint."""
    erp: float = 0.2
    """Share of an overlap that a hard contact undoes in a step."""
    deep: float = 0.04
    """rad or m: a joint that is farther beyond its limit is held there, not brought back."""
    slow: float = 0.05
    """m/s: contacts that close more slowly do not bounce."""
    largest_velocity: float | None = None
    """Bound on every joint and base velocity component; rad/s or m/s."""
    pid_drives: bool = True
    """Joints have pid actuators (`Joint.drive_position` and its siblings)."""
    joint_friction: bool = True
    """Joint friction of the description acts."""
    angular_impedance: float = 0.9999
    """How rigid motors, joint limits and hard contacts are, below 1."""

    keeps_textures: bool = False
    """The picture of a mesh file shows through the description's colour; else the colour takes its place."""

    @property
    def needs_halves(self) -> bool:
        """Whether each step is taken in two halves with Roboyard's rules between."""
        return self.product_friction or self.hard_contacts or self.largest_velocity is not None


PLAIN = PhysicsProfile()

BULLET = PhysicsProfile(
    integrator="euler",
    impratio=1.0,
    product_friction=True,
    hard_contacts=True,
    contact_margin=0.002,
    erp=0.2,
    slow=0.2,
    largest_velocity=100.0,
    pid_drives=False,
    joint_friction=False,
    keeps_textures=True,
)
"""Bullet's multibody world: friction by product, contacts on the velocity level with a look-ahead of 4 mm,
velocities bounded at 100, joint damping explicit. Inertia from shapes and mass 1 without inertial are edits
of the description, and each link's drag of 0.04 is set link by link; the PyBullet face does both.
"""
