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
    count = len(draws)
    k = len(BEFORE) + len(way.values) - 1 + len(AFTER)
    grips = np.empty((count, k, 4, 4))
    turns = np.zeros((count, k))
    cost, facing, points = np.empty(count), np.empty(count), np.empty((count, 3))
    motions = [way.motion(float(value)) for value in way.values]
    spins = way.values - way.values[0] if way.is_hinge else np.zeros(len(way.values))
    follows = np.maximum(1.25 * draws[:, 4] - 0.25, 0.0)
    turned = (1.3 * draws[:, 5] - 0.3) * (follows > 0)
    whole = np.concatenate([np.zeros(len(BEFORE) - 1), spins, np.full(len(AFTER), spins[-1])])
    for s in range(count):
        grasp = grasps[int(min(len(grasps) - 1, draws[s, 6] ** 1.5 * len(grasps)))]
        first, slip = (draws[s, 7] - 0.5) * 1.4, 1.2 * draws[s, 8] - 1.0
        held = []
        for motion, spin in zip(motions, spins, strict=True):
            pose = motion @ _swivelled(grasp, first)
            if grasp.swivel is not None and way.is_hinge:
                pose = _turned(pose, way.axis, slip * float(spin), motion @ _held_point(grasp))
            held.append(pose)
        row = [shifted(held[0], away) for away in BEFORE[:-1]] + held
        row += [shifted(held[-1], away) for away in AFTER]
        grips[s] = row
        turns[s] = follows[s] * turned[s] * whole * float(way.axis[2])
        facing[s] = heading(row[0])
        points[s] = row[0][:3, 3]
        cost[s] = grasp.cost + 0.1 * abs(first)
    bases = bases_around(worker, points, facing, draws)
    # the base rests while the gripper approaches and leaves, and moves with it in between
    middle = grips.copy()
    middle[:, : len(BEFORE) - 1] = grips[:, len(BEFORE) - 1 : len(BEFORE)]
    middle[:, -len(AFTER) :] = grips[:, -len(AFTER) - 1 : -len(AFTER)]
    return Drawn(grips=grips, bases=moved_with(middle, follows, turns, bases, worker), cost=cost)


def _held_point(grasp: Grasp) -> Array:
    return np.append(grasp.pose[:3, 3], 1.0)


def _swivelled(grasp: Grasp, angle: float) -> Array:
    if grasp.swivel is None:
        return grasp.pose
    return _turned(grasp.pose, grasp.swivel, angle, _held_point(grasp))


def _turned(pose: Array, axis: Array, angle: float, about: Array) -> Array:
    out = pose.copy()
    turn = Rotation.from_rotvec(angle * axis).as_matrix()
    out[:3, :3] = turn @ pose[:3, :3]
    out[:3, 3] = about[:3] + turn @ (pose[:3, 3] - about[:3])
    return out
