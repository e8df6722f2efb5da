"""The inspector: a robot in the browser with its checks and edits."""

from __future__ import annotations

from roboyard.viewer.inspector.inspector import Inspector
from roboyard.viewer.inspector.robot_source import RobotSource, find_robot

__all__ = ["Inspector", "RobotSource", "find_robot"]
