"""Parts of a robot as its configuration states them, in place of those that were inferred."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from roboyard.description.model import RobotDescription
from roboyard.description.semantic import (
    Arm,
    Conclusion,
    EndEffector,
    Gripper,
    Leg,
    MountedSensor,
    Opening,
    SemanticDescription,
)
from roboyard.errors import ConfigError, unknown_name
from roboyard.importer.config.schema import Gripper as StatedGripper
from roboyard.importer.config.schema import Understanding
from roboyard.importer.stated_base import with_stated_base, with_stated_head, with_stated_swivels


def with_stated_parts(
    semantic: SemanticDescription,
    stated: Understanding,
    description: RobotDescription,
    grippers: Mapping[str, StatedGripper] | None = None,
) -> SemanticDescription:
    """Return the semantics with what a configuration states; equal statements change nothing.

    Args:
        semantic: as inferred, with the robot's names.
        stated: the configuration's `understanding`.
        description: the robot.
        grippers: end-effector link to the gripper that the configuration states for it.

    Raises:
        ConfigError: `opening` names an arm or palm that there is not, or that has no gripper.
    """
    if stated.kind is not None and stated.kind != semantic.kind:
        semantic = _concluded(replace(semantic, kind=stated.kind), "kind", stated.kind)
    for key, joints in (("steer_joints", stated.steer_joints), ("caster_joints", stated.caster_joints)):
        if joints is not None and tuple(joints) != getattr(semantic, key):
            steer, casters = (joints, None) if key == "steer_joints" else (stated.steer_joints, joints)
            changed = with_stated_swivels(semantic, steer=steer, casters=casters)
            semantic = _concluded(changed, key, tuple(joints))
    if stated.base is not None and stated.base != semantic.base:
        semantic = _concluded(with_stated_base(semantic, stated.base), "base", stated.base)
    if stated.head_joints is not None and tuple(stated.head_joints) != semantic.head_joints:
        changed = with_stated_head(semantic, stated.head_joints, description)
        semantic = _concluded(changed, "head_joints", changed.head_joints)
    if stated.arms is not None:
        semantic = _with_arms(semantic, stated.arms, description)
    if stated.legs is not None:
        semantic = _with_legs(semantic, stated.legs, description)
    if stated.opening is not None:
        semantic = _with_opening(semantic, stated.opening, grippers or {}, description)
    if stated.imu_links is not None:
        semantic = _with_imus(semantic, stated.imu_links)
    return semantic


def _with_arms(
    semantic: SemanticDescription, stated: Mapping[str, Sequence[str]], description: RobotDescription
) -> SemanticDescription:
    known = {arm.name: arm for arm in semantic.arms}
    if {name: tuple(joints) for name, joints in stated.items()} == {n: a.joints for n, a in known.items()}:
        return semantic
    arms = []
    for name, joints in stated.items():
        arm = known.get(name)
        if arm is None:
            tip = description.joint_by_name[joints[-1]].child if joints else description.root.name
            arm = Arm(name=name, joints=(), end_effector=EndEffector(link=tip))
        arms.append(replace(arm, joints=tuple(joints)))
    ends = [arm.end_effector for arm in arms]
    ordered = [end for end in semantic.end_effectors if end in ends]
    ordered += [end for end in ends if end not in ordered]
    fields = tuple(f"arms.{name}" for name in {*known, *stated} if name not in stated)
    semantic = replace(
        semantic, arms=tuple(sorted(arms, key=lambda arm: arm.name)), end_effectors=tuple(ordered)
    )
    semantic = _without(semantic, fields)
    for arm in arms:
        if arm != known.get(arm.name):
            semantic = _concluded(semantic, f"arms.{arm.name}", arm.joints)
    return semantic


def _with_legs(
    semantic: SemanticDescription, stated: Mapping[str, Sequence[str]], description: RobotDescription
) -> SemanticDescription:
    known = {leg.name: leg for leg in semantic.legs}
    if {name: tuple(joints) for name, joints in stated.items()} == {n: x.joints for n, x in known.items()}:
        return semantic
    legs = []
    for name, joints in stated.items():
        leg = known.get(name)
        if leg is None or leg.joints != tuple(joints):
            foot = description.joint_by_name[joints[-1]].child if joints else description.root.name
            leg = Leg(name=name, joints=tuple(joints), foot=foot)
        legs.append(leg)
    semantic = replace(semantic, legs=tuple(legs))
    semantic = _without(semantic, tuple(f"legs.{name}" for name in known if name not in stated))
    for leg in legs:
        if leg != known.get(leg.name):
            semantic = _concluded(semantic, f"legs.{leg.name}", leg.joints)
    return semantic


def _with_opening(
    semantic: SemanticDescription,
    stated: Mapping[str, Opening],
    grippers: Mapping[str, StatedGripper],
    description: RobotDescription,
) -> SemanticDescription:
    for name, way in stated.items():
        arm = next((arm for arm in semantic.arms if arm.name == name), None)
        old = arm.end_effector.gripper if arm is not None else None
        old = old or next((gripper for gripper in semantic.grippers if gripper.palm == name), None)
        if old is None:
            own = grippers.get(arm.end_effector.link) if arm is not None else None
            if arm is None or own is None or not own.joints:
                raise ConfigError(f"understanding.opening.{name}: {_no_gripper(semantic, name, arm)}")
            semantic = _with_new_gripper(semantic, arm, own, way, description)
        elif old.opening == way:
            continue
        else:
            new = replace(old, opening=way, opening_of=dict.fromkeys(old.joints, way))
            semantic = _with_gripper(semantic, old, new)
        semantic = _concluded(semantic, f"opening.{name}", way)
    return semantic


def _no_gripper(semantic: SemanticDescription, name: str, arm: Arm | None) -> str:
    if arm is not None:
        link = arm.end_effector.link
        where = f"curobo.eef_to_gripper_info.{link}"
        return f"no gripper is known at the end of this arm; state its joints in {where}"
    known = [arm.name for arm in semantic.arms] + [gripper.palm for gripper in semantic.grippers]
    return unknown_name("arm or palm", name, known)


def _with_new_gripper(
    semantic: SemanticDescription, arm: Arm, own: StatedGripper, way: Opening, description: RobotDescription
) -> SemanticDescription:
    """Return the semantics with a gripper of which nothing but its joints and its opening is known."""
    palm = description.joint_by_name[own.joints[0]].parent
    gripper = Gripper(
        kind="fingers",
        palm=palm,
        joints=tuple(own.joints),
        links=tuple(own.links),
        opening=way,
        opening_of=dict.fromkeys(own.joints, way),
    )
    end = replace(arm.end_effector, gripper=gripper)
    return replace(
        semantic,
        arms=tuple(replace(a, end_effector=end) if a is arm else a for a in semantic.arms),
        end_effectors=tuple(end if e == arm.end_effector else e for e in semantic.end_effectors),
        grippers=(*semantic.grippers, gripper),
    )


def _with_gripper(semantic: SemanticDescription, old: Gripper, new: Gripper) -> SemanticDescription:
    def end(effector: EndEffector) -> EndEffector:
        return replace(effector, gripper=new) if effector.gripper == old else effector

    return replace(
        semantic,
        grippers=tuple(new if gripper == old else gripper for gripper in semantic.grippers),
        end_effectors=tuple(map(end, semantic.end_effectors)),
        arms=tuple(replace(arm, end_effector=end(arm.end_effector)) for arm in semantic.arms),
    )


def _with_imus(semantic: SemanticDescription, stated: Sequence[str]) -> SemanticDescription:
    known = {sensor.link: sensor for sensor in semantic.mounted("imu")}
    if list(known) == list(stated):
        return semantic
    others = [sensor for sensor in semantic.sensors if sensor.kind != "imu"]
    imus = [known.get(link) or MountedSensor(kind="imu", name=link, link=link) for link in stated]
    semantic = replace(semantic, sensors=(*others, *imus))
    imu_fields = (found for found in semantic.conclusions if found.field.startswith("imu_links."))
    gone = tuple(found.field for found in imu_fields if found.value not in stated)
    semantic = _without(semantic, gone)
    for sensor in imus:
        if sensor.link not in known:
            semantic = _concluded(semantic, f"imu_links.{sensor.name}", sensor.link)
    return semantic


def _without(semantic: SemanticDescription, fields: Sequence[str]) -> SemanticDescription:
    kept = tuple(found for found in semantic.conclusions if found.field not in fields)
    return replace(semantic, conclusions=kept)


def _concluded(semantic: SemanticDescription, field: str, value: Any) -> SemanticDescription:
    """Return the semantics with a stated conclusion in place of the inferred one."""
    plain = list(value) if isinstance(value, tuple) else value
    new = Conclusion(field=field, value=plain, confidence=1.0, evidence=("as configured",))
    conclusions = [new if found.field == field else found for found in semantic.conclusions]
    if new not in conclusions:
        conclusions.append(new)
    return replace(semantic, conclusions=tuple(conclusions))
