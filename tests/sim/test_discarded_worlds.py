"""Worlds that a program no longer uses give their memory back."""

import gc
import weakref
from typing import Any

import pytest

from roboyard import World
from roboyard.assets import asset_path
from roboyard.pybullet import (
    DIRECT,
    GEOM_SPHERE,
    JOINT_FIXED,
    connect,
    createCollisionShape,
    createConstraint,
    createMultiBody,
    disconnect,
    getClosestPoints,
    isConnected,
    loadURDF,
    resetSimulation,
    saveState,
    stepSimulation,
)
from roboyard.sim import discarded_worlds
from roboyard.sim.discarded_worlds import DiscardedWorlds


@pytest.fixture
def without_collector():
    gc.collect()
    gc.freeze()  # what other tests left: the collections of these tests find their own worlds alone
    gc.disable()
    yield
    gc.enable()


class _Sized:
    """A world that only a collector frees, with a size."""

    def __init__(self, size: int) -> None:
        self.itself, self.size = self, size


def _size(item: Any) -> int:
    return item.size


def test_discarded_worlds_are_collected_once_they_take_too_much(without_collector):
    collections: list[int] = []
    worlds = DiscardedWorlds(lambda: (collections.append(len(worlds)), gc.collect()))
    for _ in range(1000):
        worlds.add(_Sized(2**20), _size)
    most = discarded_worlds.LEAST // 2**20
    assert max(collections) <= most
    assert len(worlds) <= most
    assert 5 <= len(collections) <= 20


def test_worlds_in_use_are_not_looked_through_again_and_again(without_collector):
    collections: list[int] = []
    worlds = DiscardedWorlds(lambda: (collections.append(len(worlds)), gc.collect()))
    kept = [_Sized(2**22) for _ in range(1000)]
    for item in kept:
        worlds.add(item, _size)
    assert len(worlds) == 1000
    assert len(collections) <= 6  # the limit doubles


def test_a_real_world_is_counted_with_its_arrays(without_collector):
    before = len(discarded_worlds.WORLDS)
    world = World()
    world.add_urdf(asset_path("arm7"), fixed_base=True)
    world.step()
    assert len(discarded_worlds.WORLDS) == before + 1
    del world
    gc.collect()
    assert len(discarded_worlds.WORLDS) == before


@pytest.mark.parametrize("leave", [lambda client: resetSimulation(physicsClientId=client), disconnect])
def test_a_simulation_that_is_reset_is_freed_without_the_collector(without_collector, leave):
    from roboyard.pybullet.connections import CLIENTS

    number = connect(DIRECT)
    arm = loadURDF(str(asset_path("arm7")), useFixedBase=True, physicsClientId=number)
    shape = createCollisionShape(GEOM_SPHERE, radius=0.1, physicsClientId=number)
    sphere = createMultiBody(1, shape, basePosition=(0, 0, 3), physicsClientId=number)
    createConstraint(arm, 0, sphere, -1, JOINT_FIXED, (0, 0, 0), (0, 0, 1), (0, 0, 0), physicsClientId=number)
    stepSimulation(physicsClientId=number)
    saveState(physicsClientId=number)
    getClosestPoints(arm, sphere, 9, physicsClientId=number)
    client: Any = CLIENTS[number]
    world = weakref.ref(client.scene.world)
    del client
    assert world() is not None
    leave(number)
    assert world() is None
    if isConnected(number):
        disconnect(number)
