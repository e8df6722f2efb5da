"""Driving on a page: keys, sticks, handles on the hands, grippers, films and saved moments."""

from __future__ import annotations

from roboyard.viewer.driving.page import DrivingPage

__all__ = ["DrivingPage"]
