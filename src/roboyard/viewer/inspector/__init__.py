"""The inspector: a robot on a page with everything there is to check before it is used."""

from __future__ import annotations

from roboyard.viewer.inspector.inspector import Inspector
from roboyard.viewer.inspector.robot_source import RobotSource, find_robot

__all__ = ["Inspector", "RobotSource", "find_robot"]
