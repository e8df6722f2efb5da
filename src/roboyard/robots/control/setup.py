"""Create controllers from configurations: defaults by group, overridden by the user's keys."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from pydantic import ValidationError

from roboyard.description.model import RobotDescription
from roboyard.errors import ConfigError, unknown_name
from roboyard.kinematics import ChainArrays, from_description
from roboyard.robots.control import REGISTERED_CONTROLLERS, Controller, GroupLimits
from roboyard.robots.control.task import TaskController
from roboyard.robots.definition.groups import GroupPlan, opening_signs
from roboyard.robots.definition.schema import RobotDefinition
from roboyard.robots.joint_arrays import Indices
from roboyard.robots.limits import select_limits
from roboyard.robots.stability.wheels import forward_in, rolling_signs
from roboyard.transforms import Array

ControllerConfig = Mapping[str, str | Mapping[str, Any]]
"""Group to a controller's name, or to its keys (with `name` for another controller than the default)."""


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Group:
    """A group of joints with its controller."""

    name: str
    kind: str
    """base, trunk, camera, arm or gripper."""
    joints: tuple[str, ...]
    indices: Indices
    """(n,) indices of the joints in the robot's joint vectors."""
    controller: Controller
    mount: ChainArrays | None = None
    """Chain from the robot's base frame to the parent frame of the group (for a holonomic base: from the
    frame of the virtual joints to the base); None where the controller does not need it."""
    mount_indices: Indices | None = None
    """(m,) indices of that chain's joints in the robot's joint vectors."""


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Setup:
    """The robot that controllers are created for."""

    definition: RobotDefinition
    description: RobotDescription
    joint_names: tuple[str, ...]
    limits: GroupLimits
    base_link: str
    """The link whose frame is the robot's base frame."""
    reset_posture: Array | None
    action_normalize: bool
    scale: float = 1.0
    """Factor on all lengths of the description."""


def make_groups(setup: Setup, plans: Mapping[str, GroupPlan], config: ControllerConfig) -> dict[str, Group]:
    """Return the groups with their controllers, in action order; subsumed groups are omitted.

    Raises:
        ConfigError: a group, controller or key does not exist or does not fit; the message states it.
    """
    for name in config:
        if name not in plans:
            raise ConfigError(f"controllers: {unknown_name('group', name, plans)}")
    chosen = setup.definition.controller_names()
    keys = {name: _keys_of(name, config.get(name, {}), chosen[name], setup) for name in plans}
    subsumed = _subsumed(plans, keys)
    groups = {}
    for name, plan in plans.items():
        if name in subsumed:
            continue
        subsumed_joints = tuple(
            joint for other in keys[name].get("subsume_controllers", ()) for joint in plans[other].joints
        )
        groups[name] = _group(setup, replace(plan, joints=(*subsumed_joints, *plan.joints)), keys[name])
    return groups


def _keys_of(group: str, given: str | Mapping[str, Any], default: str, setup: Setup) -> dict[str, Any]:
    """Return all keys of a group's controller."""
    given = {"name": given} if isinstance(given, str) else dict(given)
    name = given.get("name", default)
    allowed = setup.definition.allowed_controllers()[group]
    if name not in allowed:
        raise ConfigError(
            f"controllers.{group}.name: {unknown_name('controller for this group', str(name), allowed)}"
        )
    keys = {"name": name, **_defaults(group, name, setup), **given}
    if setup.action_normalize:
        keys["command_input_limits"] = "default"
    elif "command_input_limits" not in given:
        keys["command_input_limits"] = None
    return keys


def _defaults(group: str, name: str, setup: Setup) -> dict[str, Any]:
    """Return the default keys of a group (OmniGibson's)."""
    kind = group.split("_", 1)[0]
    if name == "JointController":
        if kind in ("arm", "trunk", "camera"):
            return {"motor_type": "position", "use_delta_commands": True, "command_output_limits": None}
        if kind == "base" and _is_legged(setup):
            return {"motor_type": "position", "use_delta_commands": True, "command_output_limits": None}
        return {"motor_type": "velocity"}
    if name == "NullJointController":
        return {"motor_type": "velocity" if kind in ("base", "gripper") else "position"}
    wheels = setup.definition.two_wheel
    if name == "DifferentialDriveController" and wheels is not None:
        return {"wheel_radius": wheels.wheel_radius, "wheel_axle_length": wheels.wheel_axle_length}
    return {}


def _is_legged(setup: Setup) -> bool:
    """Return whether most joints of the base have position limits, as legs do, also those that end in wheels;
    wheels and the joints that steer them do not.
    """
    block = setup.definition.locomotion
    if block is None or setup.definition.holonomic_base is not None:
        return False
    index = {name: i for i, name in enumerate(setup.joint_names)}
    indices = [index[name] for name in block.base_joint_names if name in index]
    limited = np.isfinite(setup.limits.lower[indices])
    return bool(indices and limited.mean() > 0.5)


def _subsumed(plans: Mapping[str, GroupPlan], keys: Mapping[str, Mapping[str, Any]]) -> set[str]:
    found: set[str] = set()
    for name, own in keys.items():
        for other in own.get("subsume_controllers", ()):
            where = f"controllers.{name}.subsume_controllers"
            if other not in plans:
                raise ConfigError(f"{where}: {unknown_name('group', str(other), plans)}")
            if other == name or keys[other].get("subsume_controllers"):
                raise ConfigError(f"{where}: {other!r} subsumes groups itself; name groups that do not")
            if other in found:
                raise ConfigError(f"{where}: {other!r} is subsumed by another group already")
            found.add(other)
    return found


def _group(setup: Setup, plan: GroupPlan, keys: Mapping[str, Any]) -> Group:
    cls = REGISTERED_CONTROLLERS[keys["name"]]
    where = f"controllers.{plan.name}"
    try:
        settings = cls.Settings.model_validate(dict(keys))
    except ValidationError as error:
        raise ConfigError("\n".join(_message(where, detail, cls) for detail in error.errors())) from None
    extra: dict[str, Any] = {}
    mount: ChainArrays | None = None
    joints = plan.joints
    try:
        if issubclass(cls, TaskController):
            chain, mount, extra = _chains(setup, plan, where)
            joints = chain.joint_names
        elif keys["name"] == "HolonomicBaseJointController":
            mount = scaled(from_description(setup.description, setup.base_link), setup.scale)
        elif keys["name"] == "DifferentialDriveController":
            extra = {
                "signs": rolling_signs(setup.definition, setup.description),
                "forward": forward_in(setup.base_link, setup.definition, setup.description),
            }
        elif keys["name"] == "MultiFingerGripperController":
            extra = {"opening": opening_signs(setup.definition, plan)}
        index = {name: i for i, name in enumerate(setup.joint_names)}
        indices = np.array([index[name] for name in joints], dtype=np.intp)
        if keys["name"] == "NullJointController" and "default_goal" not in keys:
            settings = settings.model_copy(update={"default_goal": _null_goal(setup, plan, indices, where)})
        make: Any = cls
        controller = make(select_limits(setup.limits, indices), settings, **extra)
    except ConfigError as error:
        text = str(error)
        raise ConfigError(
            text if text.startswith((where, "default_joint_pos")) else f"{where}: {text}"
        ) from None
    return Group(
        name=plan.name,
        kind=plan.kind,
        joints=tuple(joints),
        indices=indices,
        controller=controller,
        mount=mount,
        mount_indices=None
        if mount is None
        else np.array([index[n] for n in mount.joint_names], dtype=np.intp),
    )


def _null_goal(setup: Setup, plan: GroupPlan, indices: Indices, where: str) -> tuple[float, ...]:
    if plan.kind in ("base", "gripper"):
        return (0.0,) * len(indices)
    return tuple(_reset(setup, where)[indices])


def _reset(setup: Setup, where: str) -> Array:
    if setup.reset_posture is None:
        raise ConfigError(
            f"default_joint_pos: is required because of {where}, which needs a rest posture;"
            f" give {len(setup.joint_names)} values (zeros are a start)"
        )
    return setup.reset_posture


def _chains(setup: Setup, plan: GroupPlan, where: str) -> tuple[ChainArrays, ChainArrays, dict[str, Any]]:
    """Return the group's chain, the chain to its parent frame, and further arguments of the controller."""
    assert plan.tip is not None
    description = setup.description
    above = _joints_above(description, plan.tip)
    own = [name for name in above if name in plan.joints]
    missing = [name for name in plan.joints if name not in own]
    if missing:
        raise ConfigError(f"{where}: joint {missing[0]!r} does not lead to the link {plan.tip!r}")
    posture = dict(zip(setup.joint_names, _reset(setup, where), strict=True))
    parent = description.joint_by_name[own[0]].parent
    between = [name for name in above[above.index(own[0]) :] if name not in own]
    locked = {name: posture[name] for name in between if name in posture}
    chain = scaled(from_description(description, plan.tip, parent, locked), setup.scale)
    try:
        mount = scaled(from_description(description, parent, setup.base_link), setup.scale)
    except ValueError:
        raise ConfigError(
            f"{where}: link {parent!r} is not below the base link {setup.base_link!r};"
            " correct base_footprint_link_name"
        ) from None
    rest = np.array([posture[name] for name in chain.joint_names])
    return chain, mount, {"chain": chain, "rest": rest}


def scaled(chain: ChainArrays, factor: float) -> ChainArrays:
    """Return the chain of a robot scaled by a factor."""
    if factor == 1.0:
        return chain
    slides = np.zeros(chain.size, dtype=bool)
    slides[chain.q_index[chain.is_prismatic]] = True
    by_joint = np.where(slides, factor, 1.0)
    return replace(
        chain,
        lower=chain.lower * by_joint,
        upper=chain.upper * by_joint,
        origin_position=chain.origin_position * factor,
        link_position=chain.link_position * factor,
        offset=chain.offset * np.where(chain.is_prismatic, factor, 1.0),
    )


def _joints_above(description: RobotDescription, link: str) -> list[str]:
    """Return the names of the moving joints from the root to a link."""
    found: list[str] = []
    while link in description.parent_joint:
        joint = description.parent_joint[link]
        if joint.is_moving:
            found.append(joint.name)
        link = joint.parent
    return found[::-1]


def _message(where: str, detail: Any, cls: type[Controller]) -> str:
    place = ".".join(str(part) for part in detail["loc"])
    key = f"{where}.{place}" if place else where
    match detail["type"]:
        case "extra_forbidden":
            return f"{key}: {unknown_name('key', str(detail['loc'][-1]), cls.Settings.model_fields)}"
        case "value_error":
            return f"{key}: {detail['ctx']['error']}"
        case "literal_error":
            return f"{key}: must be one of {detail['ctx']['expected']}"
        case _:
            return f"{key}: {detail['msg'][0].lower()}{detail['msg'][1:]}"
