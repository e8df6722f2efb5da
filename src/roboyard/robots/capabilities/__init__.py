"""Capabilities of a robot, one object for each block of its definition."""

from __future__ import annotations

from roboyard.robots.capabilities.base import FixedBase, FloatingBase, HolonomicBase
from roboyard.robots.capabilities.manipulation import Arm, Arms, Manipulation
from roboyard.robots.capabilities.parts import ActiveCamera, ArticulatedTrunk, Locomotion
from roboyard.robots.capabilities.tucking import MobileManipulation
from roboyard.robots.capabilities.two_wheel import TwoWheel

__all__ = [
    "ActiveCamera",
    "Arm",
    "Arms",
    "ArticulatedTrunk",
    "FixedBase",
    "FloatingBase",
    "HolonomicBase",
    "Locomotion",
    "Manipulation",
    "MobileManipulation",
    "TwoWheel",
]
