"""Motors of spherical joints, as Bullet's are.

They ask for the velocity 0.2 kp e / dt + (1 - damping) v after a step, e being roll, pitch and yaw of the
turn that is left; Bullet passes over velocity targets, velocity gains and the largest velocity.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from roboyard.pybullet.face.arguments import number

if TYPE_CHECKING:
    from roboyard.pybullet.state.body_records import BodyRecord
    from roboyard.pybullet.state.physics_scene import PhysicsScene
    from roboyard.sim.joint import Joint

Vector = Sequence[float]
IDENTITY = (0.0, 0.0, 0.0, 1.0)
DEFAULT_BALL_GAIN = 0.2
"""kp of the motors that spherical joints have from the start; they hold the identity."""
ERP = 0.2
"""Share of an error that Bullet's constraints mend in a step."""


def set_spherical_target(
    scene: PhysicsScene,
    joint: Joint,
    target: Vector,
    kp: float,
    impulse: Sequence[float],
    damping: float = 1.0,
) -> None:
    """Give a spherical joint a target (x, y, z, w) and bounds (3,) on its motor in a step; N m s."""
    scene.world.motors.set(
        joint, position=target, velocity=0.0, kp=ERP * kp, kd=damping, max_impulse=impulse, by_angles=True
    )


def drive_spherical_joint(
    scene: PhysicsScene, record: BodyRecord, joint: int, position: Vector | None, velocity: Vector | None,
    forces: Sequence[float], kp: float, damping: float,
) -> None:  # fmt: skip
    """POSITION_CONTROL; without four numbers of position or three of velocity nothing changes."""
    is_aimed = position is not None and len(position) == 4
    if not is_aimed and (velocity is None or len(velocity) != 3):
        return
    scene.give_motors_to(record)
    scene.keep_applied(record, joint, off=not any(forces))
    target = tuple(map(number, position)) if position is not None and is_aimed else IDENTITY
    impulse = [force * scene.time_step for force in forces]
    set_spherical_target(scene, record.body.joints[joint], target, kp, impulse, damping)
