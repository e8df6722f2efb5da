"""A robot as one HTML file that opens anywhere, with joints to move and layers to toggle."""

from __future__ import annotations

from roboyard.reports.robot_page.page import robot_page

__all__ = ["robot_page"]
