"""The blocks of a robot definition, from a description and its semantics: plain data for files and spawning.

| found | group and controller |
| --- | --- |
| six virtual joints | `base`, HolonomicBaseJointController |
| driven wheels on two sides | `base`, DifferentialDriveController; left wheels first |
| other wheels, with the joints that steer them | `base`, JointController |
| legs | `base`, JointController |
| joints below all arms, and driven joints of no other group | `trunk`, JointController |
| joints of a head | `camera`, JointController |
| joints of an arm | `arm_<name>` |
| fingers | `gripper_<name>` |
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from roboyard.description.model import RobotDescription
from roboyard.description.semantic import Arm, SemanticDescription, Wheel
from roboyard.export.floor_links import fixed_casters, lowest_links
from roboyard.export.workspace import workspace_range
from roboyard.kinematics import from_description, jacobian
from roboyard.kinematics.joint_order import single_dof_joints
from roboyard.morphology.base.virtual import guide_joints

MIN_IK_JOINTS = 5
"""Smallest number of joints of an arm that follows poses, and of ways in which they move its tip; an arm
with fewer, such as a telescope, is driven joint by joint."""
POSTURES, INDEPENDENT = 8, 1e-3
"""Random postures tried, and the smallest share of a way to move the tip in the largest one."""

GRASP_POINTS = {"assisted_grasp_start_points": "start_points", "assisted_grasp_end_points": "end_points"}
"""Key of a definition to the field of a gripper."""


@dataclass(kw_only=True, slots=True)
class DefinitionBlocks:
    """Blocks and controllers of a definition, in its own keys."""

    base: dict[str, Any] = field(default_factory=dict)
    """`holonomic_base`, `two_wheel` and `locomotion`."""
    trunk: dict[str, Any] = field(default_factory=dict)
    """`articulated_trunk`."""
    camera: dict[str, Any] = field(default_factory=dict)
    """`active_camera`."""
    manipulation: dict[str, Any] = field(default_factory=dict)
    """`manipulation`."""
    controllers: dict[str, str] = field(default_factory=dict)
    """Group to controller, in action order."""

    @property
    def data(self) -> dict[str, Any]:
        """All blocks with `raw_controller_order` and `default_controllers`."""
        return {
            "raw_controller_order": list(self.controllers),
            "default_controllers": self.controllers,
            **self.base,
            **self.trunk,
            **self.camera,
            **self.manipulation,
        }


def definition_blocks(
    description: RobotDescription,
    semantic: SemanticDescription,
    *,
    arm_controller: str = "InverseKinematicsController",
    sphere_wheels: bool = False,
    rest: Mapping[str, float] | None = None,
) -> DefinitionBlocks:
    """Return the blocks of a robot's definition.

    Args:
        description: of the robot.
        semantic: of the robot.
        arm_controller: of arms with at least `MIN_IK_JOINTS` joints; shorter ones have a JointController.
        sphere_wheels: whether the wheels of a holonomic base collide as spheres.
        rest: joint positions from which the arms' workspace ranges are sampled (rad or m); without it they
            are omitted.
    """
    driven = {joint.name: joint.child for joint in single_dof_joints(description.depth_first_joints)}
    free = {name for name in driven if description.joint_by_name[name].mimic is None}
    blocks = DefinitionBlocks()
    claimed = _add_base(description, semantic, free, blocks, sphere_wheels)
    arms = [arm for arm in semantic.arms if arm.joints and free.issuperset(arm.joints)]
    fingers = {arm.name: [name for name in finger_joints(arm, driven) if name in free] for arm in arms}
    of_arms = {name for arm in arms for name in (*arm.joints, *fingers[arm.name])}
    head = [name for name in semantic.head_joints if name in free - claimed - of_arms]
    trunk = [name for name in semantic.trunk_joints if name in free - claimed - of_arms - set(head)]
    left = free - claimed - of_arms - {*head, *trunk, *_undriven(description, semantic)}
    trunk += [name for name in driven if name in left]
    if trunk:
        links = [driven[name] for name in trunk]
        blocks.trunk["articulated_trunk"] = {"trunk_link_names": links, "trunk_joint_names": trunk}
        blocks.controllers["trunk"] = "JointController"
    if head:
        blocks.camera["active_camera"] = {"camera_joint_names": head}
        blocks.controllers["camera"] = "JointController"
    _add_arms(description, arms, fingers, driven, arm_controller, blocks)
    if arms and rest is not None:
        _add_workspaces(description, semantic, arms, rest, blocks.manipulation["manipulation"])
    return blocks


def finger_joints(arm: Arm, child_of: Mapping[str, str]) -> tuple[str, ...]:
    """Return the driven joints of an arm's gripper: those stated or found, else all that move its links.

    Args:
        arm: with or without a gripper.
        child_of: joint of one degree of freedom to its child link.
    """
    effector = arm.end_effector
    known = effector.gripper_joints or (() if effector.gripper is None else effector.gripper.joints)
    return known or tuple(name for name, link in child_of.items() if link in effector.gripper_links)


def opening_direction(arm: Arm, fingers: Iterable[str]) -> str | dict[str, list[str]] | None:
    """Return the direction of the finger joints that opens an arm's gripper; the joints of each
    direction where they differ.

    None where all increase, as drives take it by default, or where nothing is known.
    """
    gripper = arm.end_effector.gripper
    ways = {} if gripper is None else {name: way for name in fingers if (way := gripper.opening_of.get(name))}
    if not ways or all(ways.get(n) == "increasing" for n in fingers):
        return None
    if all(ways.get(n) == "decreasing" for n in fingers):
        return "decreasing"
    listed = {way: [name for name, own in ways.items() if own == way] for way in ("increasing", "decreasing")}
    return {way: names for way, names in listed.items() if names}


def wheel_sides(semantic: SemanticDescription) -> tuple[tuple[Wheel, ...], tuple[Wheel, ...]] | None:
    """Return the driven wheels on the left and on the right of a differential or skid-steered base, front
    first; None for other bases.
    """
    if semantic.base != "differential" or semantic.virtual_joints:
        return None
    wheels = semantic.driven_wheels
    forward, up = np.asarray(semantic.forward), np.asarray(semantic.up)
    to_left = np.cross(up, forward)
    places = {wheel.joint: np.asarray(wheel.centre) for wheel in wheels}
    middle = np.mean([place @ to_left for place in places.values()]) if places else 0.0
    ordered = sorted(wheels, key=lambda wheel: -float(places[wheel.joint] @ forward))
    left = tuple(wheel for wheel in ordered if places[wheel.joint] @ to_left > middle)
    right = tuple(wheel for wheel in ordered if places[wheel.joint] @ to_left < middle)
    return (left, right) if left and len(left) == len(right) else None


def _add_base(
    description: RobotDescription,
    semantic: SemanticDescription,
    free: set[str],
    blocks: DefinitionBlocks,
    sphere_wheels: bool,
) -> set[str]:
    """Add the blocks of the base, and return the joints that no other group may have."""
    floor = [*semantic.wheel_links, *semantic.caster_links]
    if semantic.virtual_joints:
        blocks.base["holonomic_base"] = {"force_sphere_wheel_approximation": sphere_wheels}
        sliding = semantic.wheel_links or lowest_links(description, semantic)
        blocks.base["locomotion"] = _locomotion(semantic.base_joints, sliding)
        blocks.controllers["base"] = "HolonomicBaseJointController"
        return {*semantic.base_joints, *semantic.virtual_joints}
    sides, pair = wheel_sides(semantic), semantic.wheel_pair
    if sides is not None:
        left, right = sides
        radius = float(np.mean([wheel.radius for wheel in (*left, *right)]))
        to_left = np.cross(semantic.up, semantic.forward)
        across = [np.mean([np.asarray(w.centre) @ to_left for w in side]) for side in sides]
        _add_two_wheel(blocks, radius, float(across[0] - across[1]))
        joints = [wheel.joint for wheel in (*left, *right)]
    elif pair is not None:
        _add_two_wheel(blocks, pair.radius, pair.length)
        joints = [pair.left, pair.right]
    elif semantic.legs:
        joints = [
            name for leg in semantic.legs for name in (*leg.joints, leg.wheel_joint) if name is not None
        ]
        floor = [leg.foot for leg in semantic.legs]
    else:
        joints = [*semantic.base_joints, *semantic.steer_joints]
    joints = [name for name in dict.fromkeys(joints) if name in free]
    if not joints:
        return set()
    if "two_wheel" in blocks.base:
        floor += fixed_casters(description, semantic, blocks.base["two_wheel"]["wheel_radius"])
    blocks.base["locomotion"] = _locomotion(joints, floor)
    blocks.controllers["base"] = (
        "DifferentialDriveController" if "two_wheel" in blocks.base else "JointController"
    )
    return set(joints)


def _add_two_wheel(blocks: DefinitionBlocks, radius: float, length: float) -> None:
    blocks.base["two_wheel"] = {"wheel_radius": round(radius, 4), "wheel_axle_length": round(length, 4)}


def _ways_to_move(description: RobotDescription, arm: Arm) -> int:
    """Return the largest rank of the arm's Jacobian, in random postures and in units of its reach."""
    chain = from_description(description, arm.end_effector.link)
    own = [k for k, name in enumerate(chain.joint_names) if name in arm.joints]
    rng = np.random.default_rng(0)
    low, high = np.maximum(chain.lower, -np.pi), np.minimum(chain.upper, np.pi)
    best = 0
    for _ in range(POSTURES):
        moves = jacobian(chain, rng.uniform(low, high))[:, own]
        moves[:3] /= max(float(np.abs(moves[:3]).max(initial=0.0)), 1e-9)
        best = max(best, int(np.linalg.matrix_rank(moves, tol=INDEPENDENT)))
    return best


def _locomotion(joints: Iterable[str], floor: Iterable[str]) -> dict[str, list[str]]:
    return {
        "base_joint_names": list(joints),
        "floor_touching_base_link_names": list(dict.fromkeys(floor)),
    }


def _undriven(description: RobotDescription, semantic: SemanticDescription) -> set[str]:
    """Return the joints that nothing drives: of casters, suspensions, followers, wheels and propellers, and
    those by which the world guides a walker.
    """
    found = {*semantic.caster_joints}
    if semantic.base == "legged" and not semantic.virtual_joints:
        found |= {*guide_joints(description, semantic.base_link)}
    found |= {
        joint.name for joint in description.joints if joint.child in semantic.caster_links and joint.is_moving
    }
    for wheel in semantic.wheels:
        found |= {wheel.joint, *wheel.suspension_joints}
    for gripper in semantic.grippers:
        found |= {*gripper.mimic_joints}
    for arm in semantic.arms:
        if arm.end_effector.gripper is not None:
            found |= {*arm.end_effector.gripper.mimic_joints}
    if semantic.kind == "drone":
        found |= {joint.name for joint in description.joints if joint.position_limits() is None}
    return found


def _add_arms(
    description: RobotDescription,
    arms: list[Arm],
    fingers: Mapping[str, list[str]],
    child_of: Mapping[str, str],
    arm_controller: str,
    blocks: DefinitionBlocks,
) -> None:
    """Add the `manipulation` block."""
    if not arms:
        return
    blocks.manipulation["manipulation"] = {
        "n_arms": len(arms),
        "arm_names": [arm.name for arm in arms],
        "arm_link_names": {arm.name: [child_of[joint] for joint in arm.joints] for arm in arms},
        "arm_joint_names": {arm.name: list(arm.joints) for arm in arms},
        "eef_link_names": {arm.name: arm.end_effector.link for arm in arms},
        "finger_link_names": {arm.name: list(arm.end_effector.gripper_links) for arm in arms},
        "finger_joint_names": {arm.name: fingers[arm.name] for arm in arms},
    }
    for key, name in GRASP_POINTS.items():
        points = {arm.name: _points(description, arm, name) for arm in arms}
        if any(points.values()):
            blocks.manipulation["manipulation"][key] = {arm: own for arm, own in points.items() if own}
    ways = {arm.name: opening_direction(arm, fingers[arm.name]) for arm in arms}
    if any(way is not None for way in ways.values()):
        known = {name: way for name, way in ways.items() if way is not None}
        blocks.manipulation["manipulation"]["opening_direction"] = known
    for arm in arms:
        poses = len(arm.joints) >= MIN_IK_JOINTS and _ways_to_move(description, arm) >= MIN_IK_JOINTS
        blocks.controllers[f"arm_{arm.name}"] = arm_controller if poses else "JointController"
        if fingers[arm.name]:
            limits = [description.joint_by_name[name].position_limits() for name in fingers[arm.name]]
            bounded = all(limit is not None for limit in limits)
            blocks.controllers[f"gripper_{arm.name}"] = (
                "MultiFingerGripperController" if bounded else "JointController"
            )


def _points(description: RobotDescription, arm: Arm, field: str) -> list[list[Any]]:
    """Return an arm's grasp points as plain data; none where the import merged one of their links."""
    gripper = arm.end_effector.gripper
    points = () if gripper is None else getattr(gripper, field)
    if not all(link in description.link_by_name for link, _ in points):
        return []
    return [[link, list(point)] for link, point in points]


def _add_workspaces(
    description: RobotDescription,
    semantic: SemanticDescription,
    arms: list[Arm],
    rest: Mapping[str, float],
    block: dict[str, Any],
) -> None:
    """Add `arm_workspace_range`, where an arm reaches anything beside the base."""
    known = {name: value for name, value in rest.items() if name in description.joint_by_name}
    ranges = {arm.name: workspace_range(description, arm, semantic.base_link, known) for arm in arms}
    found = {name: list(limits) for name, limits in ranges.items() if limits is not None}
    if found:
        block["arm_workspace_range"] = found
