"""Joints that close loops of links, as equalities between sites of MuJoCo."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from roboyard.description.loops import points_of
from roboyard.description.model import Pose, RobotDescription
from roboyard.sim.build.records import Built
from roboyard.transforms import to_wxyz

if TYPE_CHECKING:
    from roboyard._mujoco import mujoco


def add_loops(
    built: Built, spec: mujoco.MjSpec, description: RobotDescription, prefix: str, scale: float
) -> None:
    """Add the loop joints of a description; the links that they join do not collide with each other.

    Args:
        built: gets the elements.
        spec: the spec.
        description: the robot.
        prefix: of all names.
        scale: uniform length scale.
    """
    from roboyard._mujoco import mujoco

    bodies = {record.name: record.element for record in built.links}
    for loop in description.loops:
        name = f"{prefix}{loop.name}/loop"
        ends = ((loop.first, loop.first_origin), (loop.second, loop.second_origin))
        weld = loop.type == "fixed"
        for number, shift in enumerate(points_of(loop)):
            for side, (link, pose) in zip("ab", ends, strict=True):
                position = (np.asarray(pose.position) + _turned(pose, shift)) * scale
                bodies[link].add_site(
                    name=f"{name}/{number}{side}",
                    pos=position,
                    quat=to_wxyz(pose.quaternion),
                    size=[0.001, 0.001, 0.001],
                    group=5,
                )
            equality = spec.add_equality(
                name=f"{name}/{number}",
                type=mujoco.mjtEq.mjEQ_WELD if weld else mujoco.mjtEq.mjEQ_CONNECT,
                objtype=mujoco.mjtObj.mjOBJ_SITE,
                name1=f"{name}/{number}a",
                name2=f"{name}/{number}b",
            )
            if weld:
                data = np.zeros(len(equality.data))
                data[10] = 1.0  # of the torque, beside the force
                equality.data = data
            equality.solref = [0.005, 1.0]
            equality.solimp = [0.99, 0.999, 0.001, 0.5, 2.0]
            built.equalities.append(equality)
        built.equalities.append(
            spec.add_exclude(
                name=f"{name}/apart", bodyname1=f"{prefix}{loop.first}", bodyname2=f"{prefix}{loop.second}"
            )
        )


def _turned(pose: Pose, vector: tuple[float, float, float]) -> np.ndarray:
    return pose.matrix()[:3, :3] @ np.asarray(vector)
