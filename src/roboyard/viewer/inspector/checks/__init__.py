"""What people are told to check by eye before they use a robot, checked and pointed at."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from roboyard.viewer.inspector.checks.audit_findings import joints, masses, self_collision
from roboyard.viewer.inspector.checks.motion import gripper, settles
from roboyard.viewer.inspector.checks.sensors import cameras
from roboyard.viewer.inspector.checks.shapes import base_frame, collision_fits, wheels
from roboyard.viewer.inspector.checks.status import CheckContext, CheckResult, Violation

CHECKS: Mapping[str, Callable[[CheckContext], CheckResult]] = {
    "collision shapes fit": collision_fits,
    "links keep clear of one another": self_collision,
    "masses and inertias are sane": masses,
    "axes and limits are sane": joints,
    "the robot settles": settles,
    "the base frame is at the bottom": base_frame,
    "wheels are round and on the floor": wheels,
    "the gripper opens and closes": gripper,
    "cameras look past the robot": cameras,
}
"""What is claimed, and the function that tries it."""

__all__ = ["CHECKS", "CheckContext", "CheckResult", "Violation"]
