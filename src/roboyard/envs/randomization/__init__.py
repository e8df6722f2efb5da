"""Differences from episode to episode, by declaration: masses, friction, gains, delays, start states, looks.

Each is drawn again at the start of an episode from the environment's own stream.
"""

from __future__ import annotations

from roboyard.envs.randomization.declared import Randomization
from roboyard.envs.randomization.dynamics import Delay, Friction, Gains, Gravity, Mass
from roboyard.envs.randomization.looks import CameraPose, Color, Lighting
from roboyard.envs.randomization.randomizer import Randomizer
from roboyard.envs.randomization.starts import JointNoise, Pose

__all__ = [
    "CameraPose",
    "Color",
    "Delay",
    "Friction",
    "Gains",
    "Gravity",
    "JointNoise",
    "Lighting",
    "Mass",
    "Pose",
    "Randomization",
    "Randomizer",
]
