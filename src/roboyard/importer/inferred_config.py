"""Settings that follow from what a robot is understood to be, where the user gave no configuration.

`roboyard infer` prints them, so an import of its output is an import without configuration.
"""

from __future__ import annotations

from dataclasses import replace

from roboyard.description.model import Pose
from roboyard.description.robot_model import RobotModel
from roboyard.description.semantic import MountedSensor, SemanticDescription
from roboyard.importer.config.schema import (
    BaseMotion,
    Gripper,
    ImportConfig,
    Offset,
    SensorLink,
    Understanding,
)
from roboyard.importer.context import ImportContext


def with_inferred_settings(context: ImportContext, robot: RobotModel) -> ImportContext:
    """Return the context with the inferred settings, unless the user gave a configuration."""
    if context.has_config:
        return context
    return replace(
        context, config=inferred_config(context.config, robot.semantic, robot.description.root.name)
    )


def inferred_config(config: ImportConfig, semantic: SemanticDescription, root: str) -> ImportConfig:
    """Return a configuration in which everything that is understood about the robot is stated.

    Args:
        config: before.
        semantic: of the robot.
        root: its root link; joints between it and the base move a base.
    """
    curobo = config.curobo.model_copy(
        update={
            "eef_to_gripper_info": {
                end.link: Gripper(links=list(end.gripper_links), joints=list(end.gripper_joints))
                for end in semantic.end_effectors
            },
            "torso_joints": list(semantic.trunk_joints),
        }
    )
    return config.model_copy(
        update={
            "base_motion": inferred_base_motion(semantic, is_moved=semantic.base_link != root),
            "camera_links": [_camera(sensor) for sensor in _one_a_link(semantic.mounted("camera"))],
            "lidar_links": [_lidar(sensor) for sensor in _one_a_link(semantic.mounted("lidar"))],
            "understanding": inferred_understanding(semantic),
            "curobo": curobo,
        }
    )


def inferred_base_motion(semantic: SemanticDescription, *, is_moved: bool = False) -> BaseMotion:
    """Return the base's settings: a holonomic base moves by virtual joints, its wheels fixed and spheres.

    Wheels that the file draws on fixed joints stay as they are, and slide.
    """
    wheels = [wheel.link for wheel in semantic.driven_wheels]
    if semantic.base != "holonomic" or semantic.virtual_joints or (is_moved and not wheels):
        return BaseMotion(wheel_links=wheels)
    rolling = [wheel.joint for wheel in semantic.wheels if not wheel.is_caster]
    fixed = dict.fromkeys((*semantic.steer_joints, *rolling, *semantic.caster_joints))
    return BaseMotion(
        wheel_links=wheels,
        wheel_joints=list(fixed),
        use_sphere_wheels=bool(wheels),
        use_holonomic_joints=True,
    )


def inferred_understanding(semantic: SemanticDescription) -> Understanding:
    """Return what the other sections of a configuration have no keys for."""
    hands = {arm.name: arm.end_effector.gripper for arm in semantic.arms}
    owned = [hand for hand in hands.values() if hand is not None]
    alone = {hand.palm: hand for hand in semantic.grippers if hand not in owned}
    every = {**hands, **alone}
    return Understanding(
        kind=semantic.kind,
        base=semantic.base,
        steer_joints=list(semantic.steer_joints),
        caster_joints=list(semantic.caster_joints),
        head_joints=list(semantic.head_joints),
        legs={leg.name: list(leg.joints) for leg in semantic.legs},
        arms={arm.name: list(arm.joints) for arm in semantic.arms},
        opening={name: hand.opening for name, hand in every.items() if hand and hand.opening},
        imu_links=[sensor.link for sensor in semantic.mounted("imu")],
    )


def _one_a_link(sensors: tuple[MountedSensor, ...]) -> list[MountedSensor]:
    """Return sensors without those that look from a link which another one looks from."""
    found: dict[str, MountedSensor] = {}
    for sensor in sensors:
        found.setdefault(sensor.optical_link or sensor.link, sensor)
    return list(found.values())


def _camera(sensor: MountedSensor) -> SensorLink:
    view = sensor.view or Pose()
    return SensorLink(
        link=sensor.optical_link or sensor.link,
        offset=Offset(position=view.position, orientation=view.quaternion),
    )


def _lidar(sensor: MountedSensor) -> SensorLink:
    frame = sensor.frame or Pose()
    return SensorLink(link=sensor.link, offset=Offset(position=frame.position, orientation=frame.quaternion))
