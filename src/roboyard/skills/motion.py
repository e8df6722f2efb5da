"""Motions by a robot's controllers: planned trajectories, and postures along a track of the gripper."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from roboyard.kinematics import forward_kinematics, solve_ik
from roboyard.kinematics.chain import ChainArrays
from roboyard.planning.goals import Goal
from roboyard.planning.trajectory import Plan, Trajectory
from roboyard.skills.outcome import SkillError
from roboyard.skills.worker import Worker, wrapped
from roboyard.transforms import Array, inverse_pose, pose_matrix

DRIVE_SPEED, DRIVE_ACCELERATION = (0.7, 0.7, 1.2), (0.8, 0.8, 1.5)
"""Speeds and accelerations of the base while driving (m/s, m/s, rad/s; m/s², m/s², rad/s²)."""
ARM_SPEED, ARM_ACCELERATION = 1.2, 3.0
"""Speed and acceleration of arm and trunk joints (rad/s, rad/s²)."""
TRACK_SPEED = 0.18
"""Speed of a gripper on a track (m/s)."""
DRIVE_ROOM, ARM_ROOM = 0.025, 0.008
"""Distance that motions keep where they can, since controllers follow them less exactly (m)."""
LOST = 0.30
"""Distance behind its path at which a base counts as blocked (m)."""
NEAR_JOINT, NEAR_BASE = 0.05, 0.03
"""Errors at which a motion has arrived (rad, m)."""
NEAR_GRIP, LOST_GRIP = 0.003, 0.05
"""Errors of a corrected gripper at which it has arrived, and at which it was stopped (m)."""
SETTLE = 1.5
"""Time to arrive after the end of a motion (s)."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Motion:
    """Positions of named joints over time."""

    names: tuple[str, ...]
    duration: float
    """s"""
    at: Callable[[float], tuple[Array, Array]]
    """Positions and velocities, each (n,), at a time (s)."""


def planned_motion(worker: Worker, plan: Plan) -> Motion:
    """Return a plan as a motion, slowed down to speeds and accelerations at which objects stay held.

    Raises:
        SkillError: the plan is no solution.
    """
    if plan.trajectory is None:
        raise SkillError(f"{plan.outcome}: {plan.reason}")
    trajectory = plan.trajectory
    speed = np.array([_limit(worker, name, DRIVE_SPEED, ARM_SPEED) for name in plan.joint_names])
    rise = np.array([_limit(worker, name, DRIVE_ACCELERATION, ARM_ACCELERATION) for name in plan.joint_names])
    factor = max(
        1.0,
        float((np.abs(trajectory.v) / speed).max()),
        float(np.sqrt((np.abs(trajectory.a) / rise).max())),
    )
    return Motion(
        names=plan.joint_names,
        duration=trajectory.duration * factor,
        at=lambda t: _scaled(trajectory, t, factor),
    )


def _limit(worker: Worker, name: str, base: Sequence[float], other: float) -> float:
    return base[worker.base_joints.index(name)] if name in worker.base_joints else other


def _scaled(trajectory: Trajectory, t: float, factor: float) -> tuple[Array, Array]:
    q, v, _, _ = trajectory.at(t / factor)
    return q, v / factor


def track_motion(names: Sequence[str], postures: Array, grips: Array) -> Motion:
    """Return a motion through (k, n) postures whose gripper passes (k, 4, 4) poses, at rest at both ends."""
    from scipy.interpolate import PchipInterpolator

    moved = np.linalg.norm(np.diff(grips[:, :3, 3], axis=0), axis=1) / TRACK_SPEED
    turned = np.abs(np.diff(postures, axis=0)).max(axis=1) / 0.6
    times = np.concatenate([[0.0], np.cumsum(np.maximum(np.maximum(moved, turned), 0.05))])
    curve = PchipInterpolator(times, postures, axis=0)
    slope = curve.derivative()
    whole = float(times[-1])
    duration = 1.5 * whole  # the fastest moment of the cubic below is 1.5 times the mean

    def at(t: float) -> tuple[Array, Array]:
        u = min(max(t / duration, 0.0), 1.0)
        s, ds = u * u * (3 - 2 * u), 6 * u * (1 - u) / duration
        return curve(s * whole), slope(s * whole) * ds * whole

    return Motion(names=tuple(names), duration=duration, at=at)


def follow(
    worker: Worker, motion: Motion, *, arm: str | None = None, chain: ChainArrays | None = None
) -> None:
    """Run a motion, and wait until it has arrived.

    Args:
        worker: the robot.
        motion: positions over time.
        arm: an arm whose gripper is to stay on its path in the world while the base follows less exactly.
        chain: kinematics of all joints of the motion from the root link, with `arm`.

    Raises:
        SkillError: the base is blocked, or joints do not arrive.
    """
    begin = worker.world.time
    while worker.world.time < begin + motion.duration:
        q, v = motion.at(worker.world.time - begin + 1.0 / worker.robot.control_freq)
        _command(worker, motion, q, v, arm, chain)
        if worker.base_joints and set(worker.base_joints) <= set(motion.names):
            wanted = np.array([q[motion.names.index(name)] for name in worker.base_joints])
            if np.linalg.norm((wanted - worker.base)[:2]) > LOST:
                _hold(worker)
                raise SkillError(f"the base was blocked{_by(worker)}; clear the way")
    end = motion.at(motion.duration)[0]
    while worker.world.time < begin + motion.duration + SETTLE:
        if (
            _error(worker, motion, end, arm) < 1.0
            and _grip_error(worker, motion, end, arm, chain) < NEAR_GRIP
        ):
            break
        _command(worker, motion, end, np.zeros_like(end), arm, chain)
    _hold(worker)
    if _error(worker, motion, end, arm) > 3.0 or _grip_error(worker, motion, end, arm, chain) > LOST_GRIP:
        raise SkillError(f"the motion stopped before its end{_by(worker)}; clear the way")


def _grip_error(
    worker: Worker, motion: Motion, end: Array, arm: str | None, chain: ChainArrays | None
) -> float:
    """Return the distance of a corrected gripper from the end of a motion (m)."""
    if arm is None or chain is None:
        return 0.0
    wanted = _tool(worker, dict(zip(motion.names, end.tolist(), strict=True)), arm, chain)
    return float(np.linalg.norm(wanted[:3, 3] - worker.robot.arms[arm].pose[0]))


def _hold(worker: Worker) -> None:
    worker.step({})


def _by(worker: Worker) -> str:
    touched = worker.touched()
    return f" by {', '.join(touched)}" if touched else ""


def _error(worker: Worker, motion: Motion, end: Array, arm: str | None) -> float:
    """Return the largest error, as a multiple of what counts as arrived; without an arm that is corrected."""
    skipped = worker.arm_joints(arm) if arm is not None else ()
    worst = 0.0
    for name, value, now in zip(motion.names, end, worker.positions(motion.names), strict=True):
        if name not in skipped:
            near = NEAR_BASE if name in worker.base_joints else NEAR_JOINT
            worst = max(worst, abs(float(value - now)) / near)
    return worst


def _command(
    worker: Worker, motion: Motion, q: Array, v: Array, arm: str | None, chain: ChainArrays | None
) -> None:
    goals = dict(zip(motion.names, q.tolist(), strict=True))
    if arm is not None and chain is not None:
        goals |= _corrected(worker, goals, arm, chain)
    commands = worker.joint_commands(goals)
    if worker.base_joints and worker.base_joints[0] in goals:
        rows = [motion.names.index(name) for name in worker.base_joints]
        commands["base"] = base_command(worker, q[rows], v[rows])
    worker.step(commands)


def base_command(worker: Worker, wanted: Array, velocity: Array) -> Array:
    """Return the (3,) velocity in the base's frame towards wanted base joints (3,), moving at `velocity`."""
    x, y, yaw = worker.base
    along = velocity[:2] + 3.0 * (wanted[:2] - (x, y))
    speed = float(np.hypot(*along))
    along = along * min(1.0, 1.0 / max(speed, 1e-9))
    c, s = np.cos(yaw), np.sin(yaw)
    turn = float(np.clip(velocity[2] + 3.0 * wrapped(wanted[2] - yaw), -1.6, 1.6))
    return np.array([c * along[0] + s * along[1], -s * along[0] + c * along[1], turn])


def _corrected(worker: Worker, goals: dict[str, float], arm: str, chain: ChainArrays) -> dict[str, float]:
    """Return arm goals that keep the gripper where the motion has it, from where base and trunk are now."""
    own = worker.arm_chain(arm)
    state = worker.state()
    wanted = _tool(worker, goals, arm, chain)
    mount = pose_matrix(*worker.robot.link(worker.mount(arm)).pose)
    near = [goals.get(name, state[name]) for name in own.joint_names]
    found = solve_ik(own, inverse_pose(mount) @ wanted, near, iterations=12, restarts=0)
    if np.abs(found.q - near).max() > 0.5:
        return {}
    return dict(zip(own.joint_names, found.q.tolist(), strict=True))


def _tool(worker: Worker, goals: dict[str, float], arm: str, chain: ChainArrays) -> Array:
    """Return the (4, 4) pose of the end effector in the world frame (m) at joint goals by name."""
    state = worker.state()
    q = [goals.get(name, state[name]) for name in chain.joint_names]
    return worker.root @ forward_kinematics(chain, q, worker.gripper(arm).tool)


def go(
    worker: Worker,
    goal: Goal | Sequence[Goal],
    arm: str | None,
    *,
    torso: bool = False,
    base: bool = False,
    time_limit: float = 3.0,
) -> None:
    """Plan to a goal from where the robot is now, and move there.

    Raises:
        SkillError: no motion was found, or it was blocked.
    """
    worker.step_back()
    planner = worker.planner(arm, torso=torso, base=base, room=DRIVE_ROOM if base else ARM_ROOM)
    follow(worker, planned_motion(worker, planner.plan(goal, time_limit=time_limit)))
