"""Simulated cameras, lidars, IMUs, force-torque and contact sensors, each at its own rate.

>>> from roboyard.sensors import CameraSensor, Lidar, Sensors
>>> sensors = Sensors(world)
>>> sensors.add(CameraSensor(robot.link("eyes"), rate=30))
>>> sensors.add(Lidar(robot.link("laser"), rate=10))
>>> world.step(8)
>>> sensors.observe()["r1:eyes:Camera:0"]["rgb"]
"""

from __future__ import annotations

from roboyard.sensors.base import Sensor, SensorPose
from roboyard.sensors.camera import CameraSensor, link_names
from roboyard.sensors.contact import ContactSensor
from roboyard.sensors.force_torque import ForceTorqueSensor
from roboyard.sensors.inertial import Imu
from roboyard.sensors.lidar import Lidar, Scan
from roboyard.sensors.rates import Sensors
from roboyard.sensors.scan_pattern import IMPORTED_PATTERN, ScanPattern

__all__ = [
    "IMPORTED_PATTERN",
    "CameraSensor",
    "ContactSensor",
    "ForceTorqueSensor",
    "Imu",
    "Lidar",
    "Scan",
    "ScanPattern",
    "Sensor",
    "SensorPose",
    "Sensors",
    "link_names",
]
