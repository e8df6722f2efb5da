"""Do cameras see anything but the robot's own inside, and the right way up?"""

from __future__ import annotations

from roboyard.robots import Robot
from roboyard.robots.sensor_frames import CameraFrame
from roboyard.sensors.occlusion import NEAR, RAYS, occluded_fraction
from roboyard.transforms import Array, matrix_from_quaternion
from roboyard.validation.report import Gate
from roboyard.validation.test_world import TestWorld

BLOCKED = 0.5
"""Share of the view that may be blocked"""


def sensors(bench: TestWorld) -> tuple[Gate, ...]:
    """Share of the most obstructed camera's view that the robot itself blocks from near by."""
    title = "Cameras see past the robot"
    if not bench.cameras:
        return (
            Gate(
                name="sensors",
                title=title,
                figure=0.0,
                threshold=BLOCKED,
                unit="of the view",
                skipped="the robot has no cameras",
            ),
        )
    robot = bench.robot(visual=True)
    findings, shares = [], []
    for camera in bench.cameras:
        names = [link.name for link in robot.body.links]
        if camera.link not in names:
            findings.append(f"{camera.name}: there is no link {camera.link!r}")
            shares.append(1.0)
            continue
        position, rotation = _pose(robot, camera)
        share = occluded_fraction(robot.body, position, rotation)
        shares.append(share)
        if share > BLOCKED:
            findings.append(f"{camera.name}: {share:.0%} of the view is blocked within {NEAR * 100:g} cm")
        if ("head" in camera.name or "eye" in camera.name) and rotation[2, 1] < 0.3:
            findings.append(f"{camera.name}: +y of the camera does not point up (z {rotation[2, 1]:.2f})")
            shares[-1] = max(shares[-1], 1.0)
    return (
        Gate(
            name="sensors",
            title=title,
            figure=float(max(shares)),
            threshold=BLOCKED,
            unit="of the view",
            detail=f"{len(bench.cameras)} cameras (-z forward, +y up), {RAYS}x{RAYS} rays each",
            findings=findings,
            advice="look at offset.position and offset.orientation of the camera in the import configuration",
        ),
    )


def _pose(robot: Robot, camera: CameraFrame) -> tuple[Array, Array]:
    position, quaternion = robot.body.link(camera.link).pose
    turn = matrix_from_quaternion(quaternion)
    return position + turn @ camera.position, turn @ matrix_from_quaternion(camera.quaternion)
