"""Gripper poses that move a drawer or a door: to the handle, along the joint, and away."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from roboyard.sim.joint import Joint
from roboyard.skills.grasps import Grasp
from roboyard.skills.gripper_frame import heading, shifted
from roboyard.skills.tracks import Drawn, bases_around, moved_with
from roboyard.skills.worker import Worker
from roboyard.transforms import Array

BEFORE = (-0.12, -0.06, 0.0)
"""Distances from the handle at which a gripper stops before it grips (m)."""
AFTER = (-0.06, -0.12)
"""Distances from the handle after it is let go (m)."""
STEP_TURN, STEP_SHIFT = 0.12, 0.05
"""Motion of a joint from one pose to the next (rad, m)."""


@dataclass(frozen=True, kw_only=True, eq=False)
class JointWay:
    """The way of a joint in the world frame."""

    anchor: Array
    """(3,) m"""
    axis: Array
    """(3,) unit vector."""
    is_hinge: bool
    values: Array
    """(k,) positions from the present one to the goal (rad or m)."""
    geoms: frozenset[int]
    """MuJoCo geoms that move with it."""

    def motion(self, value: float) -> Array:
        """Return the (4, 4) motion of the world frame from the present position to another (rad or m)."""
        out = np.eye(4)
        change = value - float(self.values[0])
        if self.is_hinge:
            out[:3, :3] = Rotation.from_rotvec(change * self.axis).as_matrix()
            out[:3, 3] = self.anchor - out[:3, :3] @ self.anchor
        else:
            out[:3, 3] = change * self.axis
        return out


def way_of(joint: Joint, goal: float) -> JointWay:
    """Return the way of a joint from where it is to a position (rad or m)."""
    world: Any = joint.body.world
    world.kinematics()
    row = int(world.model.dof_jntid[joint.dof_slice.start])
    is_hinge = joint.type != "prismatic"
    now = float(joint.position)
    steps = max(2, int(np.ceil(abs(goal - now) / (STEP_TURN if is_hinge else STEP_SHIFT))) + 1)
    below = {joint.child.index}
    geoms: set[int] = set()
    for link in joint.body.links:
        if link.index in below or (link.parent is not None and link.parent.index in below):
            below.add(link.index)
            geoms |= set(link.geom_ids)
    return JointWay(
        anchor=np.array(world.data.xanchor[row]),
        axis=np.array(world.data.xaxis[row]),
        is_hinge=is_hinge,
        values=np.linspace(now, goal, steps),
        geoms=frozenset(geoms),
    )


def draw_joint_tracks(worker: Worker, way: JointWay, grasps: list[Grasp], draws: Array) -> Drawn:
    """Return tracks that grip a handle, move its joint along its way, and let go.

    The gripper may turn about a bar that it holds, and the base moves by a share of the gripper's motion.

    Args:
        worker: the robot.
        way: of the joint.
        grasps: of the handle, best first.
        draws: (s, 9) numbers from 0 to 1.
    """
    motions = np.array([way.motion(float(value)) for value in way.values])
    spins = way.values - way.values[0] if way.is_hinge else np.zeros(len(way.values))
    follows = np.maximum(1.25 * draws[:, 4] - 0.25, 0.0)
    turned = (1.3 * draws[:, 5] - 0.3) * (follows > 0)
    whole = np.concatenate([np.zeros(len(BEFORE) - 1), spins, np.full(len(AFTER), spins[-1])])
    chosen = [grasps[int(min(len(grasps) - 1, place**1.5 * len(grasps)))] for place in draws[:, 6]]
    first, slip = (draws[:, 7] - 0.5) * 1.4, 1.2 * draws[:, 8] - 1.0
    held = _held(way, motions, chosen, first, slip[:, None] * spins)
    before = [shifted(held[:, 0], away) for away in BEFORE[:-1]]
    grips = np.stack([*before, *held.swapaxes(0, 1), *(shifted(held[:, -1], away) for away in AFTER)], axis=1)
    turns = (follows * turned)[:, None] * whole * float(way.axis[2])
    facing = np.array([heading(pose) for pose in grips[:, 0]])
    cost = np.array([grasp.cost for grasp in chosen]) + 0.1 * np.abs(first)
    points = grips[:, 0, :3, 3]
    bases = bases_around(worker, points, facing, draws)
    # the base rests while the gripper approaches and leaves, and moves with it in between
    middle = grips.copy()
    middle[:, : len(BEFORE) - 1] = grips[:, len(BEFORE) - 1 : len(BEFORE)]
    middle[:, -len(AFTER) :] = grips[:, -len(AFTER) - 1 : -len(AFTER)]
    return Drawn(grips=grips, bases=moved_with(middle, follows, turns, bases, worker), cost=cost)


def _held(way: JointWay, motions: Array, grasps: list[Grasp], first: Array, slips: Array) -> Array:
    """Return the (s, k, 4, 4) poses of grippers that hold their handle (m).

    Args:
        way: of the joint.
        motions: (k, 4, 4) of the world frame along the way (m).
        grasps: one for each of the s grippers.
        first: (s,) turns about the held bar before the joint moves (rad).
        slips: (s, k) further turns about it while a hinge moves (rad).
    """
    is_bar = np.array([grasp.swivel is not None for grasp in grasps])
    bars = np.array([np.zeros(3) if grasp.swivel is None else grasp.swivel for grasp in grasps])
    poses = np.array([grasp.pose for grasp in grasps])
    poses[:, :3, :3] = _turns(first[:, None] * bars) @ poses[:, :3, :3]
    held = motions @ poses[:, None]
    if way.is_hinge:
        turns = _turns((slips * is_bar[:, None])[:, :, None] * way.axis)
        held[:, :, :3, :3] = turns @ held[:, :, :3, :3]
    return held


def _turns(vectors: Array) -> Array:
    """Return the (..., 3, 3) rotations by (..., 3) rotation vectors (rad)."""
    return Rotation.from_rotvec(vectors.reshape(-1, 3)).as_matrix().reshape(*vectors.shape[:-1], 3, 3)
