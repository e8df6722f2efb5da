"""URDF_MERGE_FIXED_LINKS: links on fixed joints are merged into their parents, as in Bullet.

Bullet ignores the inertial origins of the file in the sum, keeps the link's axes in the merged frame, and
moves the last joint to the place of a removed one.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TypeVar

import numpy as np

from roboyard._records import dataclass
from roboyard.description.model import Collision, Inertial, Joint, Link, Pose, RobotDescription, Visual
from roboyard.transforms import Array, quaternion_from_matrix

Shape = TypeVar("Shape", Visual, Collision)
_DEFAULT_INERTIAL = Inertial(mass=1.0, inertia=(1.0, 0.0, 0.0, 1.0, 0.0, 1.0))


@dataclass(slots=True)
class _Node:
    """A link and its child joints during merging."""

    link: Link
    joints: list[Joint]
    mass: float
    center: Array
    tensor: Array
    """(3, 3) diagonal inertia about `center`, in the link's axes (kg m²)."""
    is_merged: bool = False


def merge_fixed_links(description: RobotDescription, *, fixed_base: bool = False) -> RobotDescription:
    """Return the description without fixed joints: their links' shapes and masses move to the parents.

    The mass of a fixed base stays unchanged.

    Args:
        description: robot.
        fixed_base: whether the base is fixed.
    """
    nodes = {link.name: _node(link, description.child_joints[link.name]) for link in description.links}
    root = description.root.name
    order: list[Joint] = []
    kept: list[str] = []
    _merge(nodes, root, fixed_base or nodes[root].mass == 0.0, order, kept)
    links = tuple(_finished(nodes[name]) for name in kept)
    return replace(description, links=links, joints=tuple(order))


def _merge(nodes: dict[str, _Node], name: str, is_static: bool, order: list[Joint], kept: list[str]) -> None:
    node = nodes[name]
    kept.append(name)
    i = 0
    while i < len(node.joints):
        joint = node.joints[i]
        if joint.type != "fixed":
            i += 1
            continue
        child = nodes[joint.child]
        _absorb(node, child, joint.origin.matrix(), is_static)
        node.joints[i] = node.joints[-1]
        node.joints.pop()
        for grandchild in child.joints:
            origin = _pose(joint.origin.matrix() @ grandchild.origin.matrix())
            node.joints.append(replace(grandchild, parent=name, origin=origin))
    for joint in node.joints:
        order.append(joint)
        _merge(nodes, joint.child, False, order, kept)


def _node(link: Link, joints: tuple[Joint, ...]) -> _Node:
    inertial = link.inertial or _DEFAULT_INERTIAL
    return _Node(link, list(joints), inertial.mass, np.zeros(3), inertial.matrix())


def _absorb(node: _Node, child: _Node, pose: Array, is_static: bool) -> None:
    """Add a child's shapes, and its mass unless the node is a fixed base, whose inertial frame is its own."""
    node.link = replace(
        node.link,
        visuals=(*node.link.visuals, *(_moved(shape, pose) for shape in child.link.visuals)),
        collisions=(*node.link.collisions, *(_moved(shape, pose) for shape in child.link.collisions)),
    )
    if is_static:
        if node.link.inertial is not None:
            node.link = replace(node.link, inertial=replace(node.link.inertial, origin=Pose()))
        return
    there = pose[:3, :3] @ child.center + pose[:3, 3]
    mass = node.mass + child.mass
    if mass == 0.0:
        return
    center = (node.mass * node.center + child.mass * there) / mass
    tensor = _about(node.tensor, node.mass, node.center - center)
    tensor += _about(pose[:3, :3] @ child.tensor @ pose[:3, :3].T, child.mass, there - center)
    node.mass, node.center, node.tensor, node.is_merged = mass, center, _principal(tensor), True


def _about(tensor: Array, mass: float, arm: Array) -> Array:
    """Return the inertia about a point at `-arm` from the centre of mass."""
    return tensor + mass * (arm @ arm * np.eye(3) - np.outer(arm, arm))


def _principal(tensor: Array) -> Array:
    """Return the diagonal of principal moments, each assigned to the closest axis."""
    moments = np.linalg.eigvalsh(tensor)
    out = np.empty(3)
    out[np.argsort(np.diag(tensor))] = moments
    return np.diag(out)


def _finished(node: _Node) -> Link:
    if not node.is_merged:
        return node.link
    x, y, z = (float(v) for v in node.center)
    xx, yy, zz = (float(v) for v in np.diag(node.tensor))
    inertial = Inertial(mass=node.mass, origin=Pose(position=(x, y, z)), inertia=(xx, 0.0, 0.0, yy, 0.0, zz))
    return replace(node.link, inertial=inertial)


def _moved(shape: Shape, pose: Array) -> Shape:
    return replace(shape, origin=_pose(pose @ shape.origin.matrix()))


def _pose(matrix: Array) -> Pose:
    x, y, z = (float(v) for v in matrix[:3, 3])
    qx, qy, qz, qw = (float(v) for v in quaternion_from_matrix(matrix[:3, :3]))
    return Pose(position=(x, y, z), quaternion=(qx, qy, qz, qw))
