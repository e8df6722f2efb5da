"""Move the camera of every page with a node of the scene, at the frame rate of the page."""

from __future__ import annotations

from typing import Any

from roboyard.viewer.page.page_script import PageScript

_SCRIPT = """
  const DELAY = 0.15;  // seconds in which the camera makes up for 63 % of what it is behind
  const JUMP = 1;      // longer motions between two frames (m), as of a reset, are followed at once
  let path = null, last = null, rest = [0, 0, 0], before = 0, frame = 0;
  const go = time => {
    frame = requestAnimationFrame(go);
    const passed = Math.min((time - before) / 1000, 0.1);
    before = time;
    if (path === null) return;
    const m = window.__viserMutable, node = m?.nodeRefFromName?.[path], camera = m?.cameraControl;
    if (!node || !camera) { last = null; return; }
    const e = node.matrixWorld.elements, now = [e[12], e[13], e[14]];
    const by = last === null ? [0, 0, 0] : now.map((v, k) => v - last[k]);
    last = now;
    rest = rest.map((v, k) => v + by[k]);
    const far = Math.hypot(...rest);
    if (far === 0) return;
    const share = far < 1e-4 || Math.hypot(...by) > JUMP ? 1 : 1 - Math.exp(-passed / DELAY);
    const step = rest.map(v => share * v);
    rest = share === 1 ? [0, 0, 0] : rest.map((v, k) => v - step[k]);
    const p = camera.getPosition(undefined, true), t = camera.getTarget(undefined, true);
    camera.setLookAt(p.x + step[0], p.y + step[1], p.z + step[2],
      t.x + step[0], t.y + step[1], t.z + step[2], false);
    m.requestRender?.();
  };
  listen(name => { path = name; last = null; rest = [0, 0, 0]; });
  frame = requestAnimationFrame(go);
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
        """Follow the node at `path` from where it is now; None: stop.

        The camera follows with a delay of 0.15 s, which smooths it, and jumps over 1 m at once.
        """
        self.path = path
        self._script.send(path)
