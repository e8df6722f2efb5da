"""Collision checks of an arm of 60 spheres among 20 boxes, one by one and many at once, beside MuJoCo's.

    python benchmarks/collision_checks.py [--spheres 60] [--boxes 20] [--count 20000]

The bundled 7-joint arm with as many of its fitted spheres, spread evenly over its links, among boxes of 5 to
20 cm at random places within its reach. CPU time on one core; the best of several rounds. Where all
configurations are free, none is settled by its first overlap. MuJoCo checks hulls instead of spheres, with
kinematics and its collision pipeline alone.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from dataclasses import replace

import mujoco
import numpy as np

from roboyard.assets import assets_root
from roboyard.description import load_description
from roboyard.description.model import Box, Pose
from roboyard.planning import CollisionChecker, Obstacle, Obstacles, SphereModel, fitted_model, sphere_robot
from roboyard.sim import World

ROUNDS = 8
ARM = assets_root() / "arm7" / "arm7.urdf"


def thinned(model: SphereModel, count: int) -> SphereModel:
    """Return a model with `count` of its spheres, spread evenly over the list of them."""
    every = [(link, sphere) for link, own in model.spheres.items() for sphere in own]
    kept: dict[str, list] = {}
    for k in np.linspace(0, len(every) - 1, min(count, len(every))).round().astype(int):
        kept.setdefault(every[k][0], []).append(every[k][1])
    return replace(model, spheres={link: tuple(own) for link, own in kept.items()})


def boxes_around(count: int, seed: int = 0) -> list[Obstacle]:
    """Return boxes of 5 to 20 cm at 0.35 to 0.8 m from the axis of the base."""
    random, made = np.random.default_rng(seed), []
    for k in range(count):
        angle, far = random.uniform(-np.pi, np.pi), random.uniform(0.35, 0.8)
        x, y, z = (float(edge) for edge in random.uniform(0.05, 0.2, 3))
        place = (float(far * np.cos(angle)), float(far * np.sin(angle)), float(random.uniform(0, 1)))
        made.append(Obstacle(name=f"box{k}", shape=Box(size=(x, y, z)), pose=Pose(position=place)))
    return made


def rate(check: Callable[[], object], count: int) -> float:
    """Return configurations a second of CPU time, the best of several rounds."""
    best = np.inf
    for _ in range(ROUNDS):
        begin = time.process_time()
        check()
        best = min(best, time.process_time() - begin)
    return count / best


def mujoco_rate(boxes: list[Obstacle], q: np.ndarray) -> float:
    """Return configurations a second of MuJoCo's kinematics and collision pipeline."""
    world = World()
    arm = world.add_urdf(ARM, fixed_base=True)
    for one in boxes:
        assert isinstance(one.shape, Box)
        world.add_box(one.shape.size, one.pose.position, mass=0.0, name=one.name)
    world.detect_contacts()
    model, data = world.model, world.data
    bodies = {int(row) for row in arm.mujoco_ids}
    columns = [int(model.jnt_qposadr[j]) for j in range(model.njnt) if int(model.jnt_bodyid[j]) in bodies]

    def check() -> None:
        for row in q:
            data.qpos[columns] = row
            mujoco.mj_kinematics(model, data)
            mujoco.mj_collision(model, data)

    return rate(check, len(q))


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--spheres", type=int, default=60)
    parser.add_argument("--boxes", type=int, default=20)
    parser.add_argument("--count", type=int, default=20000)
    given = parser.parse_args()
    model = thinned(fitted_model(load_description(ARM)), given.spheres)
    robot, boxes = sphere_robot(model, model.coordinate_names), boxes_around(given.boxes)
    checker = CollisionChecker(robot, Obstacles(boxes))
    lower, upper = robot.arrays.lower, robot.arrays.upper
    q = np.random.default_rng(0).uniform(lower, upper, (given.count, len(lower)))
    free = checker.free(q)
    only = np.resize(q[free], q.shape)
    few = q[: given.count // 20]
    print(f"{len(robot.arrays.spheres)} spheres, {given.boxes} boxes, {free.mean():.0%} of {len(q)} free")
    print(f"{'many at once':32}{rate(lambda: checker.free(q), len(q)):12,.0f} configurations a second")
    print(f"{'many at once, all of them free':32}{rate(lambda: checker.free(only), len(q)):12,.0f}")
    print(f"{'one by one':32}{rate(lambda: [checker.free(row) for row in few], len(few)):12,.0f}")
    print(f"{'MuJoCo, hulls':32}{mujoco_rate(boxes, few):12,.0f}")


if __name__ == "__main__":
    main()
