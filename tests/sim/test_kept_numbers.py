"""Worlds whose bodies differ in numbers take over the one before, against compiled ones, number by number."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from model_numbers import differing

from roboyard.description.model import (
    Box,
    Capsule,
    Collision,
    Cylinder,
    Geometry,
    Inertial,
    Link,
    Plane,
    Pose,
    RobotDescription,
    Sphere,
)
from roboyard.sim.physics_profile import BULLET
from roboyard.sim.world import World

VIEWED = {"center", "extent", "meansize"}
"""Numbers of the bodies' places, for viewers, which may stay."""
GROUND = RobotDescription(
    name="ground", links=(Link(name="base", collisions=(Collision(geometry=Plane(normal=(0, 0, 1))),)),)
)


def world(former: Any = None) -> World:
    made = World(profile=BULLET, visual_geoms=False)
    made.is_kept, made.compiles.former = True, former
    return made


def body(drawn: np.random.Generator, kind: type[Geometry], *, moved: bool) -> RobotDescription:
    a, b, c, mass = drawn.uniform(0.05, 0.4, 4).tolist()
    geometry: Any = Box(size=(a, b, c)) if kind is Box else Sphere(radius=a)
    if kind in (Capsule, Cylinder):
        geometry = kind(radius=a, length=b)
    place = tuple(drawn.uniform(0.01, 0.1, 3).tolist()) if moved else (0.0, 0.0, 0.0)
    inertia = drawn.uniform(0.01, 0.02, 3).tolist()
    return RobotDescription(
        name="body",
        links=(
            Link(
                name="base",
                inertial=Inertial(
                    mass=mass,
                    origin=Pose(position=place),
                    inertia=(inertia[0], 0, 0, inertia[1], 0, inertia[2]),
                ),
                collisions=(Collision(geometry=geometry),),
            ),
        ),
    )


def fill(
    made: World, seed: int, *, kinds: tuple[type[Geometry], ...] = (Box, Sphere, Capsule, Cylinder)
) -> World:
    drawn = np.random.default_rng(seed)
    made.add_description(GROUND, fixed_base=True, drives=False)
    for number, kind in enumerate((*kinds, *kinds)):
        described = body(drawn, kind, moved=number % 2 == 1)
        added = made.add_description(
            described, [0.5 * number, 0, 1], fixed_base=number in (1, 4), drives=False
        )
        added.links[0].set_friction(sliding=float(drawn.uniform()), spinning=0.0)
        added.links[0].set_friction(rolling=float(drawn.uniform(0.01, 0.02)) if number == 2 else None)
    made.ensure_compiled()
    return made


def nearly(one: Any, other: Any, names: set[str]) -> bool:
    return all(
        np.allclose(getattr(one, name), getattr(other, name), rtol=1e-12, atol=1e-15) for name in names
    )


ROUNDED = {
    "body_invweight0",
    "dof_invweight0",
    "dof_M0",
    "bvh_aabb",
    "dof_length",
    "geom_rbound",
    "geom_aabb",
}
"""Computed from sizes instead of compiled, so that the last bit may differ."""


def test_bodies_with_other_numbers_have_those_of_a_compile() -> None:
    former, kept = None, []
    for episode in range(7):
        made, fresh = fill(world(former), episode), fill(World(profile=BULLET, visual_geoms=False), episode)
        names = {*differing(made.live_model, fresh.live_model)}
        assert names <= ROUNDED
        assert nearly(made.live_model, fresh.live_model, names)
        assert not differing(made.live_model.opt, fresh.live_model.opt)
        of_all = {*differing(made.live_model.stat, fresh.live_model.stat)} - VIEWED
        assert of_all <= {"meaninertia", "meanmass"}
        assert made.live_model.stat.meaninertia == pytest.approx(fresh.live_model.stat.meaninertia, rel=1e-12)
        kept.append(made.live_model)
        for _ in range(20):
            made.step()
            fresh.step()
        assert np.allclose(made.live_data.qpos, fresh.live_data.qpos, rtol=0, atol=1e-9)
        former = made.retire()
        made.release()
    assert kept[-1] is kept[-2] is kept[2]


def test_the_spec_agrees_with_the_numbers() -> None:
    former, made, fresh = None, world(), world()
    for episode in range(5):
        made, fresh = fill(world(former), episode), fill(World(profile=BULLET, visual_geoms=False), episode)
        former = made.retire()
    for one in (made, fresh):
        one.add_description(body(np.random.default_rng(50), Box, moved=False), [0, 0, 3], drives=False)
        one.step(3)
    masses = [[link.mass for each in one.bodies for link in each.links] for one in (made, fresh)]
    assert masses[0] == masses[1]
    assert made.spec.to_xml() == fresh.spec.to_xml()
    assert np.allclose(made.live_data.qpos, fresh.live_data.qpos, rtol=0, atol=1e-9)


def test_other_kinds_of_shapes_and_other_settings_of_friction_are_compiled() -> None:
    former, models = None, []
    orders = [(Box, Sphere), (Box, Sphere), (Box, Sphere), (Sphere, Box), (Sphere, Box)]
    for episode, kinds in enumerate(orders):
        made = fill(world(former), episode, kinds=kinds)
        fresh = fill(World(profile=BULLET, visual_geoms=False), episode, kinds=kinds)
        assert {*differing(made.live_model, fresh.live_model)} <= ROUNDED
        models.append(made.live_model)
        former = made.retire()
    assert models[1] is models[2]
    assert models[3] is not models[2]
    other = world(former)
    fill(other, 9, kinds=(Sphere, Box))
    again = world(other.retire())
    drawn = np.random.default_rng(1)
    again.add_description(GROUND, fixed_base=True, drives=False)
    again.add_description(body(drawn, Sphere, moved=False), drives=False).links[0].set_friction(rolling=0.1)
    again.ensure_compiled()
    assert again.live_model.geom_condim.tolist() == [3, 6]
