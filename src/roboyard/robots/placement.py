"""Where a robot stands: its lowest point, and the floor below a point.

A vendor's root frame is at the floor, in the pelvis or at the top of a lift. A robot whose root frame is put
on the floor therefore starts in it, or above it; `stand_on_floor` puts its lowest point there. The root frame
counts as a point of a fixed robot whose base has no shape: an arm must not sink by the height of what it
stands on. Where the
ground is uneven, `raise_out_of_ground` raises it further.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from roboyard._mujoco import mujoco
from roboyard.description.geometry import geometry_mesh
from roboyard.description.model import Collision, Mesh, Visual
from roboyard.errors import MeshError
from roboyard.robots.robot import Robot
from roboyard.sim.body import Body
from roboyard.sim.queries.contacts import Contact
from roboyard.sim.world import World
from roboyard.transforms import Array, matrix_from_quaternion, pose_matrix

ON_FLOOR = 1e-3
"""A root frame this near to the floor stands on it (m)."""
TOUCHES = 2e-3
"""Depth up to which a robot may start in the ground (m)."""
HIGHEST = 0.4
"""Height by which a robot is raised at most where the ground around it is higher (m)."""
_VISUAL_GROUP, _HIDDEN_GROUP = 2, 5
_SOLID = np.array([1, 1, 0, 1, 1, 0], dtype=np.uint8)
"""MuJoCo's groups of geoms that a floor may be in: neither visual shapes nor the robot's own."""


def stand_on_floor(robot: Robot, always: bool | None = None) -> float:
    """Put a robot's lowest point on the floor below its root frame, and return the height moved (m).

    Args:
        robot: in the posture that it starts in.
        always: True puts it on the floor from any height; None only where its root frame is on the floor,
            or where it would start in the floor; False never.
    """
    if always is False:
        return 0.0
    position = robot.body.pose[0]
    floor = floor_below(robot, position)
    if floor is None:
        return 0.0
    gap = min(lowest_point(robot), mounting_height(robot)) - floor
    if not np.isfinite(gap) or (always is None and position[2] - floor > ON_FLOOR and gap >= 0.0):
        return 0.0
    robot.body.set_pose(position - [0.0, 0.0, gap], robot.body.pose[1])
    robot.loop.invalidate()
    return -float(gap)


def raise_out_of_ground(robot: Robot) -> Contact | None:
    """Raise a robot until it is out of uneven ground, by `HIGHEST` at most.

    Returns:
        The deepest contact with what it is still inside of, a wall for instance; None where it is free.
    """
    raised = 0.0
    while True:
        robot.world.detect_contacts()
        deep = [
            contact
            for contact in robot.world.contacts(robot.body)
            if contact.body_b is not robot.body and contact.distance < -TOUCHES
        ]
        if not deep:
            return None
        worst = min(deep, key=lambda contact: contact.distance)
        step = max(-1.5 * worst.distance, TOUCHES)
        raised += step
        if raised > HIGHEST:
            return worst
        position, quaternion = robot.body.pose
        robot.body.set_pose(position + np.array([0.0, 0.0, step]), quaternion)
        robot.loop.invalidate()


def floor_below(robot: Robot, position: Array) -> float | None:
    """Return the height of the first surface below a (3,) point that is not of the robot (m); else None."""
    world = robot.world
    world.show_triangles()
    data, model = world.kinematics(), world.live_model
    own = np.isin(model.geom_bodyid, robot.body.mujoco_ids)
    groups = model.geom_group.copy()
    start = np.asarray(position, dtype=float) + np.array([0.0, 0.0, ON_FLOOR])
    hit = np.full(1, -1, dtype=np.int32)
    try:
        model.geom_group[own] = _HIDDEN_GROUP
        distance = mujoco.mj_ray(model, data, start, np.array([0.0, 0.0, -1.0]), _SOLID, True, -1, hit)
    finally:
        model.geom_group[:] = groups
    return None if hit[0] < 0 else float(start[2] - distance)


def lowest_point(robot: Robot) -> float:
    """Return the height of the lowest point of all collision and visual shapes, in the present posture (m).

    Infinite planes do not count; +inf for a robot without shapes.
    """
    return min(lowest_collision(robot.body), lowest_visual(robot))


def mounting_height(robot: Robot) -> float:
    """Return the height of the root frame (m) of a fixed robot whose base has no shape; else +inf,
    as for a walker that its root frame guides.

    A root frame further below the robot than the robot is large is no mounting, and does not count either.
    """
    description = robot.description
    if not robot.body.is_fixed or robot.definition.holonomic_base is not None or robot.guide_joints:
        return np.inf
    rigid = [description.root.name]
    for name in rigid:
        link = description.link_by_name[name]
        if link.visuals or link.collisions:
            return np.inf
        rigid += [joint.child for joint in description.child_joints[name] if not joint.is_moving]
    root, lowest, (low, high) = float(robot.body.pose[0][2]), lowest_point(robot), robot.body.bounds
    size = float(np.linalg.norm(high - [low[0], low[1], lowest]))
    return root if lowest - root < size else np.inf


def lowest_collision(body: Body) -> float:
    """Return the height of the lowest point of a body's collision shapes (m); +inf without any."""
    world = World.of(body)
    world.show_triangles()
    data, model = world.kinematics(), world.live_model
    chosen = np.isin(model.geom_bodyid, body.mujoco_ids) & (model.geom_group != _VISUAL_GROUP)
    rows = [int(row) for row in np.flatnonzero(chosen)]
    return min((_lowest_of_geom(model, data, row) for row in rows), default=np.inf)


def _lowest_of_geom(model: mujoco.MjModel, data: mujoco.MjData, row: int) -> float:
    """Return the height of a geom's lowest point (m)."""
    height = float(data.geom_xpos[row, 2])
    up = data.geom_xmat[row].reshape(3, 3)[2]
    size = model.geom_size[row]
    match mujoco.mjtGeom(int(model.geom_type[row])):
        case mujoco.mjtGeom.mjGEOM_SPHERE:
            reach = size[0]
        case mujoco.mjtGeom.mjGEOM_CAPSULE:
            reach = abs(up[2]) * size[1] + size[0]
        case mujoco.mjtGeom.mjGEOM_CYLINDER:
            reach = abs(up[2]) * size[1] + size[0] * np.hypot(up[0], up[1])
        case mujoco.mjtGeom.mjGEOM_BOX:
            reach = np.abs(up) @ size
        case mujoco.mjtGeom.mjGEOM_ELLIPSOID:
            reach = np.linalg.norm(up * size)
        case mujoco.mjtGeom.mjGEOM_MESH:
            mesh = int(model.geom_dataid[row])
            first, count = int(model.mesh_vertadr[mesh]), int(model.mesh_vertnum[mesh])
            reach = -float((model.mesh_vert[first : first + count] @ up).min())
        case _:
            return np.inf
    return height - float(reach)


def lowest_visual(robot: Robot) -> float:
    """Return the height of the lowest point of a robot's visual shapes (m); +inf without any.

    They are the description's, since a world may be built without visual shapes.
    """
    links = robot.description.links
    return min((lowest_of_shapes(robot, link.name, link.visuals) for link in links), default=np.inf)


def lowest_of_shapes(robot: Robot, link: str, shapes: Sequence[Visual | Collision]) -> float:
    """Return the height of the lowest point of shapes of a link, as given (m); +inf without any."""
    lowest, scale = np.inf, robot.body.scale
    T_world_link = pose_matrix(*robot.link(link).pose) if shapes else np.eye(4)
    up = T_world_link[2, :3]
    for shape in shapes:
        points = _vertices(shape.geometry)
        if points is None:
            continue
        up_here = up @ matrix_from_quaternion(shape.origin.quaternion)
        start = T_world_link[2, 3] + scale * float(up @ np.asarray(shape.origin.position))
        lowest = min(lowest, start + scale * float((points @ up_here).min()))
    return float(lowest)


def _vertices(geometry: object) -> Array | None:
    """Return the (n, 3) scaled vertices of a geometry in its frame (m); None for infinite or empty ones."""
    if isinstance(geometry, Mesh) and geometry.data is None and geometry.path is None:
        return None
    try:
        mesh = geometry_mesh(geometry)  # type: ignore[arg-type]
    except MeshError:
        return None  # `load_description` and the audit report unreadable files
    return None if mesh is None or not len(mesh.vertices) else np.asarray(mesh.vertices)
