"""Move the root link's origin to the bottom of the robot's bounding box, so that it stands at z = 0.

The root link's shapes, centre of mass, child joints and sensors move up by the same amount. x, y and the
poses of all other links relative to each other stay the same.
"""

from __future__ import annotations

from dataclasses import replace

from roboyard.description.loops import reframed
from roboyard.description.model import Link, Pose
from roboyard.description.robot_model import RobotModel
from roboyard.description.semantic import Wheel
from roboyard.importer.context import ImportContext
from roboyard.morphology.bounds import robot_bounds


def move_root_frame(robot: RobotModel, context: ImportContext) -> RobotModel:
    """Return the robot with its lowest point, joints at zero, at z = 0 of the root link."""
    bounds = robot_bounds(robot.description)
    if bounds is None:
        return robot
    lowest = float(bounds[0, 2])
    if not context.config.canonical_frame:
        if abs(lowest) > 1e-6:
            context.log.note(
                f"the root link's frame is unchanged; the robot's lowest point is at z = {lowest:.6g} m"
            )
        return robot
    if abs(lowest) < 1e-9:
        return robot
    context.log.note(f"the root link's origin moved by {lowest:.6g} m along z, to the bottom of the robot")
    root = robot.description.root.name
    description = replace(
        robot.description,
        links=tuple(_raised(x, -lowest) if x.name == root else x for x in robot.description.links),
        joints=tuple(
            replace(joint, origin=_raised_pose(joint.origin, -lowest)) if joint.parent == root else joint
            for joint in robot.description.joints
        ),
        loops=reframed(robot.description.loops, root, lambda pose: _raised_pose(pose, -lowest)),
    )
    solids = dict(robot.solids)
    if root in solids:
        solids[root] = tuple(replace(s, origin=_raised_pose(s.origin, -lowest)) for s in solids[root])
    return replace(
        robot,
        description=description,
        solids=solids,
        semantic=replace(robot.semantic, wheels=_raised_wheels(robot, -lowest)),
        sensors=tuple(
            replace(s, offset=_raised_pose(s.offset, -lowest)) if s.link == root else s for s in robot.sensors
        ),
    )


def _raised_wheels(robot: RobotModel, z: float) -> tuple[Wheel, ...]:
    """Return the wheels in the root link's new frame."""
    return tuple(
        replace(wheel, centre=(wheel.centre[0], wheel.centre[1], wheel.centre[2] + z))
        for wheel in robot.semantic.wheels
    )


def _raised(link: Link, z: float) -> Link:
    inertial = link.inertial
    if inertial is not None:
        inertial = replace(inertial, origin=_raised_pose(inertial.origin, z))
    return replace(
        link,
        inertial=inertial,
        visuals=tuple(replace(v, origin=_raised_pose(v.origin, z)) for v in link.visuals),
        collisions=tuple(replace(c, origin=_raised_pose(c.origin, z)) for c in link.collisions),
    )


def _raised_pose(pose: Pose, z: float) -> Pose:
    """Return the pose moved along z by `z` (m), rotation unchanged."""
    x, y, height = pose.position
    return replace(pose, position=(x, y, height + z))
