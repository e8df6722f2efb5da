"""Add a robot with its controllers to a world."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from roboyard._arrays import ArrayLike
from roboyard.description.loader import FORMATS
from roboyard.description.model import RobotDescription
from roboyard.description.robot_model import RobotModel
from roboyard.errors import ConfigError
from roboyard.robots.capabilities.assisted_grasp import GraspingMode
from roboyard.robots.control.setup import ControllerConfig
from roboyard.robots.definition.description_edits import edit_description
from roboyard.robots.definition.end_effectors import description_with, with_end_effector
from roboyard.robots.definition.from_description import default_definition
from roboyard.robots.definition.guides import world_guides
from roboyard.robots.definition.load import check_fits, load_definition, parse_definition
from roboyard.robots.definition.postures import ResetMode
from roboyard.robots.definition.schema import RobotDefinition
from roboyard.robots.placement import stand_on_floor
from roboyard.robots.registry import REGISTERED_ROBOTS, RegisteredRobot, is_definition_file, packaged_robot
from roboyard.robots.robot import Robot
from roboyard.robots.sensor_set import ObsModalities, SensorOptions
from roboyard.robots.stability.casters import with_casters
from roboyard.robots.stability.wheels import driven_wheels
from roboyard.sim.body import Body
from roboyard.sim.world import World
from roboyard.transforms import multiply

RobotSource = str | Path | RegisteredRobot | RobotDescription | RobotModel
"""A registered name, a robot file, a definition file, a registered robot, a description or a model."""
DefinitionSource = str | Path | Mapping[str, Any] | RobotDefinition
"""A definition file, its data, or a loaded definition."""
FILE_SUFFIXES = {".xacro", *(suffix for fmt in FORMATS for suffix in fmt.suffixes)}
"""Endings of texts that are files, not names of registered robots."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Source:
    """A robot before it is in a world."""

    model: str
    """Name of the kind of robot."""
    description: RobotDescription
    definition: RobotDefinition
    definition_file: Path | None = None
    sensor_file: Path | None = None
    """MJCF of the import, which has the frames of cameras and lidars."""


def add_robot(
    world: World,
    robot: RobotSource,
    position: ArrayLike = (0, 0, 0),
    orientation: ArrayLike = (0, 0, 0, 1),
    *,
    controllers: ControllerConfig | None = None,
    fixed_base: bool | None = None,
    self_collision: bool | None = None,
    definition: DefinitionSource | None = None,
    name: str | None = None,
    end_effector: str | None = None,
    scale: float = 1.0,
    control_freq: float | None = None,
    action_normalize: bool = True,
    reset_joint_pos: ArrayLike | None = None,
    default_reset_mode: ResetMode = "untuck",
    sensor_options: SensorOptions | None = None,
    on_floor: bool | None = None,
    grasping_mode: GraspingMode = "physical",
    obs_modalities: ObsModalities = "all",
) -> Robot:
    """Add a robot with its controllers to a world.

    Args:
        world: that the robot is added to.
        robot: a registered name ("r1"), a robot file (see `load_description`), the definition file of an
            import (`models/mine/mine.yaml`), one of `REGISTERED_ROBOTS`, a description or a model.
        position: (3,) of the root link's frame in the world frame (m). See `on_floor`.
        orientation: (4,) quaternion x, y, z, w of the root link's frame in the world frame; where the file is
            drawn with another axis up, of that frame after the definition's `standing_orientation`.
        controllers: group to a controller's name, or to its keys; the definition's by default.
        fixed_base: attach the root link to the world. None: robots that walk or drive on wheels float, all
            others are fixed (a holonomic base moves by its virtual joints, a planar walker by the joints
            between its root link, which is the world, and its base).
        self_collision: whether links of the robot collide with each other. None: as the definition's
            `self_collisions`, else True.
        definition: a definition file, its data, or a loaded definition. None: that of a registered robot; for
            other sources `default_definition`, with joint controllers for all driven joints.
        name: in the world; the robot's own by default.
        end_effector: one of the definition's `manipulation.end_effectors`.
        scale: uniform factor on all lengths.
        control_freq: rate at which controllers compute drive targets (Hz); 30 by default.
        action_normalize: scale actions to the range -1 to 1.
        reset_joint_pos: (n,) joint positions of a reset, in the order of `Robot.joint_names` (rad or m); the
            definition's by default.
        default_reset_mode: posture of the definition's `mobile_manipulation` block to start in.
        sensor_options: kind of sensor ("Camera", "Lidar") or link that has one, to keywords of
            `roboyard.sensors.CameraSensor` or `Lidar` (width, rate, pattern, ...).
        on_floor: put the robot's lowest point, visual shapes included, on the surface below `position`. True:
            from any height; False: never, the root frame goes to `position`; None: where `position` is on
            that surface (the spawn pose of a scene is), and where the robot would start inside it.
        grasping_mode: "physical": friction holds objects; "assisted": a closing gripper also takes what is
            between its fingers; "sticky": also objects that any finger touches.
        obs_modalities: modalities that `Robot.observe` returns ("rgb", "depth", "scan", "proprio", ...);
            cameras and lidars that observe none of them are omitted. "all" by default.

    Raises:
        ConfigError: the definition or an option is wrong, or the robot unknown.
        DescriptionError: the robot file cannot be loaded.
    """
    source = load_source(robot, definition, end_effector)
    check_fits(
        source.definition,
        source.description,
        name=source.definition_file.name if source.definition_file else f"definition of {source.model}",
        file=source.definition_file,
        end_effector=end_effector,
    )
    standing, description = with_casters(source.definition, source.description)
    source = replace(source, definition=standing, description=description)
    body, edited = _add_body(
        world, source, position, orientation, fixed_base, self_collision, scale, name or source.model
    )
    try:
        _disable_collision_pairs(world, body, source.definition)
        added = Robot(
            body,
            source.definition,
            edited,
            controllers=controllers,
            control_freq=control_freq,
            action_normalize=action_normalize,
            reset_joint_pos=reset_joint_pos,
            default_reset_mode=default_reset_mode,
            model=source.model,
            sensor_file=source.sensor_file,
            sensor_options=sensor_options,
            grasping_mode=grasping_mode,
            obs_modalities=obs_modalities,
        )
        stand_on_floor(added, on_floor)
    except Exception:
        _remove(world, body)
        raise
    return added


def found_robot(robot: RobotSource) -> RobotSource:
    """Return the registered robot of a name or a definition file; any other source unchanged.

    Raises:
        ConfigError: there is no robot of this name, or no such definition file.
    """
    if isinstance(robot, (str, Path)) and is_definition_file(robot):
        return packaged_robot(robot)
    if isinstance(robot, str) and not is_robot_file(robot):
        return REGISTERED_ROBOTS.find(robot)
    return robot


def load_source(
    robot: RobotSource, definition: DefinitionSource | None = None, end_effector: str | None = None
) -> Source:
    """Return description and definition of a robot, as `add_robot` takes them.

    Raises:
        ConfigError: the definition is wrong, or the robot or its end effector unknown.
        DescriptionError: the robot file cannot be loaded.
    """
    robot = found_robot(robot)
    own, file = (None, None) if definition is None else _read(definition)
    sensor_file = None
    if isinstance(robot, RegisteredRobot):
        model, sensor_file = robot.name, robot.sensors
        if own is None:
            own, file = robot.definition, robot.file
        description = robot.description(own)
    else:
        model, description = _described(robot)
        if own is None:
            own = default_definition(description, robot.semantic if isinstance(robot, RobotModel) else None)
    if end_effector is not None:
        model, own = with_end_effector(own, end_effector)
        if isinstance(robot, RegisteredRobot):
            description = description_with(robot, own, end_effector)
    return Source(
        model=model, description=description, definition=own, definition_file=file, sensor_file=sensor_file
    )


def _described(robot: str | Path | RobotDescription | RobotModel) -> tuple[str, RobotDescription]:
    """Return name and description of a robot that is not registered."""
    if isinstance(robot, RobotDescription):
        return robot.name, robot
    if isinstance(robot, RobotModel):
        return robot.name, robot.description
    from roboyard.description import load_description

    description = load_description(robot)
    return description.name, description


def _add_body(
    world: World,
    source: Source,
    position: ArrayLike,
    orientation: ArrayLike,
    fixed_base: bool | None,
    self_collision: bool | None,
    scale: float,
    name: str,
) -> tuple[Body, RobotDescription]:
    """Add the robot's body, edited by its definition; return body and edited description."""
    definition = source.definition
    guided = bool(world_guides(definition, source.description))
    floats = definition.may_float and not guided if fixed_base is None else not fixed_base
    if floats and definition.holonomic_base is not None:
        raise ConfigError(
            f"fixed_base must not be False for robot {source.model!r}, whose holonomic base moves by its "
            "virtual joints"
        )
    if self_collision is None:
        self_collision = definition.self_collisions is not False
    edited = edit_description(definition, source.description)
    standing = None if definition.standing_orientation is None else np.array(definition.standing_orientation)
    body = world.add_urdf(
        edited,
        position,
        orientation if standing is None else multiply(np.asarray(orientation, dtype=float), standing),
        fixed_base=not floats,
        scale=scale,
        self_collision=self_collision,
        name=name,
    )
    for link, wheel in driven_wheels(definition, source.description).items():
        body.link(link).flatten_spheres(scale * wheel.half_width)
    return body, edited


def _disable_collision_pairs(world: World, body: Body, definition: RobotDefinition) -> None:
    for a, b in definition.disabled_collision_pairs or ():
        if a != b:
            world.filters.set(body.link(a), body.link(b), collide=False)


def _remove(world: World, body: Body) -> None:
    """Remove a body whose robot could not be created, with what the robot registered."""
    for call in tuple(world.before_step):
        owner = getattr(call, "__self__", None)
        if isinstance(owner, Robot) and owner.body is body:
            world.before_step.remove(call)
    world.remove(body)


def is_robot_file(robot: str) -> bool:
    """Return whether a text is the path of a robot file, by its ending, not the name of a robot."""
    return Path(robot).suffix.lower() in FILE_SUFFIXES


def _read(definition: DefinitionSource) -> tuple[RobotDefinition, Path | None]:
    """Return a definition and its file, None where it was given as data."""
    if isinstance(definition, RobotDefinition):
        return definition, None
    if isinstance(definition, Mapping):
        return parse_definition(definition), None
    return load_definition(definition), Path(definition)
