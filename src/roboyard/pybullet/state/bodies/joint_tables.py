"""The 17 fields of getJointInfo, which do not change after loading, and the joints' places in MuJoCo."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from roboyard._arrays import NDArray
from roboyard._records import dataclass
from roboyard.description.model import Joint
from roboyard.pybullet.bullet_rules.models import BodyModel, LinkModel
from roboyard.pybullet.bullet_rules.single_precision import canonical_quaternion
from roboyard.transforms import conjugate, multiply, rotate

TYPE_CODES = {
    "revolute": 0,
    "continuous": 0,
    "prismatic": 1,
    "spherical": 2,
    "planar": 3,
    "fixed": 4,
    "floating": 4,
}
POSITION_COUNT = {0: 1, 1: 1, 2: 4, 3: 3, 4: 0}
VELOCITY_COUNT = {0: 1, 1: 1, 2: 3, 3: 3, 4: 0}
FIRST_Q, FIRST_U = 7, 6
_NO_LIMIT = (0.0, -1.0)


def joint_infos(model: BodyModel) -> list[tuple[Any, ...]]:
    """Return the fields of getJointInfo of each joint."""
    infos = []
    q_index, u_index = FIRST_Q, FIRST_U
    for index, link in enumerate(model.links[1:]):
        assert link.joint is not None
        kind = TYPE_CODES[link.joint.type]
        parent = model.links[link.parent + 1]
        positions, velocities = POSITION_COUNT[kind], VELOCITY_COUNT[kind]
        position, rotation = frame_in_parent(parent, link, link.joint)
        infos.append(
            (
                *(index, link.joint.name.encode(), kind),
                *((q_index, u_index) if positions else (-1, -1)),
                *(int(kind in (0, 1)), float(link.joint.damping), float(link.joint.friction)),
                *limits(link.joint),
                link.name.encode(),
                axis_in_inertial_frame(link, link.joint),
                *(position, rotation, link.parent),
            )
        )
        q_index += positions
        u_index += velocities
    return infos


def limits(joint: Joint) -> tuple[float, float, float, float]:
    """Return lower, upper, force and velocity as Bullet reports them: 0 and -1 without a range."""
    limit = joint.limit
    if limit is None:
        return (*_NO_LIMIT, 0.0, 0.0)
    lower = _NO_LIMIT[0] if limit.lower is None else float(limit.lower)
    upper = _NO_LIMIT[1] if limit.upper is None else float(limit.upper)
    return lower, upper, float(limit.effort or 0.0), float(limit.velocity or 0.0)


def axis_in_inertial_frame(link: LinkModel, joint: Joint) -> tuple[float, float, float]:
    """Return the joint's axis in the child's inertial frame, of the file's length; zero without an axis."""
    if joint.type not in ("revolute", "continuous", "prismatic", "planar"):
        return 0.0, 0.0, 0.0
    x, y, z = rotate(conjugate(link.frame.quaternion), joint.axis)
    return float(x) * joint.axis_length, float(y) * joint.axis_length, float(z) * joint.axis_length


def frame_in_parent(
    parent: LinkModel, link: LinkModel, joint: Joint
) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Return the joint origin (m) in the parent's inertial frame, and the rotation to the child's.

    The sign of the rotation is Bullet's, which computes both factors from matrices.
    """
    back = conjugate(parent.frame.quaternion)
    offset = np.asarray(joint.origin.position) - np.asarray(parent.frame.position)
    position = rotate(back, offset)
    to_joint = canonical_quaternion(conjugate(multiply(back, joint.origin.quaternion)).tolist())
    to_child = canonical_quaternion(conjugate(link.frame.quaternion).tolist())
    rotation = multiply(to_child, to_joint)
    return tuple(float(v) for v in position), tuple(float(v) for v in rotation)


@dataclass(frozen=True, slots=True, eq=False)
class JointLayout:
    """Indices of a body's joint positions and velocities."""

    kinds: frozenset[int]
    """Types of its joints (JOINT_REVOLUTE, ...)."""
    position_count: int
    velocity_count: int
    places: NDArray[np.intp]
    """(position_count,) indices in qpos."""
    order: NDArray[np.intp]
    """(position_count,) number in a list of PyBullet's that belongs to each place; quaternions differ."""
    dofs: NDArray[np.intp]
    """(velocity_count,) indices in qvel."""


def joint_layout(
    infos: Sequence[Sequence[Any]], position_addresses: Sequence[int], velocity_addresses: Sequence[int]
) -> JointLayout:
    """Return the layout of a body's joints; valid until the World is compiled again.

    Args:
        infos: the fields of getJointInfo, by joint.
        position_addresses: first index of each joint in qpos.
        velocity_addresses: first index of each joint in qvel.
    """
    places: list[int] = []
    order: list[int] = []
    dofs: list[int] = []
    for joint, info in enumerate(infos):
        count, start = POSITION_COUNT[info[2]], len(order)
        if count:
            first = position_addresses[joint]
            places += range(first, first + count)
            order += [start + 3, start, start + 1, start + 2] if count == 4 else range(start, start + count)
        if VELOCITY_COUNT[info[2]]:
            first = velocity_addresses[joint]
            dofs += range(first, first + VELOCITY_COUNT[info[2]])
    return JointLayout(
        kinds=frozenset(info[2] for info in infos),
        position_count=len(places),
        velocity_count=len(dofs),
        places=np.array(places, dtype=np.intp),
        order=np.array(order, dtype=np.intp),
        dofs=np.array(dofs, dtype=np.intp),
    )
