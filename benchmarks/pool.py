"""The body pool: seconds to add bodies one by one, with the pool and without.

    python benchmarks/pool.py

Each line is one way to build a world; the last column is the time without the pool over the time with it.
"""

from __future__ import annotations

import time
from collections.abc import Callable

from roboyard.description.model import (
    Box,
    Collision,
    Geometry,
    Inertial,
    Joint,
    Link,
    RobotDescription,
    Sphere,
    Visual,
)
from roboyard.sim import World
from roboyard.sim.physics_profile import BULLET

BOXES, CHAINS = 200, 30
STEPS = 4
"""Time steps between two additions."""
REPEATS = 3


def box(k: int) -> RobotDescription:
    """Return a box whose size and mass depend on k."""
    size = 0.1 + 0.001 * k
    return RobotDescription(name="box", links=(link("base", Box(size=(size, size, size)), 1.0 + k),))


def chain(k: int) -> RobotDescription:
    """Return an arm of six spheres on hinges."""
    names = [f"link{i}" for i in range(6)]
    joints = [
        Joint(name=f"joint{i}", type="continuous", parent=names[i], child=names[i + 1], axis=(0, 1, 0))
        for i in range(5)
    ]
    return RobotDescription(
        name="chain", links=tuple(link(n, Sphere(radius=0.05), 1.0) for n in names), joints=tuple(joints)
    )


def link(name: str, geometry: Geometry, mass: float) -> Link:
    """Return a link of one shape."""
    inertia = 0.01 * mass
    return Link(
        name=name,
        inertial=Inertial(mass=mass, inertia=(inertia, 0.0, 0.0, inertia, 0.0, inertia)),
        visuals=(Visual(geometry=geometry),),
        collisions=(Collision(geometry=geometry),),
    )


def seconds(make: Callable[[int], RobotDescription], count: int, *, pool: bool, remove: bool) -> float:
    """Return the best time (s) to add `count` bodies, a few steps between."""
    best = float("inf")
    for _ in range(REPEATS):
        world = World(profile=BULLET)
        if not pool:
            world.pool.disable()
        start = time.perf_counter()
        bodies = []
        for k in range(count):
            place = (0.5 * (k % 20), 0.5 * (k // 20), 0.2)
            bodies.append(world.add_description(make(k), place, self_collision=False))
            if remove and len(bodies) > 20:
                world.remove(bodies.pop(0))
            world.step(STEPS)
        best = min(best, time.perf_counter() - start)
    return best


def main() -> None:
    """Print a line for each way to build a world."""
    seconds(box, 8, pool=True, remove=False)
    shared = chain(0)
    cases: list[tuple[str, Callable[[int], RobotDescription], int, bool]] = [
        (f"{BOXES} boxes", box, BOXES, False),
        (f"{BOXES} boxes, 20 at a time", box, BOXES, True),
        (f"{CHAINS} chains of 6 links", lambda k: shared, CHAINS, False),
    ]
    for name, make, count, remove in cases:
        with_pool, without = (seconds(make, count, pool=pool, remove=remove) for pool in (True, False))
        print(f"{name:28} {with_pool:6.3f} s {without:6.3f} s {without / with_pool:5.2f}")


if __name__ == "__main__":
    main()
