"""Where cameras look from and which way: in front of their own housing, along the axis that is free.

A frame on a camera's body seldom says where the lens is: vendors put it into the middle of the housing, and
those without an optical frame differ in which axis looks out. The view is the first of a few candidates that
the links fixed to the camera do not block, upright ones first where no arm turns the camera.
"""

from __future__ import annotations

from collections.abc import Mapping, Set
from dataclasses import replace

import numpy as np

from roboyard.description.geometry import geometry_mesh, pose_from_matrix
from roboyard.description.model import Pose, RobotDescription
from roboyard.description.semantic import MountedSensor, SemanticDescription
from roboyard.kinematics.description_poses import forward_kinematics
from roboyard.morphology.sensors.rays import hit_fraction, triangles_near
from roboyard.transforms import Array

NEAR = 0.05
"""A surface nearer than this blocks a ray (m)."""
VIEW = np.deg2rad(48.0)
"""Width and height of the view that has to be free (rad)."""
RAYS = 9
"""Number of rays along each side of the view."""
BLOCKED = 0.25
"""Largest share of blocked rays in a view that is taken."""
ADVANCES = (0.0, 0.01, 0.02, 0.03, 0.04, 0.06, 0.08)
"""Distances along the view by which the lens may be in front of the frame (m)."""
UPRIGHT = 0.3
"""Least upward component of a camera's y axis, where its view is not nearly upright itself."""
STEEP = 0.8
"""Upward or downward component of a view from which the camera has no upright orientation."""

OPTICAL = np.diag([1.0, -1.0, -1.0])
"""(3, 3) camera (z backwards, y up) in an optical frame: z forwards, y down."""
BODY = np.array([[0.0, 0, -1], [-1, 0, 0], [0, 1, 0]])
"""(3, 3) camera in a frame with x forwards and z up, as ROS's REP 103 has it and simulators state sensors."""


def with_camera_views(semantic: SemanticDescription, description: RobotDescription) -> SemanticDescription:
    """Return the semantics with a view for each camera that is on a link of the description."""
    links = description.link_by_name
    turned = {name for arm in semantic.arms for name in arm.joints}
    sensors = []
    for sensor in semantic.sensors:
        if sensor.kind == "camera":
            optical = sensor.optical_link if sensor.optical_link in links else None
            sensor = replace(sensor, optical_link=optical, view=camera_view(sensor, description, turned))
        sensors.append(sensor)
    return replace(semantic, sensors=tuple(sensors))


def camera_view(
    sensor: MountedSensor, description: RobotDescription, turned: Set[str] = frozenset()
) -> Pose | None:
    """Return the pose of a camera, which looks along -z with +y up, in the frame of its optical link, else of
    its link; None where the description has neither.

    Args:
        sensor: the camera.
        description: of the robot.
        turned: joints of arms; a camera that they carry need not be upright at home.
    """
    links = description.link_by_name
    if sensor.optical_link not in links:
        sensor = replace(sensor, optical_link=None)
    if (sensor.optical_link or sensor.link) not in links:
        return None
    return pose_from_matrix(_view(sensor, description, forward_kinematics(description), turned))


def _view(
    sensor: MountedSensor,
    description: RobotDescription,
    poses: Mapping[str, Array],
    turned: Set[str],
) -> Array:
    """Return the (4, 4) pose of the camera in the frame of the link that it looks from."""
    link = sensor.optical_link or sensor.link
    R_world_link = poses[link][:3, :3]
    if sensor.optical_link is not None:
        start, turns = np.eye(4), [OPTICAL]
    elif sensor.frame is not None:
        start, turns = sensor.frame.matrix(), [BODY]
    else:
        start, turns = np.eye(4), [BODY, *_outward(R_world_link)]
        if not turned & _joints_above(link, description):
            turns.sort(key=lambda turn: not _is_upright(R_world_link @ turn))
    triangles = _triangles_near(link, start[:3, 3], description, poses)
    best, least = None, BLOCKED
    for turn in turns:
        rotation = start[:3, :3] @ turn
        if best is not None and len(turns) > 1:
            break
        if turn is not turns[0] and not _is_upright(R_world_link @ rotation):
            continue
        for advance in ADVANCES:
            position = start[:3, 3] - advance * rotation[:, 2]
            blocked = hit_fraction(triangles, position, _rays(rotation), NEAR)
            if blocked <= least:
                best = (position, rotation)
                break
    position, rotation = best or (start[:3, 3], start[:3, :3] @ turns[0])
    view = np.eye(4)
    view[:3, :3], view[:3, 3] = rotation, position
    return view


def _outward(R_world_link: Array) -> list[Array]:
    """Return cameras (3, 3) in a link's frame that look along its +z, as upright as its axes allow."""
    up = R_world_link.T @ np.array([0.0, 0.0, 1.0])
    y = np.zeros(3)
    axis = int(np.argmax(np.abs(up[:2])))
    y[axis] = np.sign(up[axis]) or 1.0
    if np.abs(up[:2]).max() < UPRIGHT:  # it looks up or down: as an optical frame
        return [OPTICAL]
    back = np.array([0.0, 0.0, -1.0])
    return [np.stack([np.cross(y, back), y, back], axis=1)]


def _is_upright(R_world_camera: Array) -> bool:
    return bool(R_world_camera[2, 1] >= UPRIGHT or abs(R_world_camera[2, 2]) > STEEP)


def _rays(rotation: Array) -> Array:
    """Return the (RAYS * RAYS, 3) unit directions of a camera's view."""
    side = np.tan(VIEW / 2) * np.linspace(-1.0, 1.0, RAYS)
    x, y = (grid.ravel() for grid in np.meshgrid(side, side))
    directions = np.stack([x, y, -np.ones_like(x)], axis=1)
    return directions / np.linalg.norm(directions, axis=1, keepdims=True) @ rotation.T


def _triangles_near(
    link: str, position: Array, description: RobotDescription, poses: Mapping[str, Array]
) -> Array:
    """Return (n, 3, 3) corners (m), in a link's frame, of what is drawn of the links fixed to it."""
    found = []
    T_link_world = np.linalg.inv(poses[link])
    reach = ADVANCES[-1] + NEAR
    for name in _fixed_to(link, description):
        for visual in description.link_by_name[name].visuals:
            mesh = geometry_mesh(visual.geometry)
            if mesh is None or not len(mesh.faces):
                continue
            pose = T_link_world @ poses[name] @ visual.origin.matrix()
            vertices = np.asarray(mesh.vertices) @ pose[:3, :3].T + pose[:3, 3]
            found.append(triangles_near(vertices, np.asarray(mesh.faces), position, reach))
    return np.concatenate(found) if found else np.empty((0, 3, 3))


def _joints_above(link: str, description: RobotDescription) -> set[str]:
    """Return the joints from the root to a link."""
    found = set[str]()
    while (joint := description.parent_joint.get(link)) is not None:
        found.add(joint.name)
        link = joint.parent
    return found


def _fixed_to(link: str, description: RobotDescription) -> list[str]:
    """Return the links that no moving joint separates from a link, itself included."""
    top = link
    while (joint := description.parent_joint.get(top)) is not None and not joint.is_moving:
        top = joint.parent
    found, waiting = [], [top]
    while waiting:
        name = waiting.pop()
        found.append(name)
        waiting += [j.child for j in description.joints if j.parent == name and not j.is_moving]
    return found
