"""Put a robot into a world."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from numpy.typing import ArrayLike

from roboyard.description.model import RobotDescription
from roboyard.errors import ConfigError
from roboyard.robots.backends import Backend
from roboyard.robots.control.setup import ControllerConfig
from roboyard.robots.definition.description_edits import edited
from roboyard.robots.definition.end_effectors import description_with, with_end_effector
from roboyard.robots.definition.load import check_fits, load_definition, parse_definition
from roboyard.robots.definition.postures import ResetMode
from roboyard.robots.definition.schema import RobotDefinition
from roboyard.robots.registry import REGISTERED_ROBOTS, RegisteredRobot
from roboyard.robots.robot import Robot
from roboyard.robots.sensor_set import SensorOptions
from roboyard.robots.stability.wheels import driven_wheels
from roboyard.sim.world import World

DefinitionSource = str | Path | Mapping[str, Any] | RobotDefinition


def add_robot(
    world: World,
    robot: str | Path | RegisteredRobot | RobotDescription,
    position: ArrayLike = (0, 0, 0),
    orientation: ArrayLike = (0, 0, 0, 1),
    *,
    definition: DefinitionSource | None = None,
    controllers: ControllerConfig | None = None,
    name: str | None = None,
    self_collisions: bool = True,
    fixed_base: bool | None = None,
    end_effector: str | None = None,
    scale: float = 1.0,
    control_freq: float | None = None,
    action_normalize: bool = True,
    reset_joint_pos: ArrayLike | None = None,
    default_reset_mode: ResetMode = "untuck",
    backend: Backend = "numpy",
    sensor_options: SensorOptions | None = None,
) -> Robot:
    """Add a robot with its controllers to a world.

    Args:
        world: where.
        robot: a registered name ("r1"), one of `REGISTERED_ROBOTS`, or with `definition` a URDF file or a
            description.
        position: (3,) m of the root link's frame.
        orientation: (4,) x, y, z, w.
        definition: a definition file, its data, or a checked definition; a registered robot has its own.
        controllers: group to a controller's name, or to its keys; the definition's by default.
        name: in the world; the robot's own by default.
        self_collisions: whether links of the robot may touch; a definition's `self_collisions` goes before.
        fixed_base: bolt the root to the world. None: robots that walk or drive on wheels float, all others
        are
            bolted (a holonomic base moves by its virtual joints).
        end_effector: one of the definition's `manipulation.end_effectors`.
        scale: uniform factor on all lengths.
        control_freq: Hz at which goals become drive targets; 30 by default.
        action_normalize: actions run from -1 to 1.
        reset_joint_pos: (n,) posture to start in, in the definition's joint order.
        default_reset_mode: which posture of `mobile_manipulation` to start in.
        backend: what the robot's getters return.
        sensor_options: kind of sensor ("Camera", "Lidar") or link that has one, to keywords of
            `roboyard.sensors.CameraSensor` or `Lidar` (width, rate, pattern, ...).

    Raises:
        ConfigError: the definition or the configuration is wrong, or the robot unknown.
        DescriptionError: the URDF cannot be used.
    """
    if isinstance(robot, str) and not _is_file(robot):
        robot = REGISTERED_ROBOTS.find(robot)
    model, description, found, file = _loaded(robot, definition)
    if end_effector is not None:
        model, found = with_end_effector(found, end_effector)
        if isinstance(robot, RegisteredRobot):
            description = description_with(robot, found, end_effector)
    told = file.name if file is not None else f"definition of {model}"
    check_fits(found, description, name=told, file=file, end_effector=end_effector)
    floats = found.may_float if fixed_base is None else not fixed_base
    if floats and not found.may_float:
        raise ConfigError(
            f"fixed_base: robot {model!r} cannot float; only locomotion without a holonomic base does"
        )
    collide = self_collisions if found.self_collisions is None else found.self_collisions
    original, description = description, edited(found, description)
    body = world.add_urdf(
        description,
        position,
        orientation,
        fixed_base=not floats,
        scale=scale,
        self_collision=collide,
        name=name or model,
    )
    for name_of_wheel, wheel in driven_wheels(found, original).items():
        body.link(name_of_wheel).flatten_spheres(scale * wheel.half_width)
    try:
        for a, b in found.disabled_collision_pairs or ():
            if a != b:
                world.filters.set(body.link(a), body.link(b), collide=False)
        return Robot(
            body,
            found,
            description,
            controllers=controllers,
            control_freq=control_freq,
            action_normalize=action_normalize,
            reset_joint_pos=reset_joint_pos,
            default_reset_mode=default_reset_mode,
            model=model,
            backend=backend,
            sensor_file=_sensor_file(robot),
            sensor_options=sensor_options,
        )
    except Exception:
        for call in tuple(world.before_step):
            owner = getattr(call, "__self__", None)
            if isinstance(owner, Robot) and owner.body is body:
                world.before_step.remove(call)
        world.remove(body)
        raise


def _loaded(
    robot: str | Path | RegisteredRobot | RobotDescription, definition: DefinitionSource | None
) -> tuple[str, RobotDescription, RobotDefinition, Path | None]:
    """Name, description, definition and the definition's file."""
    if isinstance(robot, RegisteredRobot):
        own, file = (robot.definition, robot.file) if definition is None else _read(definition)
        return robot.name, robot.description(own), own, file
    if definition is None:
        raise ConfigError("definition: is required with a URDF; name its definition file")
    own, file = _read(definition)
    if isinstance(robot, RobotDescription):
        return robot.name, robot, own, file
    from roboyard.description import load_description

    return Path(robot).stem, load_description(robot), own, file


def _sensor_file(robot: str | Path | RegisteredRobot | RobotDescription) -> Path | None:
    """The file that names the robot's cameras and lidars, where it was imported."""
    if isinstance(robot, str) and not _is_file(robot):
        robot = REGISTERED_ROBOTS.find(robot)
    return robot.sensors if isinstance(robot, RegisteredRobot) else None


def _is_file(robot: str) -> bool:
    return robot.lower().endswith((".urdf", ".xml", ".xacro"))


def _read(definition: DefinitionSource) -> tuple[RobotDefinition, Path | None]:
    if isinstance(definition, RobotDefinition):
        return definition, None
    if isinstance(definition, Mapping):
        return parse_definition(definition), None
    return load_definition(definition), Path(definition)
