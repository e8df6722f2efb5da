"""Motors of spherical joints, as in Bullet.

They aim at the velocity 0.2 kp e / dt + (1 - damping) v after a step, where e is roll, pitch and yaw of the
remaining rotation; Bullet ignores velocity targets, velocity gains and the largest velocity.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from roboyard.sim.joint import Joint
    from roboyard.sim.world import World

Vector = Sequence[float]
IDENTITY = (0.0, 0.0, 0.0, 1.0)
DEFAULT_GAIN = 0.2
"""kp of the default motors of spherical joints, whose target is the identity."""
ERP = 0.2
"""Share of an error that Bullet's constraints correct in a step."""


def set_spherical_target(
    world: World,
    joint: Joint,
    target: Vector,
    kp: float,
    impulse: Sequence[float],
    damping: float = 1.0,
) -> None:
    """Set the target of a spherical joint's motor.

    Args:
        world: world of the joint.
        joint: spherical joint.
        target: orientation (x, y, z, w).
        kp: position gain.
        impulse: (3,) largest impulses in a step (N m s).
        damping: share of the velocity removed in a step.
    """
    world.motors.set(
        joint, position=target, velocity=0.0, kp=ERP * kp, kd=damping, max_impulse=impulse, by_angles=True
    )
