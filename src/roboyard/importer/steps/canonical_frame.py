"""The root link's origin moves to the bottom of the robot's bounding box, so that a robot set down at z = 0
stands.

Everything in the root link's frame moves up by as much: its shapes, its centre of mass, the joints that hang
from it and the sensors on it. x and y stay, and so does every link below relative to every other.
"""

from __future__ import annotations

from dataclasses import replace

from roboyard.description.model import Link
from roboyard.description.robot_model import RobotModel
from roboyard.importer.context import ImportContext
from roboyard.morphology.shape_geometry import robot_bounds, shifted


def canonical_frame(robot: RobotModel, context: ImportContext) -> RobotModel:
    """The robot with its lowest point, joints at zero, at z = 0 of the root link."""
    bounds = robot_bounds(robot.description)
    if bounds is None:
        return robot
    lowest = float(bounds[0, 2])
    if not context.config.canonical_frame:
        if abs(lowest) > 1e-6:
            context.log.note(
                f"the root link's frame stays as it was; the robot's lowest point is at z = {lowest:.6g} m"
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
            replace(joint, origin=shifted(joint.origin, -lowest)) if joint.parent == root else joint
            for joint in robot.description.joints
        ),
    )
    solids = dict(robot.solids)
    if root in solids:
        solids[root] = tuple(replace(s, origin=shifted(s.origin, -lowest)) for s in solids[root])
    return replace(
        robot,
        description=description,
        solids=solids,
        sensors=tuple(
            replace(s, offset=shifted(s.offset, -lowest)) if s.link == root else s for s in robot.sensors
        ),
    )


def _raised(link: Link, z: float) -> Link:
    inertial = link.inertial
    if inertial is not None:
        inertial = replace(inertial, origin=shifted(inertial.origin, z))
    return replace(
        link,
        inertial=inertial,
        visuals=tuple(replace(v, origin=shifted(v.origin, z)) for v in link.visuals),
        collisions=tuple(replace(c, origin=shifted(c.origin, z)) for c in link.collisions),
    )
