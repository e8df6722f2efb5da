"""What a robot can do, by block of its definition: one small object a capability, None where the block is
absent.
"""

from __future__ import annotations

from roboyard.robots.capabilities.base import FixedBase, FloatingBase, HolonomicBase
from roboyard.robots.capabilities.manipulation import Manipulation
from roboyard.robots.capabilities.parts import ActiveCamera, ArticulatedTrunk, Locomotion
from roboyard.robots.capabilities.tucking import MobileManipulation
from roboyard.robots.capabilities.two_wheel import TwoWheel

__all__ = [
    "ActiveCamera",
    "ArticulatedTrunk",
    "FixedBase",
    "FloatingBase",
    "HolonomicBase",
    "Locomotion",
    "Manipulation",
    "MobileManipulation",
    "TwoWheel",
]
