"""Do cameras see anything but the robot's own inside, and the right way up?"""

from __future__ import annotations

from roboyard.sensors.occlusion import NEAR, occluded_fraction
from roboyard.viewer.inspector.checks.status import CheckContext, CheckResult, Violation
from roboyard.viewer.inspector.layers.sensor_layer import world_pose

MOST_BLOCKED = 0.5
"""Of the view"""
UPRIGHT = 0.3
"""Least height of a head camera's upward direction, of one"""
HEADS = ("eye", "head")


def cameras(subject: CheckContext) -> CheckResult:
    """Share of each camera's view that the robot itself blocks from near by, and which way is up."""
    offences, shares = [], []
    mounts = [mount for mount in subject.notes.mounts if mount.kind == "camera_links"]
    if not mounts:
        return CheckResult(told="This robot has no cameras yet; add one under Sensors.", is_open=True)
    for mount in mounts:
        on = subject.notes.place_of(mount)[0]
        pose = world_pose(subject.body, subject.notes, mount)
        if pose is None:
            offences.append(
                Violation(told=f"the camera on {mount.link} hangs from {on}, which does not exist")
            )
            continue
        share = occluded_fraction(subject.body, pose[:3, 3], pose[:3, :3])
        shares.append(share)
        if share > MOST_BLOCKED:
            told = (
                f"{share:.0%} of what the camera on {mount.link} sees is the robot within {NEAR * 100:g} cm"
            )
            offences.append(Violation(told=told, link=on))
        if any(word in mount.link.lower() for word in HEADS) and pose[2, 1] < UPRIGHT:
            told = f"the camera on {mount.link} is not upright: its +y points {pose[2, 1]:+.2f} upwards"
            offences.append(Violation(told=told, link=on))
    most = f", at most {max(shares):.0%} of a view blocked" if shares else ""
    return CheckResult(told=f"{len(mounts)} cameras{most}.", offences=offences)
