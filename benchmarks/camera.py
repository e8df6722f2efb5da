"""Time of one picture (colour, depth and ids, with shadow): Roboyard, PyBullet, MuJoCo with OpenGL.

    python benchmarks/camera.py [--rounds 15] [--only panda] [--json] [--no-gl] [--cpu]

All alternate within one run, in changing order, so that the load of the machine affects each equally.
PyBullet (its TinyRenderer) is included if installed and loads the same URDFs; MuJoCo's GL renderer is
included if an OpenGL library works, also a software one. Figures are medians in milliseconds; "x tiny" and
"x gl" are the time of the other renderer over that of Roboyard. `--cpu` takes the processor's time instead of
the clock's, for machines that are busy; ROBOYARD_THREADS=1 keeps Roboyard on one core.
"""

from __future__ import annotations

import argparse
import json
import logging
import random
import statistics
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter, process_time

import numpy as np
from quiet import quiet

from roboyard.assets import asset_path
from roboyard.errors import RoboyardError
from roboyard.rendering import Camera, opengl
from roboyard.sim import World

try:
    import pybullet_data

    import pybullet
except ImportError:
    pybullet = pybullet_data = None

SIZES = ((320, 200), (640, 480))


@dataclass(frozen=True, kw_only=True)
class Scene:
    name: str
    robot: Path
    eye: tuple[float, float, float]
    target: tuple[float, float, float]
    height: float = 0.0
    """Initial position of the base (m)."""
    floor: bool = True


def scenes() -> list[Scene]:
    close = {"eye": (1.1, -1.0, 0.5), "target": (0.0, 0.0, 0.1), "height": 0.47}
    r1 = asset_path("r1/r1_description/urdf/r1_pro_source.urdf")
    found = [
        Scene(name="r2d2", robot=asset_path("r2d2.urdf"), **close),
        Scene(name="r2d2, no floor", robot=asset_path("r2d2.urdf"), floor=False, **close),
        Scene(name="r1", robot=r1, eye=(2.0, -1.6, 1.4), target=(0.0, 0.0, 0.7)),
    ]
    if pybullet_data is not None:
        panda = Path(pybullet_data.getDataPath()) / "franka_panda" / "panda.urdf"
        view = {"eye": (1.1, -0.8, 0.8), "target": (0.15, 0.0, 0.42)}
        found.append(Scene(name="panda", robot=panda, **view))
        found.append(Scene(name="panda, no floor", robot=panda, floor=False, **view))
    return found


def tiny_renderer(scene: Scene, camera: Camera) -> Callable[[], object]:
    assert pybullet is not None
    client = pybullet.connect(pybullet.DIRECT)
    if scene.floor:
        pybullet.loadURDF(str(asset_path("plane.urdf")), physicsClientId=client)
    with quiet():
        pybullet.loadURDF(str(scene.robot), (0, 0, scene.height), useFixedBase=True, physicsClientId=client)
    view, projection = camera.view.T.ravel().tolist(), camera.projection.T.ravel().tolist()
    return lambda: pybullet.getCameraImage(
        camera.width, camera.height, view, projection,
        shadow=1, renderer=pybullet.ER_TINY_RENDERER, physicsClientId=client,
    )  # fmt: skip


def contestants(scene: Scene, camera: Camera, with_gl: bool) -> dict[str, Callable[[], object]]:
    world = World()
    if scene.floor:
        world.add_urdf(asset_path("plane.urdf"), fixed_base=True)
    world.add_urdf(scene.robot, position=(0, 0, scene.height), fixed_base=True)
    runs: dict[str, Callable[[], object]] = {"roboyard": lambda: world.render(camera, backend="software")}
    if pybullet is not None:
        runs["tiny"] = tiny_renderer(scene, camera)
    if with_gl:
        source = (world.model, world.data)
        runs["gl"] = lambda: world.render(camera, backend="gl", mujoco=source)
    return runs


def triangles(scene: Scene) -> int:
    world = World()
    world.add_urdf(scene.robot, fixed_base=True)
    return sum(len(shape.mesh.faces) for shape in world.render_scene().shapes)


def measure(
    runs: dict[str, Callable[[], object]], rounds: int, clock: Callable[[], float]
) -> dict[str, float]:
    """Return the median time of each (ms), measured in alternation."""
    times: dict[str, list[float]] = {name: [] for name in runs}
    order = list(runs)
    for run in runs.values():
        run()
        run()
    for _ in range(rounds):
        random.shuffle(order)
        for name in order:
            start = clock()
            runs[name]()
            times[name].append(1e3 * (clock() - start))
    return {name: statistics.median(values) for name, values in times.items()}


def gl_answers() -> bool:
    try:
        opengl.open_context(16, 16).free()
    except RoboyardError:
        return False
    return True


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--rounds", type=int, default=15)
    parser.add_argument("--only", default="", help="part of a scene's name")
    parser.add_argument("--json", action="store_true")
    parser.add_argument("--no-gl", action="store_true", help="skip MuJoCo's GL renderer")
    parser.add_argument("--cpu", action="store_true", help="time of the processor instead of the clock")
    options = parser.parse_args()
    logging.getLogger("roboyard").setLevel(logging.ERROR)
    with_gl = not options.no_gl and gl_answers()
    clock = process_time if options.cpu else perf_counter
    rows = []
    for scene in scenes():
        if options.only not in scene.name:
            continue
        for width, height in SIZES:
            camera = Camera.look_at(scene.eye, scene.target, width=width, height=height)
            figures = measure(contestants(scene, camera, with_gl), options.rounds, clock)
            ratios = {f"x {k}": v / figures["roboyard"] for k, v in figures.items() if k != "roboyard"}
            size = {"scene": scene.name, "triangles": triangles(scene), "width": width, "height": height}
            rows.append({**size, "ms": figures, **ratios, "fps": 1e3 / figures["roboyard"]})
            if not options.json:
                parts = [f"{scene.name:16s} {size['triangles']:7d} triangles {width:4d} x {height:<4d}"]
                parts += [f"{name} {value:6.2f} ms" for name, value in figures.items()]
                parts += [f"{name} {value:5.1f}" for name, value in ratios.items()]
                print("  ".join(parts), f" {rows[-1]['fps']:5.0f} fps", flush=True)
    if options.json:
        print(json.dumps(rows, indent=1))
    elif rows:
        against = [row["x tiny"] for row in rows if "x tiny" in row]
        if against:
            print(f"times TinyRenderer: at least {min(against):.1f}, median {np.median(against):.1f}")


if __name__ == "__main__":
    main()
