"""Flags and settings of configureDebugVisualizer, applied to the page."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from roboyard.pybullet.face import constants as c
from roboyard.viewer.viewer import GRAB_KEY

if TYPE_CHECKING:
    from roboyard.pybullet.state.visualizer_camera import VisualizerCamera
    from roboyard.viewer import Viewer
    from roboyard.viewer.scene.grab import Grab

DEFAULTS = {
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
"""Defaults of the flags that affect the page. The others have no effect: virtual reality, planar reflections,
TinyRenderer (there is one renderer) and single-step rendering (a drawn step is always complete)."""

SHORTCUTS = {
    ord("g"): c.COV_ENABLE_GUI,
    ord("s"): c.COV_ENABLE_SHADOWS,
    ord("w"): c.COV_ENABLE_WIREFRAME,
}
"""Keys that toggle a flag while COV_ENABLE_KEYBOARD_SHORTCUTS is on."""


def is_on(camera: VisualizerCamera, flag: int) -> bool:
    """Return whether a flag is on."""
    return bool(camera.switches.get(flag, DEFAULTS.get(flag, 0)))


class Switches:
    """Applies the visualizer's flags and settings to a page; call it in the viewer's thread."""

    def __init__(self, viewer: Viewer, dragging: Grab, background: Sequence[float]) -> None:
        """Apply the defaults to a viewer.

        Args:
            viewer: viewer of the page.
            dragging: mouse dragging, enabled by COV_ENABLE_MOUSE_PICKING.
            background: background colour (red, green, blue; 0 to 1).
        """
        self._viewer, self._dragging = viewer, dragging
        self._done: dict[Any, Any] = {flag: bool(on) for flag, on in DEFAULTS.items()}
        self._done[c.COV_ENABLE_MOUSE_PICKING] = False
        viewer.light.set_background(background)

    def apply(self, camera: VisualizerCamera) -> None:
        """Apply what has changed."""
        viewer, nodes = self._viewer, self._viewer.nodes
        if self._has_changed(c.COV_ENABLE_GUI, is_on(camera, c.COV_ENABLE_GUI)):
            panel = viewer.server.gui.main_panel
            (panel.expand if is_on(camera, c.COV_ENABLE_GUI) else panel.minimize)()
            viewer.bar.show(visible=is_on(camera, c.COV_ENABLE_GUI))
        if self._has_changed(c.COV_ENABLE_SHADOWS, is_on(camera, c.COV_ENABLE_SHADOWS)):
            viewer.light.set_shadows(is_on(camera, c.COV_ENABLE_SHADOWS))
        if self._has_changed(c.COV_ENABLE_WIREFRAME, is_on(camera, c.COV_ENABLE_WIREFRAME)):
            nodes.set_wireframe(is_on(camera, c.COV_ENABLE_WIREFRAME))
        if self._has_changed(c.COV_ENABLE_MOUSE_PICKING, is_on(camera, c.COV_ENABLE_MOUSE_PICKING)):
            picking = is_on(camera, c.COV_ENABLE_MOUSE_PICKING)
            nodes.set_drag(self._dragging.on_drag if picking else None, (None, GRAB_KEY))
            if not picking:
                self._dragging.drop()
        if self._has_changed(c.COV_ENABLE_Y_AXIS_UP, camera.up_axis == 1):
            viewer.server.scene.set_up_direction("+y" if camera.up_axis == 1 else "+z")
        settings = camera.settings
        light = settings.get("lightPosition")
        if light is not None and any(light) and self._has_changed("lightPosition", light):
            viewer.light.set_direction(light)
        if "rgbBackground" in settings and self._has_changed("rgbBackground", settings["rgbBackground"]):
            viewer.light.set_background(settings["rgbBackground"])

    def _has_changed(self, key: Any, value: Any) -> bool:
        if self._done.get(key) == value:
            return False
        self._done[key] = value
        return True
