"""Joint orders of vectors, and index arrays that convert between them by name.

Public joint vectors are in depth-first order, the order of MuJoCo's qpos, so that the joints of one branch
are one slice. Files and programs with another order are converted where they are read or written:

| order | used by |
| --- | --- |
| depth first | `World`, `Robot`, `ChainArrays`, MJCF |
| breadth first | PhysX, definition files (`default_joint_pos`), source configurations (`default_qpos`) |
| prim order | cuRobo files |
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence

import numpy as np

from roboyard._arrays import NDArray
from roboyard.description.model import Joint, RobotDescription
from roboyard.errors import unknown_name

SINGLE_DOF_TYPES = ("revolute", "continuous", "prismatic")
"""Types of joints with one degree of freedom."""


def depth_first_joint_names(description: RobotDescription) -> tuple[str, ...]:
    """Return the names of the single-DOF joints depth first, children in file order: MuJoCo's order."""
    return tuple(joint.name for joint in single_dof_joints(description.depth_first_joints))


def breadth_first_joint_names(description: RobotDescription) -> tuple[str, ...]:
    """Return the names of the single-DOF joints level by level, children in file order: PhysX's order."""
    return tuple(joint.name for joint in single_dof_joints(breadth_first_joints(description)))


def breadth_first_joints(description: RobotDescription) -> tuple[Joint, ...]:
    """Return all joints level by level from the root, children in file order."""
    ordered: list[Joint] = []
    level = [description.root.name]
    while level:
        joints = [joint for link in level for joint in description.child_joints[link]]
        ordered += joints
        level = [joint.child for joint in joints]
    return tuple(ordered)


def prim_order_joints(description: RobotDescription) -> tuple[Joint, ...]:
    """Return all joints in the order of their prims on a USD stage: depth first by link, siblings together.

    The joints of one link's children are adjacent, unlike in plain depth-first order.
    """
    links = (description.root.name, *(joint.child for joint in description.depth_first_joints))
    return tuple(joint for link in links for joint in description.child_joints[link])


def single_dof_joints(joints: Iterable[Joint], frozen: Collection[str] = ()) -> tuple[Joint, ...]:
    """Return the joints with one degree of freedom, mimic joints included, `frozen` names excluded."""
    return tuple(joint for joint in joints if joint.type in SINGLE_DOF_TYPES and joint.name not in frozen)


def reorder(from_names: Sequence[str], to_names: Sequence[str]) -> NDArray[np.intp]:
    """Return the index array that turns a vector in the order `from_names` into one in the order `to_names`.

    `vector[..., reorder(from_names, to_names)]` has one entry for each of `to_names`; these may be fewer.

    Returns:
        (len(to_names),) indices into `from_names`.

    Raises:
        KeyError: a name of `to_names` is not in `from_names`.
    """
    index = {name: i for i, name in enumerate(from_names)}
    missing = next((name for name in to_names if name not in index), None)
    if missing is not None:
        raise KeyError(unknown_name("joint", missing, from_names))
    return np.array([index[name] for name in to_names], dtype=np.intp)
