"""The understanding of a robot as plain data: each field once, and each conclusion with its reasons."""

from __future__ import annotations

from typing import Any

from roboyard.description.semantic import MountedSensor, SemanticDescription


def understanding(semantic: SemanticDescription) -> dict[str, Any]:
    """Return a robot's understanding as plain data for JSON or YAML.

    Returns:
        `kind`, `base`, the joints of `drive_wheels`, `steer_joints`, `caster_joints`, `trunk_joints` and
        `head_joints`; by arm's name `arms` (joints), `eef_links`, `grippers` (driven joints) and `opening`;
        by leg's name `legs`; by sensor's name `camera_links`, `lidar_links` and `imu_links`.
    """
    hands = {arm.name: arm.end_effector.gripper for arm in semantic.arms}
    hands = {name: hand for name, hand in hands.items() if hand is not None}
    owned = list(hands.values())
    for gripper in semantic.grippers:
        if gripper not in owned:
            hands[gripper.palm] = gripper
    return {
        "kind": semantic.kind,
        "base": semantic.base,
        "drive": semantic.drive,
        "drive_wheels": [wheel.joint for wheel in semantic.driven_wheels],
        "steer_joints": list(semantic.steer_joints),
        "caster_joints": list(semantic.caster_joints),
        "trunk_joints": list(semantic.trunk_joints),
        "head_joints": list(semantic.head_joints),
        "legs": {leg.name: list(leg.joints) for leg in semantic.legs},
        "arms": {arm.name: list(arm.joints) for arm in semantic.arms},
        "eef_links": {arm.name: arm.end_effector.link for arm in semantic.arms},
        "grippers": {name: list(hand.joints) for name, hand in hands.items()},
        "opening": {name: hand.opening for name, hand in hands.items()},
        "camera_links": _links(semantic.mounted("camera")),
        "lidar_links": _links(semantic.mounted("lidar")),
        "imu_links": _links(semantic.mounted("imu")),
    }


def conclusions(semantic: SemanticDescription) -> list[dict[str, Any]]:
    """Return the conclusions as plain data: field, value, confidence, evidence and setting."""
    return [
        {
            "field": found.field,
            "value": found.value,
            "confidence": round(found.confidence, 2),
            "evidence": list(found.evidence),
            "setting": found.setting,
        }
        for found in semantic.conclusions
    ]


def _links(sensors: tuple[MountedSensor, ...]) -> dict[str, str]:
    return {sensor.name: sensor.link for sensor in sensors}
