"""End effectors of arms, and the conclusions about grippers and sensors."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from roboyard.description.evidence.model import FileEvidence
from roboyard.description.model import RobotDescription
from roboyard.description.semantic import Conclusion, EndEffector
from roboyard.morphology.hands.describe import FoundGripper, describe_gripper
from roboyard.morphology.hands.frames import end_link
from roboyard.morphology.sensors.find import FoundSensor

_LISTS = {"camera": "camera_links", "lidar": "lidar_links", "imu": "understanding.imu_links"}


def end_effector(
    description: RobotDescription,
    links: Sequence[str],
    fingers: Sequence[str],
    evidence: FileEvidence | None = None,
) -> tuple[EndEffector, FoundGripper | None]:
    """Return the end effector at the end of an arm, and its gripper where it has one.

    Args:
        description: the robot.
        links: the links of the arm's last body, that next to the joint first.
        fingers: moving joints of fingers that hang from it.
        evidence: what the robot's files state beyond links and joints.
    """
    if not fingers and not has_suction(links, evidence):
        return EndEffector(link=end_link(description, links)), None
    found = describe_gripper(description, links, fingers, evidence)
    effector = EndEffector(
        link=found.link,
        gripper_links=found.gripper.links,
        gripper_joints=found.gripper.joints,
        frame=found.frame,
        gripper=found.gripper,
    )
    return effector, found


def with_known_gripper(end: EndEffector, found: Sequence[EndEffector]) -> EndEffector:
    """Return a stated end effector with what was found about a gripper that has its joints.

    Args:
        end: as stated, without a gripper of its own.
        found: the inferred end effectors.
    """
    joints = set(end.gripper_joints)
    same = (one for one in found if one.gripper is not None and joints & {*one.gripper.joints})
    known = next(same, None)
    if end.gripper is not None or known is None or known.gripper is None:
        return end
    gripper = known.gripper
    ways = {name: way for name, way in gripper.opening_of.items() if name in joints}
    common = set(ways.values()) if set(ways) == joints else set()
    return replace(
        end,
        frame=known.frame if known.link == end.link else None,
        gripper=replace(
            gripper,
            joints=end.gripper_joints,
            mimic_joints=tuple(name for name in gripper.mimic_joints if name not in joints),
            links=end.gripper_links or gripper.links,
            opening=common.pop() if len(common) == 1 else gripper.opening,
            opening_of=ways,
        ),
    )


def has_suction(links: Sequence[str], evidence: FileEvidence | None = None) -> bool:
    """Return whether links without fingers hold by suction, as their names or a simulator's plugin state."""
    if any(
        word in link.lower()
        for link in links
        for word in ("suction", "vacuum", "saugnapf", "ventosa", "pump_")
    ):
        return True
    plugins = () if evidence is None else evidence.plugins
    named = {t for p in plugins if p.kind == "suction" for texts in p.words.values() for t in texts}
    return any(link in named for link in links)


def holds_by_suction(links: Sequence[str], evidence: FileEvidence | None = None) -> bool:
    """Return whether a body on its own is a suction gripper; a vacuum cleaner is none."""
    names = " ".join(links).lower()
    return has_suction(links, evidence) and any(
        word in names for word in ("suction", "grip", "saugnapf", "ventosa")
    )


def gripper_conclusions(found: Mapping[str, FoundGripper]) -> list[Conclusion]:
    """Return what was concluded about grippers, by the name of their arm or palm."""
    conclusions = []
    for name, item in found.items():
        gripper = item.gripper
        joints, links = ", ".join(gripper.joints), ", ".join(gripper.links)
        conclusions.append(
            Conclusion(
                field=f"grippers.{name}",
                value=list(gripper.joints),
                confidence=item.confidence,
                evidence=(f"a gripper of kind {gripper.kind}", *item.evidence),
                setting=f"curobo: {{eef_to_gripper_info: {{{item.link}: "
                f"{{links: [{links}], joints: [{joints}]}}}}}}",
            )
        )
        if gripper.opening is not None:
            conclusions.append(
                Conclusion(
                    field=f"opening.{name}",
                    value=gripper.opening,
                    confidence=item.confidence,
                    evidence=tuple(reason for reason in item.evidence if "away from" in reason),
                    setting=f"understanding: {{opening: {{{name}: {gripper.opening}}}}}",
                )
            )
    return conclusions


def sensor_conclusions(found: Sequence[FoundSensor]) -> list[Conclusion]:
    """Return what was concluded about cameras, lidars and IMUs."""
    return [
        Conclusion(
            field=f"{item.sensor.kind}_links.{item.sensor.name}",
            value=item.sensor.link,
            confidence=item.confidence,
            evidence=item.evidence,
            setting=(
                f"understanding: {{imu_links: [{item.sensor.link}]}}"
                if item.sensor.kind == "imu"
                else f"{_LISTS[item.sensor.kind]}: [{{link: {item.sensor.link}}}]"
            ),
        )
        for item in found
    ]
