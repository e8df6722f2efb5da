"""Checks of a definition: contradictions in it, and between it and its robot."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from difflib import get_close_matches

from roboyard.description.model import RobotDescription
from roboyard.kinematics.joint_order import breadth_first_joint_names
from roboyard.robots.definition.names import Found, Where, joint_names, link_names
from roboyard.robots.definition.schema import NEED_RESET_POSE, VIRTUAL_JOINTS, RobotDefinition

BLOCK_OF_GROUP = {
    "trunk": "articulated_trunk",
    "camera": "active_camera",
    "arm": "manipulation",
    "gripper": "manipulation",
}
"""First word of a group's name to the block that defines it."""


@dataclass(frozen=True, kw_only=True, slots=True)
class ConfigProblem:
    """A problem of one field."""

    where: Where
    """Keys from the top of the file."""
    text: str
    """The problem and its remedy."""


def check_alone(definition: RobotDefinition, *, with_lengths: bool = True) -> list[ConfigProblem]:
    """Return the contradictions in a definition.

    Args:
        definition: to check.
        with_lengths: also compare the lengths of postures with each other.
    """
    found = list(_roots(definition)) or [
        *_groups(definition),
        *_bases(definition),
        *_arms(definition),
        *_twice(definition),
        *_postures(definition, with_lengths),
    ]
    return [ConfigProblem(where=where, text=text) for where, text in found]


def check_against(definition: RobotDefinition, description: RobotDescription) -> list[ConfigProblem]:
    """Return unknown link and joint names of a definition, and vectors of a wrong length."""
    links = [link.name for link in description.links]
    joints = breadth_first_joint_names(description)
    found = [
        *_unknown(link_names(definition), "link", links),
        *_unknown(joint_names(definition), "moving joint", joints),
        *_lengths(definition, joints),
        *_virtual_joints(definition, joints),
    ]
    return [ConfigProblem(where=where, text=text) for where, text in found]


def _roots(definition: RobotDefinition) -> Found:
    """Yield problems that would cause many others: missing blocks, inconsistent arm names."""
    allowed = definition.allowed_controllers()
    missing_blocks: dict[str, list[str]] = {}
    for group in definition.raw_controller_order:
        block = BLOCK_OF_GROUP.get(group.split("_", 1)[0])
        if group not in allowed and block is not None and getattr(definition, block) is None:
            missing_blocks.setdefault(block, []).append(group)
    for block, groups in missing_blocks.items():
        yield (block,), f"is missing: raw_controller_order has {', '.join(map(repr, groups))}; add the block"
    manipulation = definition.manipulation
    if manipulation is None:
        return
    arms, top = manipulation.arm_names, ("manipulation", "arm_names")
    twice = [arm for arm in arms if arms.count(arm) > 1]
    if twice:
        yield top, f"lists {twice[0]!r} twice"
    elif len(arms) != manipulation.n_arms:
        yield top, f"lists {len(arms)} arms but n_arms is {manipulation.n_arms}"
    elsewhere = {*manipulation.arm_joint_names, *manipulation.eef_link_names}
    strange = [index for index, arm in enumerate(arms) if arm not in elsewhere]
    if strange and elsewhere - set(arms):
        where = (*top, strange[0]) if len(strange) == 1 else top
        names = " and ".join(repr(arms[index]) for index in strange)
        yield where, f"{names}: no other field has such an arm{_near(arms[strange[0]], sorted(elsewhere))}"


def _groups(definition: RobotDefinition) -> Found:
    allowed, order = definition.allowed_controllers(), definition.raw_controller_order
    missing = [group for group in allowed if group not in order and not _is_bare(definition, group)]
    for index, group in enumerate(order):
        where = ("raw_controller_order", index)
        if group in order[:index]:
            yield where, f"{group!r} is listed twice; keep one"
        elif group not in allowed:
            near = _near(group, missing or allowed)
            yield where, f"no block defines a group {group!r}{near}"
            del missing[:1]  # the misspelled one
    for group in missing:
        yield ("raw_controller_order",), f"the group {group!r} is missing; add it"
    for group, name in definition.default_controllers.items():
        where = ("default_controllers", group)
        if group not in allowed:
            yield where, f"no block defines a group {group!r}{_near(group, allowed)}"
        elif name not in allowed[group]:
            yield where, f"{group!r} cannot have a {name}; choose one of {', '.join(allowed[group])}"


def _is_bare(definition: RobotDefinition, group: str) -> bool:
    """Return whether a group is the gripper of an arm without fingers."""
    block = definition.manipulation
    return group.startswith("gripper_") and not (
        block is not None and block.finger_joint_names.get(group.removeprefix("gripper_"))
    )


def _bases(definition: RobotDefinition) -> Found:
    wheels, locomotion = definition.two_wheel, definition.locomotion
    if definition.holonomic_base is not None:
        if wheels is not None:
            yield (
                ("two_wheel",),
                "a holonomic base cannot also have two driven wheels; keep one of the blocks",
            )
        if definition.base_footprint_link_name is None:
            message = "is required with holonomic_base; give the child link of the virtual joints"
            yield ("base_footprint_link_name",), message
        expected = tuple(VIRTUAL_JOINTS[k] for k in (0, 1, 5))
        if locomotion is None:
            yield ("locomotion",), f"is required with holonomic_base; give base_joint_names {list(expected)}"
        elif locomotion.base_joint_names != expected:
            message = f"must be {list(expected)} with holonomic_base"
            yield ("locomotion", "base_joint_names"), message
    if wheels is not None:
        for key in ("wheel_radius", "wheel_axle_length"):
            if not getattr(wheels, key) > 0:
                yield ("two_wheel", key), f"must be a positive length (m), got {getattr(wheels, key)}"
        if locomotion is None:
            yield (
                ("locomotion",),
                "is required with two_wheel; give base_joint_names [left wheel, right wheel]",
            )
        elif not locomotion.base_joint_names or len(locomotion.base_joint_names) % 2:
            message = (
                f"must list two joints with two_wheel, left then right, got "
                f"{len(locomotion.base_joint_names)}"
            )
            yield ("locomotion", "base_joint_names"), message
    is_legged = wheels is None and definition.holonomic_base is None
    if is_legged and locomotion is not None and not locomotion.base_joint_names:
        yield ("locomotion", "base_joint_names"), "is empty; list the joints of the base"
    if definition.articulated_trunk is not None and not definition.articulated_trunk.trunk_joint_names:
        yield ("articulated_trunk", "trunk_joint_names"), "is empty; list the torso's joints"
    if definition.active_camera is not None and not definition.active_camera.camera_joint_names:
        yield ("active_camera", "camera_joint_names"), "is empty; list the head's joints"


def _arms(definition: RobotDefinition) -> Found:
    block = definition.manipulation
    if block is None:
        return
    arms = block.arm_names
    required = {
        "arm_joint_names": block.arm_joint_names,
        "eef_link_names": block.eef_link_names,
    }
    optional = {
        "arm_link_names": block.arm_link_names,
        "finger_link_names": block.finger_link_names,
        "finger_joint_names": block.finger_joint_names,
        "gripper_link_names": block.gripper_link_names,
        "opening_direction": block.opening_direction,
        "arm_workspace_range": block.arm_workspace_range,
        "teleop_rotation_offset": block.teleop_rotation_offset,
        "assisted_grasp_start_points": block.assisted_grasp_start_points,
        "assisted_grasp_end_points": block.assisted_grasp_end_points,
    }
    for key, by_arm in required.items():
        strange = [arm for arm in by_arm if arm not in arms]
        for arm in arms:
            if arm not in by_arm and not strange:
                yield ("manipulation", key), f"has no entry for arm {arm!r}; add it"
    for key, by_arm in {**required, **optional}.items():
        for arm in by_arm or {}:
            if arm not in arms:
                yield ("manipulation", key, arm), f"there is no arm {arm!r}{_near(arm, arms)}"
    for arm in arms:
        if arm in block.arm_joint_names and not block.arm_joint_names[arm]:
            yield ("manipulation", "arm_joint_names", arm), "is empty; list the arm's joints"
    for arm, way in (block.opening_direction or {}).items():
        fingers = block.finger_joint_names.get(arm, ())
        for joint in way if isinstance(way, dict) else ():
            if joint not in fingers:
                where = ("manipulation", "opening_direction", arm, joint)
                yield where, f"{joint!r} is no finger joint of arm {arm!r}{_near(joint, fingers)}"
    for arm, (low, high) in (block.arm_workspace_range or {}).items():
        if low > high:
            yield (
                ("manipulation", "arm_workspace_range", arm),
                f"has lower limit {low} above upper limit {high}; swap them",
            )
    for name, variant in (block.end_effectors or {}).items():
        if block.supported_end_effector is not None and name not in block.supported_end_effector:
            where = ("manipulation", "end_effectors", name)
            yield where, f"{name!r} is not in supported_end_effector; add it there"
        for key in ("eef_link_names", "finger_link_names", "finger_joint_names"):
            for arm in getattr(variant, key):
                if arm not in arms:
                    where = ("manipulation", "end_effectors", name, key, arm)
                    yield where, f"there is no arm {arm!r}{_near(arm, arms)}"


def _postures(definition: RobotDefinition, with_lengths: bool) -> Found:
    block = definition.mobile_manipulation
    if block is not None:
        names, count = block.joint_names, len(block.untucked_default_joint_pos)
        compared = with_lengths or names is not None
        if compared and len(block.tucked_default_joint_pos) != count:
            message = (
                f"has {len(block.tucked_default_joint_pos)} values but untucked_default_joint_pos has {count}"
            )
            yield ("mobile_manipulation", "tucked_default_joint_pos"), message
        if names is not None and len(names) != count:
            message = f"has {len(names)} names for {count} values"
            yield ("mobile_manipulation", "joint_names"), message
        poses = block.default_arm_poses or {}
        if block.default_arm_pose_key is not None and block.default_arm_pose_key not in poses:
            message = (
                f"no default_arm_poses named "
                f"{block.default_arm_pose_key!r}{_near(block.default_arm_pose_key, poses)}"
            )
            yield ("mobile_manipulation", "default_arm_pose_key"), message
    variants = definition.manipulation.end_effectors if definition.manipulation is not None else None
    if definition.default_joint_pos or block is not None or variants:
        return
    for group, name in definition.default_controllers.items():
        if name in NEED_RESET_POSE:
            yield (
                ("default_joint_pos",),
                f"is required because {group!r} has an {name}, which needs a rest posture;"
                " give one value for each joint (zeros are a start)",
            )
            return


def _twice(definition: RobotDefinition) -> Found:
    """Yield joints that are listed twice in one list."""
    seen: set[Where] = set()
    for where, name in joint_names(definition):
        if (*where[:-1], name) in seen:
            yield where, f"{name!r} is listed twice; keep one"
        seen.add((*where[:-1], name))


def _unknown(names: Found, kind: str, known: Sequence[str]) -> Found:
    there = set(known)
    for where, name in names:
        if name not in there:
            yield where, f"the robot has no {kind} {name!r}{_near(name, known)}"


def _lengths(definition: RobotDefinition, joints: Sequence[str]) -> Found:
    vectors: dict[Where, Sequence[float] | None] = {
        ("default_joint_pos",): definition.default_joint_pos or None
    }
    block = definition.mobile_manipulation
    if block is not None and block.joint_names is None:
        for key in ("untucked_default_joint_pos", "tucked_default_joint_pos"):
            vectors["mobile_manipulation", key] = getattr(block, key)
    for where, values in vectors.items():
        if values is not None and len(values) != len(joints):
            shown = ", ".join(joints[:8]) + (", ..." if len(joints) > 8 else "")
            yield where, f"has {len(values)} values; the robot has {len(joints)} joints ({shown})"


def _virtual_joints(definition: RobotDefinition, joints: Sequence[str]) -> Found:
    if definition.holonomic_base is None:
        return
    missing = [name for name in VIRTUAL_JOINTS if name not in joints]
    if missing:
        yield (
            ("holonomic_base",),
            f"the robot has no joint {missing[0]!r}; import it with use_holonomic_joints: true",
        )


def _near(name: str, known: Sequence[str] | Mapping[str, object]) -> str:
    names = list(known)
    near = get_close_matches(name, names, n=1)
    if near:
        return f"; did you mean {near[0]!r}?"
    shown = ", ".join(names[:12]) + (f", ... ({len(names)} in all)" if len(names) > 12 else "")
    return f" (there are: {shown or 'none'})"
