"""Checks that cameras are upright and not occluded by the robot itself."""

from __future__ import annotations

from roboyard.viewer.inspector.checks.status import CheckContext, CheckResult, Violation
from roboyard.viewer.inspector.layers.sensor_layer import world_pose


def cameras(context: CheckContext) -> CheckResult:
    """Measure each camera as `roboyard validate` does, at its edited pose."""
    from roboyard.validation.gates.sensors import MAX_OCCLUDED, camera_findings

    violations, fractions = [], []
    cameras = [sensor for sensor in context.edits.sensors if sensor.kind == "camera_links"]
    if not cameras:
        return CheckResult(text="The robot has no cameras; add one under Sensors.", is_open=True)
    for camera in cameras:
        link = context.edits.place_of(camera)[0]
        pose = world_pose(context.body, context.edits, camera)
        if pose is None:
            text = f"camera {camera.link}: there is no link {link!r}"
            violations.append(Violation(text=text))
            continue
        fraction, _, texts = camera_findings(context.body, camera.link, pose[:3, 3], pose[:3, :3])
        fractions.append(fraction)
        violations += [Violation(text=f"camera {text}", link=link) for text in texts]
    most = f", at most {max(fractions):.0%} of a view occluded" if fractions else ""
    return CheckResult(
        text=f"{len(cameras)} cameras{most} (allowed: {MAX_OCCLUDED:.0%}).", violations=violations
    )
