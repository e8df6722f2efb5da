"""PD_CONTROL: the torque of a spring and a damper on a joint."""

from __future__ import annotations

from typing import TYPE_CHECKING

from roboyard._records import dataclass

if TYPE_CHECKING:
    from roboyard.pybullet.state.bodies.body_records import BodyRecord
    from roboyard.pybullet.state.physics_scene import PhysicsScene


@dataclass(frozen=True, slots=True, eq=False)
class SpringDamper:
    """PD_CONTROL of one joint: a torque computed before each step."""

    scene: PhysicsScene
    record: BodyRecord
    joint: int
    position: float
    """Target (rad or m)."""
    velocity: float
    """Target (rad/s or m/s)."""
    kp: float
    kd: float
    largest: float
    """Largest torque or force (N m or N)."""
    refusal: str
    """Message of the error if the body has gone."""

    def __call__(self) -> None:
        """Apply the torque for the coming step."""
        record, joint = self.record, self.joint
        self.scene.ready(record.number, self.refusal)
        q = record.qpos.item(record.position_addresses[joint])
        v = record.qvel.item(record.velocity_addresses[joint])
        torque = self.kp * (self.position - q) + self.kd * (self.velocity - v)
        torque = min(max(torque, -self.largest), self.largest)
        self.scene.world.wrenches.add_joint_effort(record.body.joints[joint], torque)
