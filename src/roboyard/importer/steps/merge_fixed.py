"""Merge links into the parents to which they are fixed.

Shapes are moved with their poses, masses and inertias are combined exactly, and child joints get the new
parent. A link that the configuration names for a sensor, an end effector, a gripper, a wheel or the planner
is kept; a link that only a collision list names is not.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace
from typing import TypeVar

import numpy as np

from roboyard.description.geometry import pose_from_matrix
from roboyard.description.model import Collision, Inertial, Joint, Link, Pose, RobotDescription, Visual
from roboyard.description.robot_model import RobotModel
from roboyard.description.semantic_names import with_names
from roboyard.importer.config.schema import ImportConfig
from roboyard.importer.context import ImportContext
from roboyard.shapes.inertia import SolidInertia, combined
from roboyard.transforms import Array

ShapeType = TypeVar("ShapeType", Visual, Collision)


def merge_fixed_links(robot: RobotModel, context: ImportContext) -> RobotModel:
    """Return the robot without fixed joints that nothing needs, where `merge_fixed_joints` is set."""
    if not context.config.merge_fixed_joints:
        return robot
    keep = named_links(context.config) | {s.link for s in robot.sensors}
    merged, description, solids = merge_links(robot.description, robot.solids, keep)
    for child, parent in merged.items():
        context.log.note(f'merged into "{parent}"', f'link "{child}"')
    semantic = with_names(robot.semantic, merged, {})
    return replace(robot, description=description, solids=solids, semantic=semantic)


def named_links(config: ImportConfig) -> set[str]:
    """Return the links that the configuration needs under their own names."""
    named = {name for entry in (*config.eef_vis_links, *config.camera_links, *config.lidar_links)
             for name in (entry.link, entry.parent_link) if name}  # fmt: skip
    named |= set(config.base_motion.wheel_links)
    curobo = config.curobo
    for name, gripper in curobo.eef_to_gripper_info.items():
        named |= {name, *gripper.links}
    for name, others in curobo.self_collision_ignore.items():
        named |= {name, *others}
    return named | set(curobo.collision_spheres) | set(curobo.self_collision_buffer)


def merge_links(
    description: RobotDescription,
    solids: dict[str, tuple[Collision, ...]] | object,
    keep: Collection[str] = (),
) -> tuple[dict[str, str], RobotDescription, dict[str, tuple[Collision, ...]]]:
    """Merge every link on a fixed joint that is not in `keep` into its parent.

    Returns:
        Merged link to the link that contains it now, the new description, the new solids.
    """
    place: dict[str, tuple[str, Array]] = {description.root.name: (description.root.name, np.eye(4))}
    joints: list[Joint] = []
    for joint in description.depth_first_joints:
        host, pose = place[joint.parent]
        if joint.type == "fixed" and joint.child not in keep:
            place[joint.child] = (host, pose @ joint.origin.matrix())
            continue
        place[joint.child] = (joint.child, np.eye(4))
        if host != joint.parent:
            joint = replace(joint, parent=host, origin=pose_from_matrix(pose @ joint.origin.matrix()))
        joints.append(joint)
    order = {joint.name: index for index, joint in enumerate(description.joints)}
    joints.sort(key=lambda joint: order[joint.name])
    merged_links: dict[str, list[tuple[Link, Array]]] = {}
    for link in description.links:
        host, pose = place[link.name]
        if host != link.name:
            merged_links.setdefault(host, []).append((link, pose))
    links = tuple(
        _joined(link, merged_links.get(link.name, []))
        for link in description.links
        if place[link.name][0] == link.name
    )
    solids = solids if isinstance(solids, dict) else {}
    new_solids = {link.name: solids.get(link.name, ()) for link in links}
    for host, absorbed in merged_links.items():
        for link, pose in absorbed:
            new_solids[host] = (*new_solids[host], *_transformed(solids.get(link.name, ()), pose))
    merged = {name: host for name, (host, _) in place.items() if host != name}
    loops = tuple(
        replace(
            loop,
            first=place[loop.first][0],
            first_origin=pose_from_matrix(place[loop.first][1] @ loop.first_origin.matrix()),
            second=place[loop.second][0],
            second_origin=pose_from_matrix(place[loop.second][1] @ loop.second_origin.matrix()),
        )
        for loop in description.loops
    )
    return merged, replace(description, links=links, joints=tuple(joints), loops=loops), new_solids


def _joined(link: Link, merged_links: list[tuple[Link, Array]]) -> Link:
    if not merged_links:
        return link
    visuals, collisions = list(link.visuals), list(link.collisions)
    parts = [] if link.inertial is None else [(link.inertial, np.eye(4))]
    for other, pose in merged_links:
        visuals += _transformed(other.visuals, pose)
        collisions += _transformed(other.collisions, pose)
        if other.inertial is not None:
            parts.append((other.inertial, pose))
    inertial = (
        combined_inertial(parts) if len(parts) > 1 or (parts and link.inertial is None) else link.inertial
    )
    return replace(link, visuals=tuple(visuals), collisions=tuple(collisions), inertial=inertial)


def combined_inertial(parts: list[tuple[Inertial, Array]]) -> Inertial:
    """Return several inertials combined, each given with the (4, 4) pose of its link in the common frame."""
    bodies = []
    for inertial, pose in parts:
        frame = pose @ inertial.origin.matrix()
        own = SolidInertia(mass=inertial.mass, center=np.zeros(3), inertia=inertial.matrix())
        bodies.append(own.moved(frame[:3, 3], frame[:3, :3]))
    if not sum(body.mass for body in bodies) > 0:
        return replace(parts[0][0], origin=pose_from_matrix(parts[0][1] @ parts[0][0].origin.matrix()))
    whole = combined(bodies)
    x, y, z = (float(value) for value in whole.center)
    tensor = whole.inertia
    return Inertial(
        mass=float(whole.mass),
        origin=Pose(position=(x, y, z)),
        inertia=(
            float(tensor[0, 0]),
            float(tensor[0, 1]),
            float(tensor[0, 2]),
            float(tensor[1, 1]),
            float(tensor[1, 2]),
            float(tensor[2, 2]),
        ),
    )


def _transformed(shapes: Sequence[ShapeType], matrix: Array) -> tuple[ShapeType, ...]:
    """Return shapes in the frame in which their present frame has the (4, 4) pose `matrix`."""
    return tuple(replace(shape, origin=pose_from_matrix(matrix @ shape.origin.matrix())) for shape in shapes)
