"""Give a robot on legs that was turned upright its file's root frame again.

Steps work on a robot with z up. What the package writes has the vendor's frames, so that kinematics of other
programs agree with the vendor's file; the definition's `standing_orientation` stands the robot on its feet.
Robots on wheels keep the turned frame, in which driving velocities are given, and so does a configured
`canonical_frame`.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from roboyard.description.model import Pose, Vector3
from roboyard.description.robot_model import CollisionSphere, PlanningData, RobotModel
from roboyard.description.semantic import EndEffector, Gripper, MountedSensor, SemanticDescription
from roboyard.importer.context import ImportContext
from roboyard.importer.steps.metadata import measure_size
from roboyard.morphology.upright import seen_from, turned, turned_collision, turned_pose
from roboyard.transforms import Array, matrix_from_quaternion


def restore_file_frame(robot: RobotModel, context: ImportContext) -> RobotModel:
    """Return the robot with its root link's frame as its file has it."""
    rotation = np.round(matrix_from_quaternion(np.asarray(robot.root_turn)), 12)
    if np.allclose(rotation, np.eye(3)):
        return robot
    semantic, root = robot.semantic, robot.description.root.name
    if semantic.wheels or semantic.base_link != root or context.config.canonical_frame:
        context.log.note("the root link's frame stays turned, z up and x forwards")
        return robot
    context.log.note("frames are the file's; standing_orientation of the definition stands the robot upright")
    solids = {
        name: tuple(turned_collision(s, rotation.T) for s in shapes) if name == root else shapes
        for name, shapes in robot.solids.items()
    }
    sensors = tuple(
        replace(s, offset=turned_pose(s.offset, rotation.T)) if s.link == root else s for s in robot.sensors
    )
    found = replace(
        robot,
        description=turned(robot.description, rotation.T),
        semantic=_semantic(semantic, root, rotation),
        solids=solids,
        sensors=sensors,
        planning=None if robot.planning is None else _planning(robot.planning, root, rotation),
        root_turn=(0.0, 0.0, 0.0, 1.0),
    )
    return measure_size(found, context)


def _planning(planning: PlanningData, root: str, rotation: Array) -> PlanningData:
    spheres = dict(planning.spheres)
    if root in spheres:
        spheres[root] = tuple(
            CollisionSphere(center=_back(s.center, rotation, 5), radius=s.radius) for s in spheres[root]
        )
    return replace(planning, spheres=spheres)


def _semantic(semantic: SemanticDescription, root: str, rotation: Array) -> SemanticDescription:
    """Return the semantics with what is stated in the root link's frame in the file's frame."""
    return replace(
        seen_from(semantic, rotation),
        end_effectors=tuple(_end_effector(e, root, rotation) for e in semantic.end_effectors),
        arms=tuple(
            replace(arm, end_effector=_end_effector(arm.end_effector, root, rotation))
            for arm in semantic.arms
        ),
        grippers=tuple(_gripper(g, root, rotation) for g in semantic.grippers),
        sensors=tuple(_sensor(s, root, rotation) for s in semantic.sensors),
    )


def _end_effector(effector: EndEffector, root: str, rotation: Array) -> EndEffector:
    gripper = None if effector.gripper is None else _gripper(effector.gripper, root, rotation)
    frame = effector.frame
    if frame is not None and effector.link == root:
        frame = turned_pose(frame, rotation.T)
    return replace(effector, frame=frame, gripper=gripper)


def _gripper(gripper: Gripper, root: str, rotation: Array) -> Gripper:
    def points(given: tuple[tuple[str, Vector3], ...]) -> tuple[tuple[str, Vector3], ...]:
        return tuple((link, _back(p, rotation) if link == root else p) for link, p in given)

    return replace(gripper, start_points=points(gripper.start_points), end_points=points(gripper.end_points))


def _sensor(sensor: MountedSensor, root: str, rotation: Array) -> MountedSensor:
    def placed(pose: Pose | None, link: str | None) -> Pose | None:
        return turned_pose(pose, rotation.T) if pose is not None and link == root else pose

    return replace(
        sensor,
        frame=placed(sensor.frame, sensor.link),
        view=placed(sensor.view, sensor.optical_link or sensor.link),
    )


def _back(point: Vector3, rotation: Array, digits: int | None = None) -> Vector3:
    x, y, z = (float(value) for value in np.asarray(point) @ rotation)
    if digits is not None:
        x, y, z = round(x, digits), round(y, digits), round(z, digits)
    return (x + 0.0, y + 0.0, z + 0.0)
