"""Sensors that the description implies: what a mounted camera looks at, in its link's axes."""

from __future__ import annotations

from typing import cast

import numpy as np
import pytest

from roboyard.description.model import Joint, Link, Pose, RobotDescription
from roboyard.description.robot_model import RobotModel, Sensor
from roboyard.description.semantic import MountedSensor, SemanticDescription
from roboyard.importer.context import ImportContext
from roboyard.importer.import_log import ImportLog
from roboyard.importer.steps.mounted_sensors import mount_sensors


class Context:
    """The part of an import's context that the step uses."""

    def __init__(self) -> None:
        self.log = ImportLog()


def mounted(*found: MountedSensor, given: tuple[Sensor, ...] = ()) -> tuple[Sensor, ...]:
    """Return the sensors of a robot with the links `base`, `eye` and `optical`."""
    robot = RobotModel(
        name="r",
        description=RobotDescription(
            name="r",
            links=tuple(Link(name=name) for name in ("base", "eye", "optical")),
            joints=(
                Joint(name="a", type="fixed", parent="base", child="eye"),
                Joint(name="b", type="fixed", parent="eye", child="optical"),
            ),
        ),
        semantic=SemanticDescription(base_link="base", sensors=found),
        sensors=given,
    )
    return mount_sensors(robot, cast(ImportContext, Context())).sensors


LEFT = Pose(quaternion=(0.0, 0.0, float(np.sqrt(0.5)), float(np.sqrt(0.5))))


@pytest.mark.parametrize(
    ("sensor", "link", "forwards", "up"),
    [
        (
            MountedSensor(kind="camera", name="c", link="eye", optical_link="optical"),
            "optical",
            (0, 0, 1),
            (0, -1, 0),
        ),
        (MountedSensor(kind="camera", name="c", link="eye"), "eye", (1, 0, 0), (0, 0, 1)),
        (MountedSensor(kind="camera", name="c", link="eye", frame=LEFT), "eye", (0, 1, 0), (0, 0, 1)),
    ],
)
def test_a_camera_looks_where_its_frame_points(
    sensor: MountedSensor, link: str, forwards: tuple[int, ...], up: tuple[int, ...]
) -> None:
    """A camera of the files looks along its -z axis with +y up."""
    (made,) = mounted(sensor)
    axes = made.offset.matrix()[:3, :3]
    assert (made.kind, made.link) == ("camera", link)
    np.testing.assert_allclose(-axes[:, 2], forwards, atol=1e-12)
    np.testing.assert_allclose(axes[:, 1], up, atol=1e-12)


def test_stated_sensors_are_kept_and_imus_need_none() -> None:
    given = (Sensor(kind="camera", link="optical", name="Camera"),)
    camera = MountedSensor(kind="camera", name="c", link="eye", optical_link="optical")
    found = mounted(
        camera,
        MountedSensor(kind="imu", name="i", link="base"),
        MountedSensor(kind="lidar", name="l", link="base"),
        MountedSensor(kind="lidar", name="m", link="gone"),
        given=given,
    )
    assert [(sensor.kind, sensor.link) for sensor in found] == [("camera", "optical"), ("lidar", "base")]
