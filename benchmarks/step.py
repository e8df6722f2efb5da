"""Time of one physics step: Roboyard's `World.step()`, MuJoCo's `mj_step` on the same model, and PyBullet.

    python benchmarks/step.py [--rounds 15] [--only husky] [--json]

The three take turns within one run, block by block and in changing order, so that a busy machine is equally
unkind to all. Roboyard and `mj_step` start each block from the same state. PyBullet takes part where it is
installed; it loads the same URDFs, drops the same boxes and holds or turns the same joints. Figures are
medians over the blocks. "over mj_step" is what Roboyard adds to the bare engine; "times PyBullet" is how many
steps Roboyard makes in the time of one of PyBullet's. A time only counts where the physics holds: a scene in
which something got faster than it can fall or roll is marked, and the exit code is 1.
"""

from __future__ import annotations

import argparse
import copy
import json
import random
import statistics
import sys
from collections.abc import Callable
from dataclasses import dataclass
from time import perf_counter
from typing import Any

import mujoco
import numpy as np
from quiet import quiet

from roboyard.assets import asset_path
from roboyard.sim import World

try:
    import pybullet
except ImportError:
    pybullet = None

TIMESTEP = 1 / 240
TERRAIN_POINTS, TERRAIN_CELL, TERRAIN_HEIGHT = 256, 0.3, 0.5
BLOCK = 0.03
"""s that a block takes, about: long enough to smooth what else the machine does."""
EDGE = 0.1
FASTEST = 10.0
"""m/s: more than anything here gets by falling or rolling."""
SETTLE = 240
"""Steps before the clock runs; a pile takes longer to become one."""


@dataclass(frozen=True, kw_only=True)
class Scene:
    name: str
    build: Callable[[World], None]
    build_pybullet: Callable[[int], None]
    settle: int = SETTLE


def terrain_heights() -> np.ndarray:
    """(256, 256) random plateaus of two by two points, up to half a metre high; m"""
    draw = random.Random(10)
    half = TERRAIN_POINTS // 2
    plateaus = np.array([[draw.uniform(0, TERRAIN_HEIGHT) for _ in range(half)] for _ in range(half)])
    return np.kron(plateaus.T, np.ones((2, 2)))


def pile_positions(count: int) -> np.ndarray:
    """(count, 3) of loosely stacked boxes, five by five a layer; m"""
    draw = np.random.default_rng(0)
    grid = np.array([(k % 5, k // 5 % 5, k // 25) for k in range(count)], dtype=float)
    return (grid - (2, 2, 0)) * 1.3 * EDGE + (0, 0, EDGE) + draw.uniform(-0.01, 0.01, (count, 3))


# ------------------------------------------------------------------------------------------------- scenes


def robot_scene(
    name: str,
    robot: str,
    position: tuple[float, float, float],
    *,
    fixed: bool = False,
    spin: str = "",
    **options: Any,
) -> Scene:
    """A bundled robot on a plane; joints with `spin` in their name turn at 5 rad/s, the others are held."""
    file = str(asset_path(robot))

    def build(world: World) -> None:
        world.add_plane()
        body = world.add_urdf(file, position, fixed_base=fixed)
        world.ensure_compiled()
        for joint in body.joints:
            if not joint.is_scalar or (
                joint._built.joint is not None and joint._built.joint.mimic is not None
            ):
                continue
            if spin and spin in joint.name:
                joint.drive_velocity(5.0)
            else:
                joint.drive_position(joint.position)

    def build_pybullet(client: int) -> None:
        flat = pybullet.createCollisionShape(pybullet.GEOM_PLANE, physicsClientId=client)
        pybullet.createMultiBody(0, flat, physicsClientId=client)
        with quiet():
            body = pybullet.loadURDF(file, position, useFixedBase=fixed, physicsClientId=client)
        drive_pybullet(client, body, spin)

    return Scene(name=name, build=build, build_pybullet=build_pybullet, **options)


def drive_pybullet(client: int, body: int, spin: str) -> None:
    for k in range(pybullet.getNumJoints(body, physicsClientId=client)):
        info = pybullet.getJointInfo(body, k, physicsClientId=client)
        if info[2] not in (pybullet.JOINT_REVOLUTE, pybullet.JOINT_PRISMATIC):
            continue
        turning = bool(spin) and spin in info[1].decode()
        pybullet.setJointMotorControl2(
            body,
            k,
            pybullet.VELOCITY_CONTROL if turning else pybullet.POSITION_CONTROL,
            **({"targetVelocity": 5.0} if turning else {"targetPosition": 0.0}),
            force=info[10] or 50.0,
            physicsClientId=client,
        )


def husky_scene() -> Scene:
    file, position = str(asset_path("husky")), (1.0, -1.0, 1.0)

    def build(world: World) -> None:
        world.add_heightfield(terrain_heights(), TERRAIN_CELL, (0.0, 0.0, -TERRAIN_HEIGHT / 2))
        body = world.add_urdf(file, position)
        world.ensure_compiled()
        for joint in body.joints:
            if "wheel" in joint.name:
                joint.drive_velocity(5.0)

    def build_pybullet(client: int) -> None:
        shape = pybullet.createCollisionShape(
            pybullet.GEOM_HEIGHTFIELD,
            meshScale=[TERRAIN_CELL, TERRAIN_CELL, 1],
            heightfieldTextureScaling=(TERRAIN_POINTS - 1) / 2,
            heightfieldData=terrain_heights().T.ravel().tolist(),
            numHeightfieldRows=TERRAIN_POINTS,
            numHeightfieldColumns=TERRAIN_POINTS,
            physicsClientId=client,
        )
        ground = pybullet.createMultiBody(0, shape, physicsClientId=client)
        pybullet.resetBasePositionAndOrientation(ground, [0, 0, 0], [0, 0, 0, 1], physicsClientId=client)
        with quiet():
            body = pybullet.loadURDF(file, position, physicsClientId=client)
        drive_pybullet(client, body, "wheel")

    return Scene(name="husky on terrain", build=build, build_pybullet=build_pybullet)


def pile_scene(count: int) -> Scene:
    positions = pile_positions(count)

    def build(world: World) -> None:
        world.add_plane()
        for position in positions:
            world.add_box((EDGE, EDGE, EDGE), position, mass=0.5)

    def build_pybullet(client: int) -> None:
        flat = pybullet.createCollisionShape(pybullet.GEOM_PLANE, physicsClientId=client)
        pybullet.createMultiBody(0, flat, physicsClientId=client)
        cube = pybullet.createCollisionShape(
            pybullet.GEOM_BOX, halfExtents=[EDGE / 2] * 3, physicsClientId=client
        )
        for position in positions.tolist():
            pybullet.createMultiBody(0.5, cube, basePosition=position, physicsClientId=client)

    return Scene(name=f"{count} boxes", build=build, build_pybullet=build_pybullet, settle=360)


def scenes() -> list[Scene]:
    return [
        robot_scene("r2d2 on a plane", "r2d2", (0.0, 0.0, 0.5), spin="wheel"),
        husky_scene(),
        robot_scene("r1 on a plane", "r1", (0.0, 0.0, 0.02)),
        robot_scene("7-joint arm", "arm7", (0.0, 0.0, 0.0), fixed=True),
        pile_scene(50),
        pile_scene(200),
        pile_scene(500),
    ]


# ----------------------------------------------------------------------------------------------- measuring


def measure(scene: Scene, rounds: int) -> dict[str, Any]:
    """Median seconds of one step for each contender, and what the scene held at the end."""
    world = World(timestep=TIMESTEP)
    scene.build(world)
    client = connect(scene)
    world.step(scene.settle)
    for _ in range(scene.settle if client is not None else 0):
        pybullet.stepSimulation(physicsClientId=client)
    began = perf_counter()
    world.step(20)
    block = int(np.clip(20 * BLOCK / (perf_counter() - began), 10, 5000))
    times: dict[str, list[float]] = {"roboyard": [], "mj_step": [], "pybullet": []}
    step, model = mujoco.mj_step, world.model
    fastest = 0.0
    for k in range(rounds):
        fastest = max(fastest, fastest_body(world))
        bare = copy.copy(world.data)

        def with_world() -> None:
            for _ in range(block):
                world.step()

        def with_mujoco(data: Any = bare) -> None:
            for _ in range(block):
                step(model, data)

        def with_pybullet() -> None:
            for _ in range(block):
                pybullet.stepSimulation(physicsClientId=client)

        turns = [("roboyard", with_world), ("mj_step", with_mujoco)]
        if client is not None:
            turns.append(("pybullet", with_pybullet))
        first = k % len(turns)
        for name, run in turns[first:] + turns[:first]:
            began = perf_counter()
            run()
            times[name].append((perf_counter() - began) / block)
    if client is not None:
        pybullet.disconnect(physicsClientId=client)
    result: dict[str, Any] = {
        "scene": scene.name,
        "dofs": int(world.model.nv),
        "contacts": int(world.data.ncon),
        "solver": world.solver,
        "fastest": fastest,
    }
    result |= {name: statistics.median(values) for name, values in times.items() if values}
    pairs = zip(times["roboyard"], times["mj_step"], strict=True)
    result["over_mj_step"] = statistics.median(a / b for a, b in pairs) - 1.0
    if times["pybullet"]:
        pairs = zip(times["pybullet"], times["roboyard"], strict=True)
        result["times_pybullet"] = statistics.median(a / b for a, b in pairs)
    return result


def fastest_body(world: World) -> float:
    """Largest speed of any body's root; m/s"""
    return max((float(np.linalg.norm(body.velocity[0])) for body in world.bodies), default=0.0)


def connect(scene: Scene) -> int | None:
    if pybullet is None:
        return None
    client = pybullet.connect(pybullet.DIRECT)
    pybullet.setGravity(0, 0, -9.81, physicsClientId=client)
    pybullet.setTimeStep(TIMESTEP, physicsClientId=client)
    scene.build_pybullet(client)
    return client


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rounds", type=int, default=15, help="blocks for each contender")
    parser.add_argument("--only", default="", help="scenes whose name holds this")
    parser.add_argument("--json", action="store_true", help="one JSON object a line")
    options = parser.parse_args()
    if not options.json:
        print(
            f"MuJoCo {mujoco.__version__}, PyBullet {'installed' if pybullet else 'not installed'}; µs a step"
        )
        heads = (
            "scene",
            "dofs",
            "contacts",
            "solver",
            "roboyard",
            "mj_step",
            "pybullet",
            "over mj_step",
            "times PyBullet",
        )
        print("{:<18}{:>6}{:>10}{:>8}{:>10}{:>10}{:>10}{:>14}{:>16}".format(*heads))
    failed = False
    for scene in scenes():
        if options.only not in scene.name:
            continue
        row = measure(scene, options.rounds)
        failed |= row["fastest"] > FASTEST
        exploded = f"   exploded: {row['fastest']:.0f} m/s" if row["fastest"] > FASTEST else ""
        if options.json:
            print(json.dumps(row), flush=True)
            continue
        bullet = f"{1e6 * row['pybullet']:10.1f}" if "pybullet" in row else f"{'-':>10}"
        ratio = f"{row['times_pybullet']:16.2f}" if "pybullet" in row else f"{'-':>16}"
        print(
            f"{row['scene']:<18}{row['dofs']:>6}{row['contacts']:>10}{row['solver']:>8}"
            f"{1e6 * row['roboyard']:10.1f}{1e6 * row['mj_step']:10.1f}{bullet}"
            f"{100 * row['over_mj_step']:13.1f}%{ratio}{exploded}",
            flush=True,
        )
    return int(failed)


if __name__ == "__main__":
    sys.exit(main())
