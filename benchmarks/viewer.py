"""Pages of Roboyard, bare viser and MuJoCo's Studio with the same moving robot, in one headless Chromium.

    python benchmarks/viewer.py [ROBOT] [--rounds 3] [--size 1280x800]

The first picture is there when a frame has half of the vertices of the largest one, drawn after one clearing;
CPU and bytes are counted until nothing more arrives. Frames are those in which the page drew anything while
the robot moves; CPU is that of all processes of the browser, and of the server. Requires the extra `gui` and
Chromium; Studio takes part where MuJoCo has it (the package mujoco-studio).
"""

from __future__ import annotations

import argparse
import importlib.util
import os
import socket
import statistics
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path
from typing import Any

import numpy as np

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT / "tests" / "viewer"))
import chromium  # type: ignore[import-not-found]  # noqa: E402

RATE = 60.0
"""Rate at which the servers of Roboyard and viser move the robot (Hz)."""
WATCHED = 6.0
"""Time over which frames, bytes and CPU are counted (s)."""
FEWEST = 5000
"""Vertices below which a frame shows no robot, but the page's own text."""
START = """
(() => {
  const seen = window.__bench = {frames: 0, most: 0, first: [], drawn: 0, pass: 0, peak: 0};
  for (const kind of [window.WebGLRenderingContext, window.WebGL2RenderingContext]) {
    for (const [name, at] of [["drawArrays", 2], ["drawElements", 1], ["drawArraysInstanced", 2],
                              ["drawElementsInstanced", 1]]) {
      const draw = kind?.prototype?.[name];
      if (!draw) continue;
      kind.prototype[name] = function (...args) {
        seen.drawn += args[at];
        seen.pass += args[at];
        seen.peak = Math.max(seen.peak, seen.pass);
        return draw.apply(this, args);
      };
    }
    const clear = kind?.prototype?.clear;
    if (clear) kind.prototype.clear = function (...args) { seen.pass = 0; return clear.apply(this, args); };
  }
  const request = window.requestAnimationFrame.bind(window);
  const count = () => {
    if (seen.drawn) {
      seen.frames += 1;
      if (seen.peak > seen.most) {
        seen.most = seen.peak;
        seen.first.push([performance.now(), seen.peak]);
      }
      seen.drawn = seen.pass = seen.peak = 0;
    }
    request(count);
  };
  request(count);
})();
"""
"""JavaScript that counts drawn frames and vertices; it runs before the page's own."""


def serve(kind: str, robot: str) -> None:
    """Serve a page of one kind with a moving robot, and print its address."""
    from roboyard import World, add_robot

    world = World()
    world.add_plane()
    body = add_robot(world, robot).body
    start = body.joint_positions.copy()
    limits = np.clip(body.joint_limits, -1.0, 1.0)

    def swing(time_: float) -> None:
        share = 0.5 + 0.25 * np.sin(2.0 * time_)
        body.joint_positions = np.where(
            np.ptp(limits, axis=1) > 0, limits[:, 0] + share * np.ptp(limits, axis=1), start
        )

    if kind == "studio":
        _serve_studio(robot)
        return
    if kind == "roboyard":
        from roboyard.viewer import Viewer

        viewer = Viewer(world, port=0, quiet=True, title="bench", follow_steps=False)
        print(viewer.url, flush=True)
        show = viewer.sync
    else:
        url, show = _bare_viser(world)
        print(url, flush=True)
    began = time.perf_counter()
    while True:
        now = time.perf_counter()
        swing(now - began)
        show()
        time.sleep(max(0.0, now + 1.0 / RATE - time.perf_counter()))


def _bare_viser(world: Any) -> tuple[str, Any]:
    """Show a world with viser alone, its defaults and full meshes; return the address and an update."""
    import viser

    from roboyard.transforms import quaternion_from_matrix, to_wxyz
    from roboyard.viewer.scene.glb import glb
    from roboyard.viewer.scene.snapshot import PoseSender, gather_links, take

    server = viser.ViserServer(port=8300 + os.getpid() % 700, verbose=False)
    links = gather_links(world)
    frames = {path: server.scene.add_frame(path, show_axes=False) for path in links.rows}
    for k, shape in enumerate(world.render_scene().shapes):
        server.scene.add_glb(
            f"{links.paths[shape.owner]}/{k}",
            glb(shape),
            position=np.asarray(shape.position, dtype=float),
            wxyz=to_wxyz(quaternion_from_matrix(np.asarray(shape.rotation, dtype=float))),
        )
    server.initial_camera.position, server.initial_camera.look_at = (2.5, -2.5, 1.8), (0.0, 0.0, 0.8)
    sender = PoseSender()

    def show() -> None:
        snapshot = take(world, world.model, links)
        positions, quaternions = sender.poses(snapshot.model, snapshot.qpos)
        with server.atomic():
            for path, row in links.rows.items():
                frames[path].position, frames[path].wxyz = positions[row], quaternions[row]

    return f"http://localhost:{server.get_port()}", show


def _serve_studio(robot: str) -> None:
    """Show a robot in MuJoCo's Studio, which simulates it while its arms fall."""
    import mujoco
    from mujoco.studio import launch_web, viewer_protocol

    from roboyard.description import load_description
    from roboyard.description.robot_model import RobotModel
    from roboyard.export.mjcf import write
    from roboyard.morphology.analyze import infer_semantics
    from roboyard.viewer.inspector import find_robot

    port = 8300 + os.getpid() % 700
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "robot.xml"
        description = load_description(find_robot(robot).urdf)
        semantic = infer_semantics(description)
        write(RobotModel(name="robot", description=description, semantic=semantic), file)
        model = mujoco.MjModel.from_xml_path(str(file))
        print(f"http://localhost:{port}", flush=True)
        launch_web.run(viewer_protocol.ViewerConfig(gfx="web", http_port=port), model=model)


def cpu_of(parent: int) -> float:
    """Return the CPU time (s) of a process and of all processes that it started."""
    parents, spent = {}, {}
    for folder in Path("/proc").iterdir():
        try:
            row = (folder / "stat").read_text().rpartition(") ")[2].split()
        except OSError:
            continue
        if folder.name.isdecimal():
            parents[int(folder.name)] = int(row[1])
            spent[int(folder.name)] = (int(row[11]) + int(row[12])) / os.sysconf("SC_CLK_TCK")
    total = 0.0
    for number in spent:
        up = number
        while up not in (parent, 0, 1):
            up = parents.get(up, 0)
        total += spent[number] if up == parent else 0.0
    return total


class Relay:
    """Passes connections on to a server and counts the bytes that it sends."""

    def __init__(self, port: int) -> None:
        """Listen on a free port for a server on this machine's `port`."""
        self.sent = 0
        self._target = port
        self._socket = socket.create_server(("127.0.0.1", 0))
        self.port: int = self._socket.getsockname()[1]
        threading.Thread(target=self._accept, daemon=True).start()

    def _accept(self) -> None:
        while True:
            client, _ = self._socket.accept()
            server = socket.create_connection(("127.0.0.1", self._target))
            for one, other in ((client, server), (server, client)):
                threading.Thread(target=self._pass, args=(one, other, one is server), daemon=True).start()

    def _pass(self, source: socket.socket, target: socket.socket, counts: bool) -> None:
        try:
            while data := source.recv(1 << 16):
                target.sendall(data)
                self.sent += len(data) if counts else 0
            target.shutdown(socket.SHUT_WR)
        except OSError:
            pass


def measure(kind: str, robot: str, size: tuple[int, int]) -> dict[str, float]:
    """Open a page and return its figures."""
    server = subprocess.Popen(
        [sys.executable, __file__, robot, "--serve", kind], stdout=subprocess.PIPE, text=True
    )
    assert server.stdout is not None
    try:
        url = server.stdout.readline().strip()
        while url and not url.startswith("http"):
            url = server.stdout.readline().strip()
        if not url:
            raise SystemExit(f"{kind}: the server did not start")
        time.sleep(3.0)
        with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
            page = chromium.Page("about:blank", Path(folder) / "profile", size)
            try:
                return _figures(page, Relay(int(url.rpartition(":")[2])), server.pid)
            finally:
                page.close()
    finally:
        server.kill()
        server.wait()


def _figures(page: chromium.Page, relay: Relay, server: int) -> dict[str, float]:
    page._call("Page.addScriptToEvaluateOnNewDocument", source=START)
    before = cpu_of(page._process.pid)
    page._call("Page.navigate", url=f"http://localhost:{relay.port}")
    end, grown, since = time.monotonic() + 150.0, (0, 0), (time.monotonic(), 0)
    while True:  # until the scene has not grown for six frames and two seconds
        time.sleep(0.25)
        if time.monotonic() > end:
            raise SystemExit("the page drew nothing, or never came to rest")
        most, count, frames = page.evaluate(
            "(b => b ? [b.most, b.first.length, b.frames] : [0, 0, 0])(window.__bench)"
        )
        if (most, count) != grown or most < FEWEST:
            grown, since = (most, count), (time.monotonic(), frames)
        elif time.monotonic() - since[0] > 2.0 and frames - since[1] >= 6:
            break
    opened = cpu_of(page._process.pid) - before
    first = page.evaluate("window.__bench.first.find(e => e[1] >= 0.5 * window.__bench.most)[0]") / 1000.0
    received = relay.sent
    counts = page.evaluate("window.__bench.frames"), cpu_of(page._process.pid), cpu_of(server)
    start = time.monotonic()
    time.sleep(WATCHED)
    frames = max(page.evaluate("window.__bench.frames") - counts[0], 1)
    passed = time.monotonic() - start
    return {
        "first picture (s)": first,
        "CPU to it (s)": opened,
        "MB to it": received / 1e6,
        "frames/s": frames / passed,
        "CPU a frame (ms)": 1e3 * (cpu_of(page._process.pid) - counts[1]) / frames,
        "server (% of a core)": 100.0 * (cpu_of(server) - counts[2]) / passed,
        "kB/s": (relay.sent - received) / passed / 1e3,
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("robot", nargs="?", default="r1")
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--size", default="1280x800")
    parser.add_argument("--serve", choices=("roboyard", "viser", "studio"))
    options = parser.parse_args()
    if options.serve is not None:
        serve(options.serve, options.robot)
        return
    if chromium.PROGRAM is None:
        raise SystemExit("needs Chromium")
    width, height = (int(number) for number in options.size.split("x"))
    kinds = ["roboyard", "viser"]
    if importlib.util.find_spec("mujoco.studio") is not None:
        kinds.append("studio")
    rows: dict[str, list[dict[str, float]]] = {kind: [] for kind in kinds}
    for _ in range(options.rounds):
        for kind in kinds:  # in turn: another program on the machine slows all of them
            rows[kind].append(measure(kind, options.robot, (width, height)))
    names = list(rows["roboyard"][0])
    load = os.getloadavg()[1]
    print(f"{options.robot}, {options.size}, {options.rounds} rounds, medians; load {load:.1f}")
    print(f"{'':22}" + "".join(f"{kind:>12}" for kind in ("ours", *kinds[1:])))
    for name in names:
        values = (statistics.median(row[name] for row in rows[kind]) for kind in kinds)
        print(f"{name:22}" + "".join(f"{value:12.4g}" for value in values))


if __name__ == "__main__":
    main()
