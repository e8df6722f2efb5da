"""Force-torque sensor between a link and its parent."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

import numpy as np

from roboyard.sensors.base import Observation, Sensor

if TYPE_CHECKING:
    from roboyard.sim import World


class ForceTorqueSensor(Sensor):
    """Force and torque that a link exerts on its parent, as measured by a wrist sensor between the two.

    A hanging load reads its weight, pointing down. Motor effort and friction of the joint between the two are
    included.
    """

    kind: ClassVar[str] = "ForceTorque"
    modalities: ClassVar[tuple[str, ...]] = ("force", "torque")

    def observe(self) -> Observation:
        """Return force and torque of the last step in the sensor's frame.

        "force" (3,) N; "torque" (3,) about the sensor's origin (N m).
        """
        world = self.world
        data = world.velocities()
        model = world.live_model
        internal_forces(world)
        row = int(self.link.body.mujoco_ids[self.link.index])
        position, rotation = self.mount.in_world()
        from_parent = data.cfrc_int[row]  # from the parent on the link, about the tree's centre of mass
        force = from_parent[3:]
        arm = data.subtree_com[model.body_rootid[row]] - position
        torque = from_parent[:3] + np.cross(arm, force)
        return {"force": -rotation.T @ force, "torque": -rotation.T @ torque}


def internal_forces(world: World) -> None:
    """Compute `cacc`, `cfrc_ext` and `cfrc_int` of the last step, applied wrenches included."""
    data = world.live_data
    push = world.wrenches.of_last_push
    is_fresh = push is not None and push[0] == world.time and push[1].shape == data.xfrc_applied.shape
    if not is_fresh or world.wrenches.pending:
        world.find_reactions()
        return
    assert push is not None
    data.xfrc_applied[:] = push[1]
    try:
        world.find_reactions()
    finally:
        data.xfrc_applied[:] = 0.0
