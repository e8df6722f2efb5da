"""Pooled bodies with joints: bodies that use them equal compiled ones."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
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
)
from roboyard.sim import World
from roboyard.sim.physics_profile import BULLET


def _arm():
    inertial = Inertial(mass=1.0, inertia=(0.01, 0.0, 0.0, 0.01, 0.0, 0.01))
    tip = Collision(geometry=Sphere(radius=0.1), origin=Pose(position=(0.0, 0.0, 0.1)))
    links = (
        Link(name="base", inertial=inertial, collisions=(Collision(geometry=Box(size=(0.2, 0.2, 0.2))),)),
        Link(name="upper", inertial=inertial),
        Link(name="tip", inertial=inertial, collisions=(tip,)),
    )
    limit = Limit(lower=-0.3, upper=0.4)
    joints = (
        Joint(
            name="a",
            type="revolute",
            parent="base",
            child="upper",
            axis=(1.0, 0.0, 0.0),
            limit=limit,
            friction=0.1,
        ),
        Joint(name="b", type="spherical", parent="upper", child="tip", origin=Pose(position=(0.0, 0.0, 0.2))),
    )
    return RobotDescription(name="arm", links=links, joints=joints)


def _add_arms(world: World, count: int, *, fixed: bool = False, self_collision: bool = False) -> list:
    arms = []
    for k in range(count):
        place = (0.7 * (k % 6), 0.7 * (k // 6), 0.15)
        arms.append(
            world.add_description(
                _arm(), place, fixed_base=fixed, self_collision=self_collision, drives=False, name="arm"
            )
        )
        arms[-1].joint("a").position = 0.1
        world.motors.set(arms[-1].joint("a"), velocity=0.2, max_force=3.0)
        world.step()
    return arms


@pytest.mark.parametrize("fixed", [False, True], ids=["free", "fixed"])
@pytest.mark.parametrize("self_collision", [False, True], ids=["codes", "plain"])
def test_bodies_with_joints_use_pooled_bodies(fixed, self_collision):
    # solved to the end: what Bullet's rounds leave over depends on the order of contacts, and so on the pool
    profile = replace(BULLET, motor_rounds=0)
    worlds = [World(profile=profile), World(profile=profile)]
    worlds[1].pool.disable()
    both = []
    for world in worlds:
        world.add_plane()
        arms = _add_arms(world, 14, fixed=fixed, self_collision=self_collision)
        world.remove(arms.pop(11))
        arms[3].set_pose(arms[4].position + np.array([0.1, 0.0, 0.21]))
        world.step(18)
        both.append(arms)
    assert worlds[0].pool.inactive and not worlds[1].pool.inactive
    assert worlds[0].live_data.ncon == worlds[1].live_data.ncon > 0
    # differences of rounding and solver tolerance, with robots on one another
    for mine, theirs in zip(*both, strict=True):
        assert mine.name == theirs.name and [j.name for j in mine.joints] == ["a", "b"]
        np.testing.assert_allclose(mine.pose[0], theirs.pose[0], atol=1e-6)
        for a, b in zip(mine.joints, theirs.joints, strict=True):
            np.testing.assert_allclose(a.position, b.position, atol=1e-6)
            np.testing.assert_allclose(a.velocity, b.velocity, atol=1e-4)
    models = [world.model for world in worlds]
    assert models[0].names == models[1].names
    for name in ("geom_contype", "geom_conaffinity", "jnt_limited", "jnt_range", "body_mass", "body_pos"):
        np.testing.assert_array_equal(getattr(models[0], name), getattr(models[1], name))


def test_pooled_bodies_with_joints_exist_only_while_additions_are_frequent():
    world = World(profile=BULLET)
    for k in range(8):
        world.add_description(_arm(), (k, 0, 0), drives=False, self_collision=False)
        world.step(10)
        assert not world.pool.inactive
    _add_arms(world, 6)
    assert world.pool.free
    world.step(30)
    world.step()
    assert not world.pool.inactive


def test_inactive_joints_add_no_constraints():
    world = World()
    for k in range(5):
        world.add_description(_arm(), (k, 0, 0), drives=False, self_collision=False)
        world.step()
    assert world.pool.free
    assert world.live_data.nefc == 5  # the dry friction of those in use


def test_inactive_bodies_do_not_count_when_inertia_is_recomputed():
    world = World(profile=BULLET)
    arms = _add_arms(world, 5)
    assert world.pool.free
    arms[0].joint("a").armature = 0.3
    world.step()
    live = world.live_model
    assert world.pool.free
    real = world.model
    assert live.stat.meaninertia == pytest.approx(real.stat.meaninertia, rel=1e-12)
    assert live.body_subtreemass[0] == pytest.approx(real.body_subtreemass[0], rel=1e-12)
