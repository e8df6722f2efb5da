"""Postures of an arm without contacts, and the points that its end effector reaches in them."""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np

from roboyard.errors import ConfigError
from roboyard.robots.robot import Robot
from roboyard.transforms import Array

TRIES = 4000
"""Postures drawn at most."""
LOWEST = 0.05
"""Least height of the end effector above the robot's root frame (m)."""
NEAREST = 0.4
"""Least distance of the end effector from the arm's first joint, as a share of the largest."""


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Reachable:
    """k postures of a robot that differ in one arm."""

    q: Array
    """(k, n) joint positions of the robot (rad or m)."""
    tips: Array
    """(k, 3) positions of the end effector in the world frame (m)."""
    dexterity: Array
    """(k,) smallest singular value of the Jacobian of the tip's position (m/rad)."""


def reachable(
    robot: Robot,
    arm: str,
    count: int = 256,
    *,
    seed: int = 0,
    share: float = 0.8,
    around: Array | None = None,
) -> Reachable:
    """Return postures drawn at random that touch nothing, with the points that they reach.

    Args:
        robot: in its world, with everything that it may touch.
        arm: that moves; all other joints stay.
        count: most postures.
        seed: of the random numbers.
        share: part of the range of each joint that is drawn from.
        around: (n,) the posture in the middle of that part; by default the middle of the joints' limits.

    Raises:
        ConfigError: the arm finds no posture without contact.
    """
    world = robot.world
    manipulation = robot.manipulation
    assert manipulation is not None
    places = manipulation.arm_control_idx[arm]
    low, high = robot.limits.lower[places], robot.limits.upper[places]
    low, high = np.maximum(low, -np.pi), np.minimum(high, np.pi)
    half = share * (high - low) / 2
    middle = (low + high) / 2 if around is None else around[places]
    model, data = world.model, world.data
    joints = robot.joint_arrays
    joints.bind()
    row = int(robot.body.mujoco_ids[manipulation.eef_links[arm].index])
    first = int(model.jnt_bodyid[model.dof_jntid[joints.dofs[places[0]]]])
    before = data.qpos.copy()
    own = np.isin(model.geom_bodyid, robot.body.mujoco_ids)
    start = joints.q
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)
    mujoco.mj_collision(model, data)
    touching = _touching(model, data, own)
    jacobian = np.zeros((3, model.nv))
    random = np.random.default_rng(seed)
    found: list[tuple[Array, Array, float, float]] = []
    try:
        for _ in range(TRIES):
            q = start.copy()
            q[places] = np.clip(middle + half * random.uniform(-1.0, 1.0, len(places)), low, high)
            joints.q = q
            mujoco.mj_kinematics(model, data)
            mujoco.mj_comPos(model, data)
            tip = data.xpos[row].copy()
            mujoco.mj_collision(model, data)
            if tip[2] < robot.body.pose[0][2] + LOWEST or _touching(model, data, own) - touching:
                continue
            mujoco.mj_jac(model, data, jacobian, None, tip, row)
            values = np.linalg.svd(jacobian[:, joints.dofs[places]], compute_uv=False)
            found.append((q, tip, float(values[-1]), float(np.linalg.norm(tip - data.xpos[first]))))
            if len(found) == 2 * count:
                break
    finally:
        data.qpos[:] = before
        world.mark_moved()
    if not found:
        raise ConfigError(f"arm {arm!r} of robot {robot.name!r} finds no posture without contact")
    longest = max(reach for *_, reach in found)
    kept = [entry for entry in found if entry[3] >= NEAREST * longest][:count]
    return Reachable(
        q=np.array([entry[0] for entry in kept]),
        tips=np.array([entry[1] for entry in kept]),
        dexterity=np.array([entry[2] for entry in kept]),
    )


def ready_posture(robot: Robot, found: Reachable, arm: str) -> Array:
    """Return the (n,) posture to start in: the reset posture, or where there is none a dexterous one.

    Args:
        robot: with the arm.
        found: postures of the arm.
        arm: its name.
    """
    assert robot.manipulation is not None
    q = robot.reset_joint_pos
    places = robot.manipulation.arm_control_idx[arm]
    if robot.has_reset_pose and np.abs(q[places]).max(initial=0.0) > 1e-3:
        return q
    centre = np.median(found.tips, axis=0)
    spread = max(float(np.abs(found.tips - centre).max()), 1e-9)
    score = found.dexterity / found.dexterity.max() - np.linalg.norm(found.tips - centre, axis=1) / spread
    return found.q[int(np.argmax(score))]


def _touching(model: mujoco.MjModel, data: mujoco.MjData, own: np.ndarray) -> set[tuple[int, int]]:
    """Return the pairs of shapes in contact of which one is the robot's."""
    pairs = data.contact.geom
    deep = data.contact.dist < 0.0
    return {(int(a), int(b)) for a, b in pairs[deep] if own[a] or own[b]}
