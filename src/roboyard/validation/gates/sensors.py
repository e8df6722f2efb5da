"""Test that cameras are upright and not occluded by the robot itself."""

from __future__ import annotations

from roboyard.robots import Robot
from roboyard.robots.sensor_frames import CameraFrame
from roboyard.sensors.occlusion import NEAR, RAYS, occluded_fraction
from roboyard.sim.body import Body
from roboyard.transforms import Array, matrix_from_quaternion
from roboyard.validation.report import Gate
from roboyard.validation.test_world import TestWorld

MAX_OCCLUDED = 0.5
"""Fraction of the view that the robot may occlude."""
UPRIGHT = 0.3
"""Least z component of the upward direction of a camera of the head."""
HEADS = ("head", "eye")
"""Parts of the names of cameras that must be upright."""


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
        fraction, is_upright, texts = camera_findings(robot.body, camera.name, position, rotation)
        findings += texts
        fractions.append(fraction if is_upright else 1.0)
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


def camera_findings(body: Body, name: str, position: Array, rotation: Array) -> tuple[float, bool, list[str]]:
    """Test one camera.

    Args:
        body: the robot that carries it.
        name: name of the camera.
        position: (3,) position in the world frame (m).
        rotation: (3, 3) camera to world; the camera looks along its -z, +y is up.

    Returns:
        Fraction of the view that the robot occludes at close range, whether the camera is upright (or need
        not be), and a finding for each fault.
    """
    findings = []
    fraction = occluded_fraction(body, position, rotation)
    if fraction > MAX_OCCLUDED:
        findings.append(f"{name}: {fraction:.0%} of the view is occluded within {NEAR * 100:g} cm")
    is_upright = rotation[2, 1] >= UPRIGHT or not any(part in name.lower() for part in HEADS)
    if not is_upright:
        findings.append(f"{name}: +y of the camera does not point up (z {rotation[2, 1]:.2f})")
    return fraction, is_upright, findings


def _pose(robot: Robot, camera: CameraFrame) -> tuple[Array, Array]:
    """Return position (3,) (m) and rotation matrix (3, 3) of a camera in the world frame."""
    position, quaternion = robot.link(camera.link).pose
    R_world_link = matrix_from_quaternion(quaternion)
    return position + R_world_link @ camera.position, R_world_link @ matrix_from_quaternion(camera.quaternion)
