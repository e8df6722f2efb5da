"""Move the camera of every page with a node of the scene, at the frame rate of the page."""

from __future__ import annotations

from typing import Any

from roboyard.viewer.page.page_script import PageScript

_SCRIPT = """
  let path = null, last = null, frame = 0;
  const go = () => {
    frame = requestAnimationFrame(go);
    if (path === null) return;
    const m = window.__viserMutable, node = m?.nodeRefFromName?.[path], camera = m?.cameraControl;
    if (!node || !camera) { last = null; return; }
    const e = node.matrixWorld.elements, now = [e[12], e[13], e[14]];
    const by = last === null ? [0, 0, 0] : now.map((v, k) => v - last[k]);
    if (last !== null && Math.hypot(...by) < 1e-4) return;
    last = now;
    if (Math.hypot(...by) < 1e-4 || Math.hypot(...by) > 1) return;
    const p = camera.getPosition(undefined, true), t = camera.getTarget(undefined, true);
    camera.setLookAt(p.x + by[0], p.y + by[1], p.z + by[2], t.x + by[0], t.y + by[1], t.z + by[2], false);
  };
  listen(name => { path = name; last = null; });
  go();
  return () => cancelAnimationFrame(frame);
"""


class Follow:
    """Moves the cameras of all pages with a node of the scene."""

    def __init__(self, server: Any) -> None:
        """Start without following; `server` is a `viser.ViserServer`."""
        self._script = PageScript(server, "follow", _SCRIPT, lambda *_: None)
        self.path: str | None = None
        """Path of the followed node; None: none."""

    def set(self, path: str | None) -> None:
        """Follow the node at `path`; None: stop. Jumps over 1 m are not followed."""
        if path == self.path:
            return
        self.path = path
        self._script.send(path)
