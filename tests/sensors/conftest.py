from __future__ import annotations

import pytest

from roboyard.description.model import (
    Box,
    Collision,
    Inertial,
    Joint,
    Limit,
    Link,
    Pose,
    RobotDescription,
    Sphere,
    Visual,
)
from roboyard.sim import Body, World


def solid(name: str, size: tuple[float, float, float], mass: float) -> Link:
    x, y, z = size
    ix, iy, iz = (mass / 12 * v for v in (y * y + z * z, x * x + z * z, x * x + y * y))
    return Link(
        name=name,
        inertial=Inertial(mass=mass, inertia=(ix, 0, 0, iy, 0, iz)),
        visuals=(Visual(geometry=Box(size=size)),),
        collisions=(Collision(geometry=Box(size=size)),),
    )


MAST = RobotDescription(
    name="mast",
    links=(
        solid("foot", (0.2, 0.2, 0.2), 4.0),
        Link(name="head"),
        Link(
            name="ear",
            visuals=(Visual(geometry=Sphere(radius=0.05)),),
            collisions=(Collision(geometry=Sphere(radius=0.05)),),
        ),
    ),
    joints=(
        Joint(
            name="neck",
            type="revolute",
            parent="foot",
            child="head",
            origin=Pose(position=(0, 0, 0.5)),
            axis=(0, 0, 1),
            limit=Limit(lower=-3, upper=3),
        ),
        Joint(name="ear_joint", type="fixed", parent="head", child="ear", origin=Pose(position=(0.3, 0, 0))),
    ),
)
"""A box with a bare head half a metre above it that turns, and an ear in front of the head."""


@pytest.fixture
def world() -> World:
    return World()


@pytest.fixture
def mast(world: World) -> Body:
    world.add_plane()
    return world.add_urdf(MAST, (0, 0, 0.1), fixed_base=True)
