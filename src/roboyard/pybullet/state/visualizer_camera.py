"""The camera and the switches of the visualizer."""

from __future__ import annotations

from dataclasses import field
from typing import Any

from roboyard._records import dataclass
from roboyard.pybullet.face import constants as c
from roboyard.pybullet.face.arguments import Vector3

WINDOW_METHODS = (c.GUI, c.GUI_SERVER, c.GUI_MAIN_THREAD)
"""Connection methods with a window, whose images show shapes with alpha < 1 as transparent."""
WIDTH, HEIGHT = 1024, 768
FIELD_OF_VIEW = 90.0
"""Vertical field of view (degrees)."""


@dataclass(kw_only=True, slots=True)
class VisualizerCamera:
    """Pose of the window's camera, and the flags and settings of configureDebugVisualizer."""

    distance: float = 5.0
    """Distance from the target (m)."""
    yaw: float = 50.0
    """Rotation about the up axis (degrees)."""
    pitch: float = -35.0
    """Elevation (degrees); negative looks down."""
    target: Vector3 = (0.0, 0.0, 0.0)
    """Point that the camera looks at (m)."""
    up_axis: int = 2
    """1 for y, 2 for z."""
    width: int = WIDTH
    """Width of the picture (pixels)."""
    height: int = HEIGHT
    """Height of the picture (pixels)."""
    switches: dict[int, int] = field(default_factory=dict)
    """COV_... flag to 0 or 1."""
    settings: dict[str, Any] = field(default_factory=dict)
    """lightPosition, shadowMapResolution, rgbBackground, ... as last set."""
