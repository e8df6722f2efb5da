"""Write a source configuration with the reasons for each value as comments."""

from __future__ import annotations

import textwrap
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import yaml

from roboyard.description.semantic import Conclusion, SemanticDescription
from roboyard.importer.config.schema import ImportConfig, SensorLink

WIDTH = 110
THIN = 0.6
"""Confidence below which a conclusion is a question to the user."""


def config_text(config: ImportConfig, semantic: SemanticDescription, urdf: Path) -> str:
    """Return a configuration as YAML in which each value has its evidence and confidence as a comment.

    Args:
        config: all values.
        semantic: the conclusions.
        urdf: path of the robot file, as it is written.
    """
    found = {conclusion.field: conclusion for conclusion in semantic.conclusions}
    blocks = [
        _head(config, semantic),
        _top(config, urdf),
        _understanding(config, found),
        _base_motion(config, found),
        _collision(config),
        _sensors(config, found),
        _curobo(config, found, semantic),
    ]
    return "\n\n".join("\n".join(block) for block in blocks) + "\n"


def _head(config: ImportConfig, semantic: SemanticDescription) -> list[str]:
    lines = _comment(
        f"Source configuration of {config.name}, inferred from its description. Each value has its "
        "confidence and reasons; a changed value replaces what is inferred. Importing this file unchanged "
        "gives the same package as importing the description alone.",
        "",
    )
    thin = [found for found in semantic.conclusions if found.confidence < THIN]
    lines += ["#", "# Please check, the evidence is thin:"] if thin else []
    for found in thin:
        lines += _comment(f"- {_field(found)} is {_shown(found.value)}? {_because(found)}", "")
    return lines


def _top(config: ImportConfig, urdf: Path) -> list[str]:
    lines = [f"urdf_path: {_value(str(urdf))}", f"name: {_value(config.name)}"]
    if config.dataset_name != ImportConfig.model_fields["dataset_name"].default:
        lines.append(f"dataset_name: {_value(config.dataset_name)}")
    if config.xacro_args:
        lines.append(f"xacro_args: {_value(dict(config.xacro_args))}")
    if config.missing_meshes is not None:
        lines.append(f"missing_meshes: {_value(config.missing_meshes)}")
    return [
        *lines,
        f"category: {_value(config.category)}",
        f"overwrite: {_value(config.overwrite)}  # true replaces an import of this name",
        f"merge_fixed_joints: {_value(config.merge_fixed_joints)}  # true joins links behind fixed joints",
        f"canonical_frame: {_value(config.canonical_frame)}  # true moves the root link to the floor",
    ]


def _understanding(config: ImportConfig, found: dict[str, Conclusion]) -> list[str]:
    stated = config.understanding
    lines = ["understanding:"]
    for key in ("kind", "base", "steer_joints", "caster_joints", "head_joints"):
        lines += _reasons(found.get(key), "  ")
        lines.append(f"  {key}: {_value(getattr(stated, key))}")
    for key in ("legs", "arms", "opening"):
        lines += _mapping(key, getattr(stated, key) or {}, found)
    for conclusion in found.values():
        if conclusion.field.startswith("imu_links."):
            lines += _reasons(conclusion, "  ", name=conclusion.value)
    lines.append(f"  imu_links: {_value(stated.imu_links or [])}")
    return lines


def _mapping(key: str, values: dict[str, Any], found: dict[str, Conclusion]) -> list[str]:
    if not values:
        return [f"  {key}: {{}}"]
    lines = [f"  {key}:"]
    for name, value in values.items():
        lines += _reasons(found.get(f"{key}.{name}"), "    ")
        lines.append(f"    {_value(name)}: {_value(value)}")
    return lines


def _base_motion(config: ImportConfig, found: dict[str, Conclusion]) -> list[str]:
    motion = config.base_motion
    return [
        "base_motion:",
        *_reasons(found.get("drive_wheels"), "  "),
        f"  wheel_links: {_value(motion.wheel_links)}",
        f"  wheel_joints: {_value(motion.wheel_joints)}  # fixed where virtual joints move the base",
        f"  use_sphere_wheels: {_value(motion.use_sphere_wheels)}",
        f"  use_holonomic_joints: {_value(motion.use_holonomic_joints)}  # six virtual joints move the base",
    ]


def _collision(config: ImportConfig) -> list[str]:
    shapes = config.collision
    return [
        "collision:  # usable collision shapes of the file are kept; these lists override that",
        f"  decompose_method: {_value(shapes.decompose_method)}  # coacd, convex or null",
        f"  hull_count: {_value(shapes.hull_count)}",
        f"  coacd_links: {_value(shapes.coacd_links)}",
        f"  convex_links: {_value(shapes.convex_links)}",
        f"  no_decompose_links: {_value(shapes.no_decompose_links)}",
        f"  no_collision_links: {_value(shapes.no_collision_links)}",
    ]


def _sensors(config: ImportConfig, found: dict[str, Conclusion]) -> list[str]:
    lines: list[str] = []
    kinds = (("camera_links", config.camera_links), ("lidar_links", config.lidar_links))
    lines += [f"eef_vis_links: {_value([_entry(e) for e in config.eef_vis_links])}  # markers"]
    for key, entries in kinds:
        for conclusion in found.values():
            if conclusion.field.startswith(f"{key}."):
                lines += _reasons(conclusion, "", name=conclusion.value)
        lines.append(f"{key}:{'' if entries else ' []'}")
        lines += [f"  - {_value(_entry(entry))}" for entry in entries]
    return lines


def _entry(entry: SensorLink) -> dict[str, Any]:
    offset = {"position": list(entry.offset.position), "orientation": list(entry.offset.orientation)}
    parent = {} if entry.parent_link is None else {"parent_link": entry.parent_link}
    return {"link": entry.link, **parent, "offset": offset}


def _curobo(config: ImportConfig, found: dict[str, Conclusion], semantic: SemanticDescription) -> list[str]:
    curobo = config.curobo
    lines = ["curobo:"]
    grippers = curobo.eef_to_gripper_info
    lines.append(f"  eef_to_gripper_info:{'' if grippers else ' {}'}")
    names = {arm.end_effector.link: arm.name for arm in semantic.arms}
    for link, gripper in grippers.items():
        lines += _reasons(found.get(f"grippers.{names.get(link, link)}"), "    ")
        lines.append(f"    {_value(link)}:")
        lines += [f"      links: {_value(gripper.links)}", f"      joints: {_value(gripper.joints)}"]
    lines += _reasons(found.get("trunk_joints"), "  ")
    lines.append(f"  torso_joints: {_value(curobo.torso_joints)}")
    lines += [
        f"  flip_joint_limits: {_value(curobo.flip_joint_limits)}",
        f"  lock_joints: {_value(dict(curobo.lock_joints))}",
        f"  sphere_preset: {_value(curobo.sphere_preset)}  # balanced, tight or safe",
        "  # Computed where they are missing: default_qpos (rest posture), self_collision_ignore,",
        "  # self_collision_buffer and collision_spheres.",
    ]
    return lines


def _reasons(found: Conclusion | None, indent: str, name: str = "") -> list[str]:
    if found is None:
        return []
    start = f"{name}: " if name else ""
    return _comment(f"{start}{100 * found.confidence:.0f} % sure. {_because(found)}", indent)


def _because(found: Conclusion) -> str:
    reasons = [reason for reason in found.evidence if reason]
    if not reasons:
        return "Nothing speaks against it."
    text = "; ".join(reasons)
    return f"{text[:1].upper()}{text[1:]}."


def _field(found: Conclusion) -> str:
    return found.field.replace("_", " ").replace(".", " ")


def _shown(value: Any) -> str:
    return ", ".join(map(str, value)) if isinstance(value, list) else str(value)


def _comment(text: str, indent: str) -> list[str]:
    """Return a comment of several lines; line breaks inside the text become blanks."""
    start = f"{indent}# "
    lines = textwrap.wrap(" ".join(text.split()), WIDTH - len(start), break_long_words=False)
    return [start + line for line in lines]


def _value(value: Any) -> str:
    """Return a value as YAML on one line."""
    text = yaml.safe_dump(
        _plain(value), default_flow_style=True, width=10**9, allow_unicode=True, sort_keys=False
    )
    return text.removesuffix("\n").removesuffix("\n...")


def _plain(value: Any) -> Any:
    if isinstance(value, dict):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, str):
        return str(value)
    if isinstance(value, Sequence) or (isinstance(value, Iterable) and not isinstance(value, bytes)):
        return [_plain(item) for item in value]
    return value
