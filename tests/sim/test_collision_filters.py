"""Exclusions that come and go without a compile."""

from __future__ import annotations

import numpy as np
import pytest

from roboyard.sim.physics_profile import BULLET
from roboyard.sim.world import World

HEIGHT = 0.1
"""Half the size of the boxes (m)."""


def drop(world: World) -> list:
    """Add a floor and two boxes that rest on it."""
    floor = world.add_plane()
    boxes = [world.add_box((0.2, 0.2, 0.2), (x, 0, HEIGHT), mass=1.0) for x in (0, 2)]
    world.step(10)
    return [floor, *boxes]


def test_pairs_are_excluded_and_collide_again_without_a_compile():
    world = World(profile=BULLET)
    floor, one, two = (body.links[0] for body in drop(world))
    world.filters.set(one, floor, collide=False)
    world.step()
    world.filters.set(one, floor, collide=True)
    model = world.live_model
    for link, other in ((one, two), (two, one), (one, two)):
        for body in (one.body, two.body):
            body.set_pose((body.position[0], 0, HEIGHT))
            body.set_velocity((0, 0, 0), (0, 0, 0))
        world.filters.set(link, floor, collide=False)
        start = world.time
        world.step(24)
        fallen = -0.5 * 9.81 * (world.time - start) ** 2
        assert link.body.position[2] - HEIGHT == pytest.approx(fallen, rel=0.1)
        assert other.body.position[2] == pytest.approx(HEIGHT, abs=1e-3)
        world.filters.set(link, floor, collide=True)
    assert world.live_model is model
    assert world.model.nexclude == 0 and not list(world.spec.excludes)


def test_the_rows_of_a_removed_body_exclude_nothing():
    world = World(profile=BULLET)
    floor, one, two = drop(world)
    world.filters.set(one.links[0], floor.links[0], collide=False)
    world.step()
    world.filters.set(one.links[0], floor.links[0], collide=True)
    world.filters.set(two.links[0], floor.links[0], collide=False)
    world.remove(two)
    new = world.add_box((0.2, 0.2, 0.2), (2, 0, HEIGHT), mass=1.0)
    world.step(48)
    np.testing.assert_allclose([one.position[2], new.position[2]], HEIGHT, atol=1e-3)
