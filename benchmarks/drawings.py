"""Cost of an open page: stepping, and replacing 1,000 lines and 200 texts at 60 Hz.

    python benchmarks/drawings.py

A second process receives the messages in place of a browser. Requires the extra `gui`.
"""

from __future__ import annotations

import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np

import roboyard.pybullet as p
from roboyard.assets import asset_path
from roboyard.pybullet.connections import CLIENTS

LINES, TEXTS = 1000, 200
FRAMES = 180
STEPS, BLOCKS = 500, 61

BROWSER = """
import sys, msgspec, viser
from websockets.sync.client import connect
page = connect(sys.argv[1], subprotocols=[f"viser-v{viser.__version__}"], max_size=None, compression=None)
page.send(msgspec.msgpack.encode({"type": "ViewerCameraMessage", "wxyz": (1.0, 0.0, 0.0, 0.0),
    "position": (3.0, 0.0, 1.0), "fov": 1.0, "near": 0.01, "far": 100.0, "image_height": 480,
    "image_width": 640, "look_at": (0.0, 0.0, 0.0), "up_direction": (0.0, 0.0, 1.0)}))
while True:
    page.recv()
"""


@contextmanager
def watching(window: Any) -> Iterator[None]:
    """Keep the page open in a second process."""
    process = subprocess.Popen([sys.executable, "-c", BROWSER, window.url.replace("http", "ws")])
    while not window._viewer.watchers:
        time.sleep(0.05)
    time.sleep(0.5)
    try:
        yield
    finally:
        process.kill()
        process.wait()
        while window._viewer.watchers:
            time.sleep(0.05)


def steps_per_second(client: int, steps: int = STEPS) -> float:
    """Return the steps per second of a client."""
    start = time.perf_counter()
    for _ in range(steps):
        p.stepSimulation(client)
    return steps / (time.perf_counter() - start)


def scene(client: int) -> None:
    """Load an arm with a fixed base."""
    p.setGravity(0, 0, -9.81, physicsClientId=client)
    p.loadURDF(str(asset_path("arm7")), useFixedBase=True, physicsClientId=client)


def cost_of_window(direct: int, gui: int) -> tuple[float, float]:
    """Return steps per second with the window, and its fraction of the time, measured in alternation."""
    pairs = [(steps_per_second(direct), steps_per_second(gui)) for _ in range(BLOCKS)]
    return float(np.median([b for _, b in pairs])), float(np.median([1.0 - b / a for a, b in pairs]))


def stepping(direct: int, window: Any, gui: int) -> None:
    """Print the cost of a window for stepping."""
    for client in (direct, gui):
        scene(client)
        steps_per_second(client)
    rate, cost = cost_of_window(direct, gui)
    print(f"window without an open page    {rate:9.0f} steps/s, {100 * cost:+.1f} % of the time")
    with watching(window):
        rate, cost = cost_of_window(direct, gui)
    print(f"window with an open page       {rate:9.0f} steps/s, {100 * cost:+.1f} %")


def draw(client: int, k: int, ids: list[int]) -> list[int]:
    """Move every line and text; returns their ids."""
    line, text = p.addUserDebugLine, p.addUserDebugText
    ids = ids or [-1] * (LINES + TEXTS)
    shift = 0.001 * k
    found = [
        line(
            [0, 0, shift],
            [1, 0.001 * j, shift],
            [1, 0, 0],
            2,
            replaceItemUniqueId=ids[j],
            physicsClientId=client,
        )
        for j in range(LINES)
    ]
    for j in range(TEXTS):
        place = [0.01 * j, 0, shift]
        found.append(text(f"{k} {j}", place, replaceItemUniqueId=ids[LINES + j], physicsClientId=client))
    return found


def frame_cost(client: int) -> tuple[float, float]:
    """Return CPU time of this process and time of the script per frame (ms)."""
    ids = draw(client, 0, [])
    time.sleep(0.2)
    script, start = 0.0, time.process_time()
    due = time.perf_counter()
    for k in range(1, FRAMES + 1):
        begin = time.perf_counter()
        ids = draw(client, k, ids)
        script += time.perf_counter() - begin
        due += 1 / 60
        time.sleep(max(0.0, due - time.perf_counter()))
    return 1e3 * (time.process_time() - start) / FRAMES, 1e3 * script / FRAMES


def timed(owner: Any, name: str, spent: list[float]) -> None:
    """Append the duration (s) of each call of a method to a list."""
    method: Callable[..., Any] = getattr(owner, name)

    def call(*args: Any) -> Any:
        begin = time.perf_counter()
        try:
            return method(*args)
        finally:
            spent.append(time.perf_counter() - begin)

    setattr(owner, name, call)


def drawing(direct: int, window: Any, gui: int) -> None:
    """Print the cost of lines and texts."""
    alone, _ = frame_cost(direct)
    with watching(window):
        gathers: list[float] = []
        publishes: list[float] = []
        timed(window, "_look", gathers)
        timed(window._viewer.drawings, "show", publishes)
        cpu, _ = frame_cost(gui)
    total = 1e3 * (np.median(gathers) + np.median(publishes))
    print(f"{LINES} lines and {TEXTS} texts, all replaced at 60 Hz, per frame on the server:")
    print(f"  gathering and publishing    {total:6.2f} ms ({len(publishes)} of {FRAMES} frames sent)")
    print(f"  CPU time of the process     {cpu - alone:6.2f} ms above that without a window ({alone:.2f} ms)")


def main() -> None:
    direct = p.connect(p.DIRECT)
    gui = p.connect(p.GUI, options="--port=0")
    window = CLIENTS[gui].window
    assert window is not None
    stepping(direct, window, gui)
    drawing(direct, window, gui)
    for client in (direct, gui):
        p.disconnect(client)


if __name__ == "__main__":
    main()
