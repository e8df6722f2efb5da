"""Pictures of a world: colour, depth and ids, with no graphics library needed.

>>> from roboyard.rendering import Camera, render, save_png
>>> camera = Camera.look_at(eye=(1.5, -1.5, 1.0), target=(0, 0, 0.4), width=640, height=480)
>>> image = world.render(camera)
>>> save_png("robot.png", image)
"""

from __future__ import annotations

from roboyard.rendering.camera import Camera, fitted_viewpoint
from roboyard.rendering.files import (
    contact_sheet,
    depth_to_rgb,
    png_bytes,
    save_gif,
    save_png,
    segmentation_to_rgb,
    side_by_side,
)
from roboyard.rendering.image import Image, depth_buffer
from roboyard.rendering.light import STUDIO, UNLIT, Backdrop, Light
from roboyard.rendering.renderer import render
from roboyard.rendering.scene import DebugLines, RenderScene, RenderShape

__all__ = [
    "STUDIO",
    "UNLIT",
    "Backdrop",
    "Camera",
    "DebugLines",
    "Image",
    "Light",
    "RenderScene",
    "RenderShape",
    "contact_sheet",
    "depth_buffer",
    "depth_to_rgb",
    "fitted_viewpoint",
    "png_bytes",
    "render",
    "save_gif",
    "save_png",
    "segmentation_to_rgb",
    "side_by_side",
]
