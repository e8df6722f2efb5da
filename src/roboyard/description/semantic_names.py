"""New names in a semantic description, where links or joints of its robot were renamed or merged."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Any

from roboyard.description.semantic import (
    Conclusion,
    EndEffector,
    Gripper,
    SemanticDescription,
)

Names = Mapping[str, str]
"""Old name to new name; names that are missing stay."""


def with_names(semantic: SemanticDescription, links: Names, joints: Names) -> SemanticDescription:
    """Return the semantics with new names of links and joints everywhere; texts of evidence stay."""
    if not links and not joints:
        return semantic

    def link(name: str) -> str:
        return links.get(name, name)

    def joint(name: str) -> str:
        return joints.get(name, name)

    def maybe(name: str | None, names: Names) -> str | None:
        return None if name is None else names.get(name, name)

    def gripper(item: Gripper) -> Gripper:
        return replace(
            item,
            palm=link(item.palm),
            joints=_all(item.joints, joints),
            mimic_joints=_all(item.mimic_joints, joints),
            links=_all(item.links, links),
            fingertips=_all(item.fingertips, links),
            opening_of={joint(name): way for name, way in item.opening_of.items()},
            start_points=tuple((link(name), point) for name, point in item.start_points),
            end_points=tuple((link(name), point) for name, point in item.end_points),
        )

    def effector(item: EndEffector) -> EndEffector:
        return replace(
            item,
            link=link(item.link),
            gripper_links=_all(item.gripper_links, links),
            gripper_joints=_all(item.gripper_joints, joints),
            gripper=None if item.gripper is None else gripper(item.gripper),
        )

    pair = semantic.wheel_pair
    return replace(
        semantic,
        base_link=link(semantic.base_link),
        base_joints=_all(semantic.base_joints, joints),
        virtual_joints=_all(semantic.virtual_joints, joints),
        wheels=tuple(
            replace(
                wheel,
                joint=joint(wheel.joint),
                link=link(wheel.link),
                steer_joint=maybe(wheel.steer_joint, joints),
                caster_joint=maybe(wheel.caster_joint, joints),
                suspension_joints=_all(wheel.suspension_joints, joints),
            )
            for wheel in semantic.wheels
        ),
        wheel_links=_all(semantic.wheel_links, links),
        caster_links=_all(semantic.caster_links, links),
        caster_joints=_all(semantic.caster_joints, joints),
        steer_joints=_all(semantic.steer_joints, joints),
        wheel_pair=None if pair is None else replace(pair, left=joint(pair.left), right=joint(pair.right)),
        trunk_joints=_all(semantic.trunk_joints, joints),
        head_joints=_all(semantic.head_joints, joints),
        head_link=maybe(semantic.head_link, links),
        legs=tuple(
            replace(
                leg,
                joints=_all(leg.joints, joints),
                foot=link(leg.foot),
                wheel_joint=maybe(leg.wheel_joint, joints),
            )
            for leg in semantic.legs
        ),
        end_effectors=tuple(map(effector, semantic.end_effectors)),
        arms=tuple(
            replace(arm, joints=_all(arm.joints, joints), end_effector=effector(arm.end_effector))
            for arm in semantic.arms
        ),
        grippers=tuple(map(gripper, semantic.grippers)),
        sensors=tuple(
            replace(sensor, link=link(sensor.link), optical_link=maybe(sensor.optical_link, links))
            for sensor in semantic.sensors
        ),
        disabled_collision_pairs=tuple((link(a), link(b)) for a, b in semantic.disabled_collision_pairs),
        postures={
            name: {joint(key): value for key, value in posture.items()}
            for name, posture in semantic.postures.items()
        },
        conclusions=tuple(_conclusion(found, links, joints) for found in semantic.conclusions),
    )


def _all(names: Iterable[str], new: Names) -> tuple[str, ...]:
    return tuple(dict.fromkeys(new.get(name, name) for name in names))


def _conclusion(found: Conclusion, links: Names, joints: Names) -> Conclusion:
    """Return a conclusion whose value has the new names."""
    names = links if "link" in found.field or found.field.partition(".")[0] in _OF_LINKS else joints

    def renamed(value: Any) -> Any:
        if isinstance(value, str):
            return names.get(value, value)
        if isinstance(value, list):
            return [renamed(item) for item in value]
        return value

    return replace(found, value=renamed(found.value))


_OF_LINKS = ("end_effectors", "sensors", "cameras", "lidars", "imus")
