"""Free spots on furniture: the one that was asked for comes first, the others by their distance from it."""

from __future__ import annotations

import numpy as np

from roboyard.sim import World
from roboyard.skills.places import surface_spots


def test_the_spot_that_was_asked_for_is_first_where_it_is_free() -> None:
    world = World()
    block = world.add_box((0.4, 0.4, 0.1), (0.5, 0.0, 0.05), mass=0.0)
    near = np.array([0.45, 0.1])
    spots = np.array(surface_spots(world, block, 0.02, np.random.default_rng(0), 60, near))
    assert len(spots) == 60
    np.testing.assert_allclose(spots[0], (*near, 0.1), atol=1e-6)
    away = np.linalg.norm(spots[:, :2] - near, axis=1)
    assert (np.diff(away) >= 0).all()
    assert away[-1] > 0.02
    world.add_box((0.03, 0.03, 0.1), (*near, 0.15), mass=0.0)
    rest = np.array(surface_spots(world, block, 0.02, np.random.default_rng(0), 60, near))
    assert len(rest) > 5
    assert (np.abs(rest[:, :2] - near).max(axis=1) > 0.015).all()


def test_what_is_held_above_a_spot_does_not_take_its_room() -> None:
    world = World()
    block = world.add_box((0.4, 0.4, 0.1), (0, 0, 0.05), mass=0.0, name="block")
    held = world.add_box((0.1, 0.1, 0.1), (0, 0, 0.25), mass=0.0, name="held")
    near = np.zeros(2)
    blocked = surface_spots(world, block, 0.02, np.random.default_rng(0), 40, near)
    assert all(np.hypot(*spot[:2]) > 0.0 for spot in blocked)
    free = surface_spots(world, block, 0.02, np.random.default_rng(0), 40, near, [held])
    np.testing.assert_allclose(free[0], (0.0, 0.0, 0.1), atol=1e-9)
