"""Postures of a trunk that bring the shoulders to a height, upright and above the base."""

from __future__ import annotations

import numpy as np

from roboyard.kinematics import forward_kinematics
from roboyard.kinematics.chain import from_description
from roboyard.skills.worker import Worker
from roboyard.transforms import Array

ABOVE = 0.30
"""Height of the shoulders above where a gripper works (m)."""


def trunk_postures(worker: Worker, arm: str, height: float) -> list[Array]:
    """Return postures (n,) of the trunk's joints (rad or m) to work at a height in the world frame (m), the
    present one first where the shoulders are within 0.2 m of what suits the height.
    """
    if not worker.trunk_joints:
        return [np.zeros(0)]
    description, mount = worker.robot.description, worker.mount(arm)
    base = worker.robot.base_link.name
    chain = from_description(description, mount, base)
    names = list(worker.trunk_joints)
    rows = [chain.joint_names.index(name) for name in names]
    state = worker.state()
    fixed = np.array([state[name] for name in chain.joint_names])
    shoulder = description.joint_by_name[worker.arm_joints(arm)[0]].origin.matrix()[:3, 3]
    lower, upper = chain.lower[rows], chain.upper[rows]
    floor = float(worker.robot.position[2])

    def cost(trunks: Array, wanted: float) -> Array:
        q = np.repeat(fixed[None], len(trunks), axis=0)
        q[:, rows] = trunks
        poses = forward_kinematics(chain, q, mount)
        at = poses[:, :3, :3] @ shoulder + poses[:, :3, 3]
        zero = fixed.copy()
        zero[rows] = np.clip(0.0, lower, upper)
        upright = forward_kinematics(chain, zero, mount)
        tilt = np.arccos(np.clip((np.einsum("sij,ij->s", poses[:, :3, :3], upright[:3, :3]) - 1) / 2, -1, 1))
        ahead = np.abs(poses[:, :2, 3] - upright[:2, 3]).max(axis=1)
        return 3.0 * np.abs(at[:, 2] + floor - wanted) + 1.0 * tilt + 2.0 * ahead

    random = np.random.default_rng(0)
    present = worker.positions(names)
    found = [present]
    for above in (ABOVE, ABOVE + 0.15, ABOVE - 0.15):
        wanted = height + above
        trunks = np.concatenate([random.uniform(lower, upper, (1500, len(names))), present[None]])
        for spread in (0.3, 0.1, 0.03, 0.01):
            best = trunks[np.argsort(cost(trunks, wanted))[:20]]
            near = np.repeat(best, 20, axis=0) + random.normal(size=(400, len(names))) * spread
            trunks = np.concatenate([best, np.clip(near, lower, upper)])
        found.append(trunks[int(np.argmin(cost(trunks, wanted)))])
    suits = float(cost(present[None], height + ABOVE)[0]) < 0.6
    return found if suits else [*found[1:], present]
