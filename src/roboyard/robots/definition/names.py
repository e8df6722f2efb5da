"""All links and joints in a definition, each with its location in the file."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from roboyard.robots.definition.schema import RobotDefinition

Where = tuple[str | int, ...]
"""Keys and list indices from the top of the file."""
Found = Iterator[tuple[Where, str]]
"""Locations with a name or a message."""


def link_names(definition: RobotDefinition) -> Found:
    """Yield every link name in a definition, with its location in the file."""
    if definition.base_footprint_link_name is not None:
        yield ("base_footprint_link_name",), definition.base_footprint_link_name
    for i, pair in enumerate(definition.disabled_collision_pairs or ()):
        for k, name in enumerate(pair):
            yield ("disabled_collision_pairs", i, k), name
    yield from _listed(definition.disabled_collision_link_names, ("disabled_collision_link_names",))
    if definition.locomotion is not None:
        names = definition.locomotion.floor_touching_base_link_names
        yield from _listed(names, ("locomotion", "floor_touching_base_link_names"))
    if definition.articulated_trunk is not None:
        names = definition.articulated_trunk.trunk_link_names
        yield from _listed(names, ("articulated_trunk", "trunk_link_names"))
    block = definition.manipulation
    if block is None:
        return
    top: Where = ("manipulation",)
    for key in ("arm_link_names", "finger_link_names", "gripper_link_names"):
        for arm, names in (getattr(block, key) or {}).items():
            yield from _listed(names, (*top, key, arm))
    for arm, name in block.eef_link_names.items():
        yield (*top, "eef_link_names", arm), name
    for key in ("assisted_grasp_start_points", "assisted_grasp_end_points"):
        for arm, points in (getattr(block, key) or {}).items():
            for i, (name, _) in enumerate(points):
                yield (*top, key, arm, i, 0), name
    yield from _listed(block.manipulation_link_names, (*top, "manipulation_link_names"))


def joint_names(definition: RobotDefinition) -> Found:
    """Yield every joint name in a definition, with its location in the file."""
    if definition.locomotion is not None:
        yield from _listed(definition.locomotion.base_joint_names, ("locomotion", "base_joint_names"))
    if definition.articulated_trunk is not None:
        names = definition.articulated_trunk.trunk_joint_names
        yield from _listed(names, ("articulated_trunk", "trunk_joint_names"))
    if definition.active_camera is not None:
        yield from _listed(
            definition.active_camera.camera_joint_names, ("active_camera", "camera_joint_names")
        )
    if definition.mobile_manipulation is not None:
        yield from _listed(definition.mobile_manipulation.joint_names, ("mobile_manipulation", "joint_names"))
    if definition.manipulation is not None:
        for key in ("arm_joint_names", "finger_joint_names"):
            for arm, names in getattr(definition.manipulation, key).items():
                yield from _listed(names, ("manipulation", key, arm))


def _listed(names: Sequence[str] | None, where: Where) -> Found:
    for i, name in enumerate(names or ()):
        yield (*where, i), name
