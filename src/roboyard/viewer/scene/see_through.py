"""Fade what occludes a robot in the view of each page, such as walls and furniture."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from roboyard.viewer.page.page_script import PageScript

_SCRIPT = """
  const LEAST = 0.15;   // opacity of shapes that hide the robot
  const WHOLE = 2.6;    // links up to this size (m) fade as a whole, larger ones (walls) shape by shape
  const THIN = 0.5;     // a camera inside a shape that is thicker is in a hollow one, such as a room
  const faded = new Map();
  let aim = null, groups = [], frame = 0, scanned = -1e9, tested = -1e9, seen = "", before = 0;
  const store = () => window.__viserMutable?.scene?.__r3f?.root?.getState?.();
  const boxOf = mesh => {
    if (!mesh.geometry.boundingBox) mesh.geometry.computeBoundingBox();
    return mesh.geometry.boundingBox;
  };
  const scan = refs => {
    const links = new Map();
    for (const name of Object.keys(refs)) {
      const cut = name.lastIndexOf("/visual ");
      if (cut < 0 || name.startsWith(aim.own) || !refs[name]) continue;
      const meshes = [];
      refs[name].traverse(o => { if (o.isMesh && o.geometry?.attributes?.position) meshes.push(o); });
      const link = name.slice(0, cut);
      if (!links.has(link)) links.set(link, []);
      if (meshes.length) links.get(link).push({name, meshes});
    }
    groups = [];
    for (const shapes of links.values()) {
      let low = null, high = null;
      for (const {meshes} of shapes) for (const mesh of meshes) {
        const box = boxOf(mesh).clone().applyMatrix4(mesh.matrixWorld);
        low = low ? low.min(box.min) : box.min.clone();
        high = high ? high.max(box.max) : box.max.clone();
      }
      if (!low) continue;
      const isWhole = Math.max(high.x - low.x, high.y - low.y, high.z - low.z) <= WHOLE;
      if (isWhole) groups.push(shapes); else for (const shape of shapes) groups.push([shape]);
    }
  };
  const isBetween = (mesh, eye, points) => {
    const box = boxOf(mesh), to = mesh.matrixWorld.clone().invert(), a = eye.clone().applyMatrix4(to);
    const scale = mesh.matrixWorld.getMaxScaleOnAxis();
    const size = [box.max.x - box.min.x, box.max.y - box.min.y, box.max.z - box.min.z];
    if (box.containsPoint(a) && Math.min(...size) * scale > THIN) return false;
    return points.some(point => {
      const b = point.clone().applyMatrix4(to);
      if (box.containsPoint(b)) return false;
      let near = 0, far = 1;
      for (const k of ["x", "y", "z"]) {
        const way = b[k] - a[k];
        if (Math.abs(way) < 1e-12) { if (a[k] < box.min[k] || a[k] > box.max[k]) return false; continue; }
        const s = (box.min[k] - a[k]) / way, t = (box.max[k] - a[k]) / way;
        near = Math.max(near, Math.min(s, t)); far = Math.min(far, Math.max(s, t));
      }
      return near < far;
    });
  };
  const restore = (mesh, one) => {
    if (mesh.material === one.thin) mesh.material = one.plain;
    for (const m of [one.thin].flat()) m.dispose();
    faded.delete(mesh);
  };
  const test = (eye, points) => {
    const hiding = new Map();
    for (const group of groups)
      if (group.some(({meshes}) => meshes.some(mesh => isBetween(mesh, eye, points))))
        for (const {name, meshes} of group) for (const mesh of meshes) hiding.set(mesh, name);
    for (const [mesh, one] of faded) one.goal = hiding.has(mesh) ? LEAST : 1;
    for (const [mesh] of hiding) {
      if (faded.has(mesh)) continue;
      const plain = mesh.material, thin = Array.isArray(plain) ? plain.map(m => m.clone()) : plain.clone();
      for (const m of [thin].flat()) { m.transparent = true; m.depthWrite = false; m.needsUpdate = true; }
      mesh.material = thin;
      faded.set(mesh, {plain, thin, now: 1, goal: LEAST, base: [plain].flat().map(m => m.opacity)});
    }
    window.__roboyardFaded = [...new Set(hiding.values())];
  };
  const go = time => {
    frame = requestAnimationFrame(go);
    const passed = Math.min((time - before) / 1000, 0.1);
    before = time;
    const m = window.__viserMutable, refs = m?.nodeRefFromName, camera = store()?.camera;
    const node = aim && refs?.[aim.path];
    if (node && camera) {
      const eye = camera.position.clone().setFromMatrixPosition(camera.matrixWorld);
      const at = z => camera.position.clone().set(0, 0, z).applyMatrix4(node.matrixWorld);
      const points = aim.heights.map(at);
      const now = [eye, points[0]].map(p => p.toArray().map(v => v.toFixed(2))).join();
      if (time - scanned > 1000) { scanned = time; scan(refs); seen = ""; }
      if (now !== seen && time - tested > 100) { seen = now; tested = time; test(eye, points); }
    } else if (!aim) for (const [, one] of faded) one.goal = 1;
    let isMoving = false;
    for (const [mesh, one] of faded) {
      if (one.now === one.goal) { if (one.goal === 1) restore(mesh, one); continue; }
      one.now += (one.goal - one.now) * (1 - Math.exp(-10 * passed));
      if (Math.abs(one.goal - one.now) < 0.01) one.now = one.goal;
      [one.thin].flat().forEach((material, k) => { material.opacity = one.now * one.base[k]; });
      isMoving = true;
    }
    if (isMoving) m.requestRender?.();
  };
  listen(value => { aim = value; seen = ""; scanned = -1e9; window.__roboyardFaded = []; });
  frame = requestAnimationFrame(go);
  return () => {
    cancelAnimationFrame(frame);
    for (const [mesh, one] of faded) restore(mesh, one);
    delete window.__roboyardFaded;
  };
"""


class SeeThrough:
    """Fades the shapes that hide points of a node of the scene, in each page for its own camera.

    A page computes it from bounding boxes of the shapes; the pictures of `World.render` are not changed.
    """

    def __init__(self, server: Any) -> None:
        """Start without fading; `server` is a `viser.ViserServer`."""
        self._script = PageScript(server, "see through", _SCRIPT, lambda *_: None)

    def keep(self, path: str, heights: Sequence[float]) -> None:
        """Show points of a node through everything else.

        Args:
            path: path of the node; shapes of its own body are not faded.
            heights: z coordinates of points on the node's z axis (m).
        """
        own = "/" + path.split("/")[1] + "/"
        self._script.send({"path": path, "own": own, "heights": [float(z) for z in heights]})

    def clear(self) -> None:
        """Show everything again."""
        self._script.send(None)
