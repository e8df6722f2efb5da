"""configureDebugVisualizer: what a flag or setting does to the page."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from roboyard.pybullet.face import constants as c

if TYPE_CHECKING:
    from roboyard.pybullet.state.visualizer_camera import VisualizerCamera
    from roboyard.pybullet.window.dragging import Dragging
    from roboyard.viewer import Viewer

AT_START = {
    c.COV_ENABLE_GUI: 1,
    c.COV_ENABLE_SHADOWS: 1,
    c.COV_ENABLE_WIREFRAME: 0,
    c.COV_ENABLE_RENDERING: 1,
    c.COV_ENABLE_KEYBOARD_SHORTCUTS: 1,
    c.COV_ENABLE_MOUSE_PICKING: 1,
    c.COV_ENABLE_Y_AXIS_UP: 0,
    c.COV_ENABLE_RGB_BUFFER_PREVIEW: 1,
    c.COV_ENABLE_DEPTH_BUFFER_PREVIEW: 1,
    c.COV_ENABLE_SEGMENTATION_MARK_PREVIEW: 1,
}
"""Flags that act on the page, and how they stand before anyone sets them. The others have no effect here:
those of virtual reality, planar reflections, TinyRenderer (there is one renderer) and single-step rendering
(what is drawn is always a finished step)."""

SHORTCUTS = {
    ord("g"): c.COV_ENABLE_GUI,
    ord("s"): c.COV_ENABLE_SHADOWS,
    ord("w"): c.COV_ENABLE_WIREFRAME,
}
"""Keys that switch a flag over while COV_ENABLE_KEYBOARD_SHORTCUTS is on."""


def is_on(camera: VisualizerCamera, flag: int) -> bool:
    """Whether a flag is on."""
    return bool(camera.switches.get(flag, AT_START.get(flag, 0)))


class Switches:
    """Brings a page in line with the visualizer's flags and settings; use it from the viewer's own thread."""

    def __init__(self, viewer: Viewer, dragging: Dragging, background: Sequence[float]) -> None:
        self._viewer, self._dragging = viewer, dragging
        self._done: dict[Any, Any] = {flag: bool(on) for flag, on in AT_START.items()}
        self._done[c.COV_ENABLE_MOUSE_PICKING] = False
        viewer.light.set_background(background)

    def apply(self, camera: VisualizerCamera) -> None:
        """Do what has changed."""
        viewer, nodes = self._viewer, self._viewer.nodes
        if self._turned(c.COV_ENABLE_GUI, is_on(camera, c.COV_ENABLE_GUI)):
            panel = viewer.server.gui.main_panel
            (panel.expand if is_on(camera, c.COV_ENABLE_GUI) else panel.minimize)()
        if self._turned(c.COV_ENABLE_SHADOWS, is_on(camera, c.COV_ENABLE_SHADOWS)):
            viewer.light.set_shadows(is_on(camera, c.COV_ENABLE_SHADOWS))
        if self._turned(c.COV_ENABLE_WIREFRAME, is_on(camera, c.COV_ENABLE_WIREFRAME)):
            nodes.set_wireframe(is_on(camera, c.COV_ENABLE_WIREFRAME))
        if self._turned(c.COV_ENABLE_MOUSE_PICKING, is_on(camera, c.COV_ENABLE_MOUSE_PICKING)):
            picking = is_on(camera, c.COV_ENABLE_MOUSE_PICKING)
            nodes.set_drag(self._dragging.hear if picking else None)
            if not picking:
                self._dragging.drop()
        if self._turned(c.COV_ENABLE_Y_AXIS_UP, camera.up_axis == 1):
            viewer.server.scene.set_up_direction("+y" if camera.up_axis == 1 else "+z")
        settings = camera.settings
        light = settings.get("lightPosition")
        if light is not None and any(light) and self._turned("lightPosition", light):
            viewer.light.set_direction(light)
        if "rgbBackground" in settings and self._turned("rgbBackground", settings["rgbBackground"]):
            viewer.light.set_background(settings["rgbBackground"])

    def _turned(self, key: Any, value: Any) -> bool:
        if self._done.get(key) == value:
            return False
        self._done[key] = value
        return True
