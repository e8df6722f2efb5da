"""Checks of a robot in the inspector, with the links of their violations."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from roboyard.viewer.inspector.checks.audit_findings import joints, masses, self_collision
from roboyard.viewer.inspector.checks.motion import gripper, holds_posture
from roboyard.viewer.inspector.checks.sensors import cameras
from roboyard.viewer.inspector.checks.shapes import base_frame, collision_fits, wheels
from roboyard.viewer.inspector.checks.status import CheckContext, CheckResult, Violation

CHECKS: Mapping[str, Callable[[CheckContext], CheckResult]] = {
    "collision shapes fit": collision_fits,
    "no unexpected self-collision": self_collision,
    "masses and inertias are plausible": masses,
    "axes and limits are plausible": joints,
    "the drives hold the posture": holds_posture,
    "the base frame is at the bottom": base_frame,
    "wheels are round and on the floor": wheels,
    "the gripper opens and closes": gripper,
    "cameras are not occluded": cameras,
}
"""Title of each check and its function."""

__all__ = ["CHECKS", "CheckContext", "CheckResult", "Violation"]
