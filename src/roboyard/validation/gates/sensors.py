"""Test that cameras are upright and not occluded by the robot itself."""

from __future__ import annotations

from roboyard.robots import Robot
from roboyard.robots.sensor_frames import CameraFrame
from roboyard.sensors.occlusion import NEAR, RAYS, occluded_fraction
from roboyard.transforms import Array, matrix_from_quaternion
from roboyard.validation.report import Gate
from roboyard.validation.test_world import TestWorld

MAX_OCCLUDED = 0.5
"""Fraction of the view that the robot may occlude."""


def sensors_gates(test_world: TestWorld) -> tuple[Gate, ...]:
    """Measure the largest fraction of a camera's view that the robot occludes at close range."""
    title = "Cameras are not occluded by the robot"
    if not test_world.cameras:
        return (
            Gate(
                name="sensors",
                title=title,
                figure=0.0,
                threshold=MAX_OCCLUDED,
                unit="of the view",
                skipped="the robot has no cameras",
            ),
        )
    robot = test_world.robot(visual=True)
    findings, fractions = [], []
    for camera in test_world.cameras:
        names = [link.name for link in robot.links]
        if camera.link not in names:
            findings.append(f"{camera.name}: there is no link {camera.link!r}")
            fractions.append(1.0)
            continue
        position, rotation = _pose(robot, camera)
        fraction = occluded_fraction(robot.body, position, rotation)
        fractions.append(fraction)
        if fraction > MAX_OCCLUDED:
            findings.append(f"{camera.name}: {fraction:.0%} of the view is occluded within {NEAR * 100:g} cm")
        if ("head" in camera.name or "eye" in camera.name) and rotation[2, 1] < 0.3:
            findings.append(f"{camera.name}: +y of the camera does not point up (z {rotation[2, 1]:.2f})")
            fractions[-1] = max(fractions[-1], 1.0)
    return (
        Gate(
            name="sensors",
            title=title,
            figure=float(max(fractions)),
            threshold=MAX_OCCLUDED,
            unit="of the view",
            detail=f"{len(test_world.cameras)} cameras (-z forward, +y up), {RAYS}x{RAYS} rays each",
            findings=findings,
            advice="offset.position and offset.orientation of the camera in the import configuration",
        ),
    )


def _pose(robot: Robot, camera: CameraFrame) -> tuple[Array, Array]:
    """Return position (3,) (m) and rotation matrix (3, 3) of a camera in the world frame."""
    position, quaternion = robot.link(camera.link).pose
    R_world_link = matrix_from_quaternion(quaternion)
    return position + R_world_link @ camera.position, R_world_link @ matrix_from_quaternion(camera.quaternion)
