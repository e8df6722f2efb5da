"""The frame of a gripper, worked out from the shapes of its fingers.

z points out of the gripper, y from finger to finger; the origin is between the fingers, where they hold best.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from roboyard.planning.body_points import link_points
from roboyard.robots.robot_body import RobotBody
from roboyard.skills.outcome import SkillError
from roboyard.transforms import Array, inverse_pose, pose_matrix

PAD = 0.035
"""Distance of the origin from the fingertips, at most (m)."""


@dataclass(frozen=True, kw_only=True, eq=False)
class GripperFrame:
    """Where a gripper holds."""

    tool: str
    """End-effector link."""
    offset: Array
    """(4, 4) pose of the gripper frame in the end effector's frame (m)."""
    opening: float
    """Distance between the opened fingers (m)."""
    ahead: float
    """Distance from the origin to the fingertips (m)."""
    width: float
    """Width of the fingers, along x (m)."""
    fingers: tuple[str, ...]
    """Finger links."""

    def tool_pose(self, grip: Array) -> Array:
        """Return (..., 4, 4) poses of the end effector for poses of the gripper frame."""
        return grip @ inverse_pose(self.offset)


def gripper_frame(robot: RobotBody, arm: str) -> GripperFrame:
    """Return the frame of an arm's gripper; its fingers must be open.

    Raises:
        SkillError: the gripper has fewer than two fingers.
    """
    manipulation = robot.manipulation
    fingers = () if manipulation is None else manipulation.finger_links(arm)
    if manipulation is None or len(fingers) < 2:
        raise SkillError(f'arm "{arm}" has no gripper with two fingers; name finger_link_names')
    tool = manipulation.eef_links[arm]
    into_tool = inverse_pose(pose_matrix(*tool.pose))
    points = [_moved(link_points([finger], 800), into_tool) for finger in fingers]
    first, others = points[0], np.concatenate(points[1:])
    parent = robot.body.joint_of(fingers[0])
    palm = np.zeros(3) if parent is None else _moved(parent.parent.pose[0][None], into_tool)[0]
    middle = 0.5 * (_middle(first) + _middle(others))
    y = _middle(others) - _middle(first)
    y /= np.linalg.norm(y)
    z = middle - palm
    z -= (z @ y) * y
    if np.linalg.norm(z) < 1e-6:
        raise SkillError(f'arm "{arm}": its fingers do not point away from the palm; check the description')
    z /= np.linalg.norm(z)
    x = np.cross(y, z)
    tip = min(float((first @ z).max()), float((others @ z).max()))
    foot = float((np.concatenate(points) @ z).min())
    ahead = min(PAD, 0.5 * (tip - foot))
    near_tip = [p[p @ z > tip - 2 * ahead] for p in (first, others)]
    inner, outer = float((near_tip[0] @ y).max()), float((near_tip[1] @ y).min())
    offset = np.eye(4)
    offset[:3, :3] = np.stack([x, y, z], axis=1)
    across = np.concatenate(near_tip) @ x
    offset[:3, 3] = x * 0.5 * (across.min() + across.max()) + y * 0.5 * (inner + outer) + z * (tip - ahead)
    return GripperFrame(
        tool=tool.name,
        offset=offset,
        opening=outer - inner,
        ahead=ahead,
        width=float(np.ptp(across)),
        fingers=tuple(finger.name for finger in fingers),
    )


def pointing(along: Array, across: Array, at: Array) -> Array:
    """Return the (4, 4) pose of a gripper at a point, which points `along`, its fingers apart `across`."""
    z = along / np.linalg.norm(along)
    y = across - (across @ z) * z
    y = y / np.linalg.norm(y)
    out = np.eye(4)
    out[:3, :3], out[:3, 3] = np.stack([np.cross(y, z), y, z], axis=1), at
    return out


def shifted(pose: Array, distance: float) -> Array:
    """Return (..., 4, 4) gripper poses moved along their z axes by a distance (m)."""
    out = pose.copy()
    out[..., :3, 3] += distance * pose[..., :3, 2]
    return out


def heading(pose: Array) -> float:
    """Return the direction around the vertical in which a (4, 4) gripper pose points (rad); NaN where it
    points up or down.
    """
    x, y, _ = pose[:3, 2]
    return float(np.arctan2(y, x)) if np.hypot(x, y) > 0.3 else float("nan")


def _moved(points: Array, matrix: Array) -> Array:
    return points @ matrix[:3, :3].T + matrix[:3, 3]


def _middle(points: Array) -> Array:
    return 0.5 * (points.min(axis=0) + points.max(axis=0))
