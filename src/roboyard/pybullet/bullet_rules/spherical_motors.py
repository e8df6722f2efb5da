"""Motors of spherical joints, as Bullet's are.

They ask for the velocity 0.2 kp e / dt + (1 - damping) v after a step, e being roll, pitch and yaw of the
turn that is left; Bullet passes over velocity targets, velocity gains and the largest velocity.
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
"""kp of the motors that spherical joints have from the start; they hold the identity."""
ERP = 0.2
"""Share of an error that Bullet's constraints mend in a step."""


def set_spherical_target(
    world: World,
    joint: Joint,
    target: Vector,
    kp: float,
    impulse: Sequence[float],
    damping: float = 1.0,
) -> None:
    """Give a spherical joint a target (x, y, z, w) and bounds (3,) on its motor in a step; N m s."""
    world.motors.set(
        joint, position=target, velocity=0.0, kp=ERP * kp, kd=damping, max_impulse=impulse, by_angles=True
    )
