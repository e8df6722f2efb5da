"""What a robot can do, by block of its definition: one small object a capability, None where the block is
absent.
"""

from __future__ import annotations

from roboyard.robots.interfaces.base import FixedBase, FloatingBase, HolonomicBase
from roboyard.robots.interfaces.manipulation import Manipulation
from roboyard.robots.interfaces.parts import ActiveCamera, ArticulatedTrunk, Locomotion
from roboyard.robots.interfaces.tucking import MobileManipulation
from roboyard.robots.interfaces.two_wheel import TwoWheel

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
