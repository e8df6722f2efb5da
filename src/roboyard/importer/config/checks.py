"""Check a configuration against the robot it is for."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from roboyard.config.yaml_lines import Where
from roboyard.description.model import Joint, RobotDescription
from roboyard.errors import unknown_name
from roboyard.importer.config.schema import ImportConfig, SensorLink, Understanding
from roboyard.kinematics.joint_order import breadth_first_joints, single_dof_joints

VIRTUAL_AXES = ("x", "y", "z", "rx", "ry", "rz")
COLLISION_LISTS = ("no_collision_links", "coacd_links", "convex_links", "no_decompose_links")
"""In order of precedence."""


@dataclass(frozen=True, kw_only=True, slots=True)
class ConfigProblem:
    """A problem of a configuration."""

    where: Where
    """Key path."""
    text: str
    line: int | None = None
    """Line in the file, for problems that the key path does not locate."""
    is_note: bool = False
    """Whether the configuration is usable despite the problem."""


def check_against(config: ImportConfig, description: RobotDescription) -> list[ConfigProblem]:
    """Return the problems of a configuration with its robot.

    They are unknown names, sensors whose link exists and has a parent or neither, and contradicting lists.
    """
    problems: list[ConfigProblem] = []
    problems += _base_motion(config, description)
    problems += _collision(config, description)
    known, sensor_problems = _sensors(config, description)
    problems += sensor_problems
    problems += _curobo(config, description, known)
    problems += _understanding(config, description)
    return problems


def virtual_links() -> tuple[str, ...]:
    """Return the names of a holonomic base's virtual links, root first."""
    return tuple(f"base_footprint_{axis}" for axis in VIRTUAL_AXES)


def virtual_joints() -> tuple[str, ...]:
    """Return the names of a holonomic base's virtual joints, root first."""
    return tuple(f"base_footprint_{axis}_joint" for axis in VIRTUAL_AXES)


def _unknown(kind: str, names: Iterable[str], where: Where, known: Iterable[str]) -> list[ConfigProblem]:
    known = list(known)
    return [
        ConfigProblem(where=(*where, index), text=unknown_name(kind, name, known))
        for index, name in enumerate(names)
        if name not in known
    ]


def _base_motion(config: ImportConfig, description: RobotDescription) -> list[ConfigProblem]:
    base = config.base_motion
    links, joints = description.link_by_name, description.joint_by_name
    problems = _unknown("link", base.wheel_links, ("base_motion", "wheel_links"), links)
    problems += _unknown("joint", base.wheel_joints, ("base_motion", "wheel_joints"), joints)
    for index, name in enumerate(base.wheel_joints):
        joint = joints.get(name)
        if joint is not None and joint.type not in ("revolute", "continuous", "prismatic", "fixed"):
            text = (
                f"joint {name!r} is {joint.type}; only revolute, continuous and prismatic joints can be fixed"
            )
            problems.append(ConfigProblem(where=("base_motion", "wheel_joints", index), text=text))
    if base.use_sphere_wheels and not base.wheel_links:
        text = "is true, but wheel_links is empty; name the wheels"
        problems.append(ConfigProblem(where=("base_motion", "use_sphere_wheels"), text=text, is_note=True))
    if base.use_holonomic_joints:
        taken = [name for name in virtual_links() if name in links]
        taken += [name for name in virtual_joints() if name in joints]
        if taken:
            text = f"the robot already has {taken[0]!r}; rename it, or set this to false"
            problems.append(ConfigProblem(where=("base_motion", "use_holonomic_joints"), text=text))
    return problems


def _collision(config: ImportConfig, description: RobotDescription) -> list[ConfigProblem]:
    problems: list[ConfigProblem] = []
    owner: dict[str, str] = {}
    for key in COLLISION_LISTS:
        names: Sequence[str] = getattr(config.collision, key)
        problems += _unknown("link", names, ("collision", key), description.link_by_name)
        for index, name in enumerate(names):
            first = owner.setdefault(name, key)
            if first != key:
                text = f"link {name!r} is also in {first}, which takes precedence; keep one"
                problems.append(ConfigProblem(where=("collision", key, index), text=text, is_note=True))
    return problems


def _sensors(
    config: ImportConfig, description: RobotDescription
) -> tuple[dict[str, str], list[ConfigProblem]]:
    """Return each link that exists with the sensors (and the key that creates it), and the problems."""
    known = dict.fromkeys(description.link_by_name, "")
    if config.base_motion.use_holonomic_joints:
        known |= dict.fromkeys(virtual_links(), "base_motion.use_holonomic_joints")
    problems: list[ConfigProblem] = []
    for key in ("eef_vis_links", "camera_links", "lidar_links"):
        used: set[str] = set()
        entries: Sequence[SensorLink] = getattr(config, key)
        for index, entry in enumerate(entries):
            where = (key, index)
            if entry.link in used:
                text = f"link {entry.link!r} already has one; a link has at most one sensor of each kind"
                problems.append(ConfigProblem(where=(*where, "link"), text=text))
            used.add(entry.link)
            if entry.parent_link is None:
                if entry.link not in known:
                    text = f"{unknown_name('link', entry.link, known)}; add parent_link to create a link"
                    problems.append(ConfigProblem(where=(*where, "link"), text=text))
                continue
            if entry.parent_link not in known:
                text = f"link {entry.link!r}: {unknown_name('link', entry.parent_link, known)}"
                problems.append(ConfigProblem(where=(*where, "parent_link"), text=text))
            if entry.link in known:
                made = f" (created by {known[entry.link]})" if known[entry.link] else ""
                text = (
                    f"link {entry.link!r} already exists{made}, so it cannot be created below "
                    f"{entry.parent_link!r}; set parent_link to null, or give another link name"
                )
                problems.append(ConfigProblem(where=(*where, "link"), text=text))
            else:
                known[entry.link] = f"{key}[{index}]"
                joint = f"{entry.parent_link}_{entry.link}_joint"
                if joint in description.joint_by_name:
                    text = f"the robot already has a joint {joint!r}; give another link name"
                    problems.append(ConfigProblem(where=(*where, "link"), text=text))
    return known, problems


def _curobo(
    config: ImportConfig, description: RobotDescription, links: dict[str, str]
) -> list[ConfigProblem]:
    curobo = config.curobo
    joints = dict.fromkeys(description.joint_by_name, "")
    if config.base_motion.use_holonomic_joints:
        joints |= dict.fromkeys(virtual_joints(), "")
    problems: list[ConfigProblem] = []
    for name, gripper in curobo.eef_to_gripper_info.items():
        where: Where = ("curobo", "eef_to_gripper_info", name)
        if name not in links:
            problems.append(ConfigProblem(where=where, text=unknown_name("link", name, links)))
        problems += _unknown("link", gripper.links, (*where, "links"), links)
        problems += _unknown("joint", gripper.joints, (*where, "joints"), joints)
    problems += _unknown("joint", curobo.flip_joint_limits, ("curobo", "flip_joint_limits"), joints)
    problems += _unknown("joint", curobo.torso_joints, ("curobo", "torso_joints"), joints)
    problems += [
        ConfigProblem(where=("curobo", "lock_joints", name), text=unknown_name("joint", name, joints))
        for name in curobo.lock_joints
        if name not in joints
    ]
    for key in ("self_collision_ignore", "self_collision_buffer", "collision_spheres"):
        for name in getattr(curobo, key):
            if name not in links:
                problems.append(
                    ConfigProblem(where=("curobo", key, name), text=unknown_name("link", name, links))
                )
    for name, others in curobo.self_collision_ignore.items():
        problems += _unknown("link", others, ("curobo", "self_collision_ignore", name), links)
    problems += _default_qpos(config, description)
    return problems


def _understanding(config: ImportConfig, description: RobotDescription) -> list[ConfigProblem]:
    stated, joints = config.understanding, description.joint_by_name
    problems: list[ConfigProblem] = []
    for key in ("steer_joints", "caster_joints", "head_joints"):
        problems += _unknown("joint", getattr(stated, key) or (), ("understanding", key), joints)
    for key in ("legs", "arms"):
        for name, chain in (getattr(stated, key) or {}).items():
            problems += _unknown("joint", chain, ("understanding", key, name), joints)
    problems += _chains(stated, description) if not problems else []
    links = description.link_by_name
    return problems + _unknown("link", stated.imu_links or (), ("understanding", "imu_links"), links)


def _chains(stated: Understanding, description: RobotDescription) -> list[ConfigProblem]:
    """Return joints that do not move, that two parts claim, or that the joint before them does not carry."""
    problems: list[ConfigProblem] = []
    owner: dict[str, str] = {}
    parts: list[tuple[str, Where, Sequence[str]]] = [
        ("head_joints", ("understanding", "head_joints"), stated.head_joints or ())
    ]
    for key in ("arms", "legs"):
        for name, chain in (getattr(stated, key) or {}).items():
            parts.append((f"{key}.{name}", ("understanding", key, name), chain))
    for label, where, chain in parts:
        for index, name in enumerate(chain):
            joint, place = description.joint_by_name[name], (*where, index)
            first = owner.setdefault(name, label)
            if not joint.is_moving:
                text = f"joint {name!r} is fixed; name joints that move"
            elif first != label:
                text = f"joint {name!r} is also in {first}; a joint belongs to one part"
            elif index and label != "head_joints" and not _goes_on(description, chain, index, label):
                text = (
                    f"joint {name!r} is not carried by {chain[index - 1]!r}; name the joints in their order"
                )
            else:
                continue
            problems.append(ConfigProblem(where=place, text=text))
    return problems


def _goes_on(description: RobotDescription, chain: Sequence[str], index: int, label: str) -> bool:
    """Return whether the joint before carries a joint; one leg may be of several chains from one body."""
    above = joints_above(description, chain[index])
    if chain[index - 1] in above:
        return True
    return label.startswith("legs.") and above == joints_above(description, chain[0])


def joints_above(description: RobotDescription, name: str) -> tuple[str, ...]:
    """Return the moving joints between a joint and the root, nearest first."""
    found: list[str] = []
    link = description.joint_by_name[name].parent
    while link in description.parent_joint:
        joint = description.parent_joint[link]
        found += [joint.name] if joint.is_moving else []
        link = joint.parent
    return tuple(found)


def _default_qpos(config: ImportConfig, description: RobotDescription) -> list[ConfigProblem]:
    given = config.curobo.default_qpos
    where: Where = ("curobo", "default_qpos")
    if given is None:
        return []
    order = single_dof_joints(breadth_first_joints(description), frozen_joints(config))
    if isinstance(given, dict):
        names = [joint.name for joint in order]
        unknown = [
            ConfigProblem(where=(*where, name), text=unknown_name("moving joint", name, names))
            for name in given
            if name not in names
        ]
        return unknown + _outside([(joint, given.get(joint.name)) for joint in order], where, by_name=True)
    if len(given) != len(order):
        shown = ", ".join(joint.name for joint in order[:8]) + (", ..." if len(order) > 8 else "")
        text = (
            f"has {len(given)} values for {len(order)} moving joints ({shown or 'none'}); give one for each"
        )
        return [ConfigProblem(where=where, text=text)]
    return _outside(list(zip(order, given, strict=True)), where, by_name=False)


def _outside(
    values: Sequence[tuple[Joint, float | None]], where: Where, *, by_name: bool
) -> list[ConfigProblem]:
    problems = []
    for index, (joint, value) in enumerate(values):
        limits = joint.position_limits()
        if value is None or limits is None or limits[0] - 1e-4 <= value <= limits[1] + 1e-4:
            continue
        text = f"joint {joint.name!r}: {value:g} is outside its limits [{limits[0]:g}, {limits[1]:g}]"
        problems.append(ConfigProblem(where=(*where, joint.name if by_name else index), text=text))
    return problems


def frozen_joints(config: ImportConfig) -> frozenset[str]:
    """Return the joints that the import fixes."""
    base = config.base_motion
    return frozenset(base.wheel_joints) if base.use_holonomic_joints else frozenset()
