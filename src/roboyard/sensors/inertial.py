"""An inertial measurement unit."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from roboyard.sensors.base import Observation, Sensor
from roboyard.transforms import quaternion_from_matrix


class Imu(Sensor):
    """Accelerometer, gyroscope and attitude; at rest it measures 9.81 m/s² upwards, as real ones do."""

    kind: ClassVar[str] = "IMU"
    modalities: ClassVar[tuple[str, ...]] = ("acceleration", "angular_velocity", "orientation")

    def observe(self) -> Observation:
        """Return the measurements in the sensor's frame.

        "acceleration" (3,) specific force of the last step (m/s²), 0 in free fall;
        "angular_velocity" (3,) rad/s; "orientation" (4,) quaternion x, y, z, w of the sensor in the world.
        """
        from roboyard._mujoco import mujoco

        world = self.world
        data = world.velocities()
        model = world.live_model
        world.find_reactions()
        row = int(self.link.body.mujoco_ids[self.link.index])
        moving, velocity = np.empty(6), np.empty(6)
        kind = mujoco.mjtObj.mjOBJ_XBODY
        mujoco.mj_objectAcceleration(model, data, kind, row, moving, 1)
        mujoco.mj_objectVelocity(model, data, kind, row, velocity, 1)
        spin, at = velocity[:3], self.mount.position
        linear = moving[3:] + np.cross(moving[:3], at) + np.cross(spin, np.cross(spin, at))
        turn = self.mount.rotation
        return {
            "acceleration": turn.T @ linear,
            "angular_velocity": turn.T @ spin,
            "orientation": quaternion_from_matrix(self.mount.in_world()[1]),
        }
