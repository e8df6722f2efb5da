"""Bodies whose elements get all fields as they are made have the same ones as others."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from roboyard.description.model import (
    Box,
    Capsule,
    Collision,
    Contact,
    Cylinder,
    Geometry,
    Inertial,
    Link,
    Mesh,
    Pose,
    RobotDescription,
    Sphere,
)
from roboyard.shapes.primitives import box
from roboyard.sim import body as body_module
from roboyard.sim.physics_profile import BULLET
from roboyard.sim.world import World

SHAPES: tuple[tuple[Geometry, ...], ...] = (
    (Box(size=(0.1, 0.2, 0.3)),),
    (Sphere(radius=0.1), Cylinder(radius=0.05, length=0.2)),
    (Capsule(radius=0.1, length=0.0),),
    (),
)


def part(shapes: Sequence[Geometry], contact: Contact | None = None) -> RobotDescription:
    """A link of 2 kg with its centre of mass beside its frame."""
    place = Pose(position=(0.1, 0.0, -0.2), quaternion=(0.0, 0.6, 0.0, 0.8))
    collisions = tuple(Collision(geometry=shape, origin=place) for shape in shapes)
    inertia = (0.1, 0.01, 0.0, 0.2, 0.0, 0.3)
    inertial = Inertial(mass=2.0, origin=place, inertia=inertia)
    link = Link(name="part", inertial=inertial, collisions=collisions, contact=contact)
    return RobotDescription(name="part", links=(link,), joints=())


def text_of(description: RobotDescription, *, fixed_base: bool) -> str:
    """The spec of a world with three such bodies, two of which have the same friction."""
    world = World(profile=BULLET, visual_geoms=False)
    for k, rolling in enumerate((0.0, 0.3, 0.3)):
        turn = np.array([np.sin(k), 0.0, 0.0, np.cos(k)])
        body = world.add_description(description, (k, 0.0, 1.0), turn, fixed_base=fixed_base, drives=False)
        body.links[0].set_friction(sliding=0.7, rolling=rolling)
    world.ensure_compiled()
    return world.raw_spec.to_xml()


@pytest.mark.parametrize("fixed_base", [False, True])
@pytest.mark.parametrize("shapes", SHAPES)
def test_plain_bodies_have_the_elements_of_others(
    monkeypatch: pytest.MonkeyPatch, shapes: tuple[Geometry, ...], fixed_base: bool
) -> None:
    description = part(shapes, Contact(lateral_friction=0.4, spinning_friction=0.01))
    found = [text_of(description, fixed_base=fixed_base) for _ in range(3)]
    monkeypatch.setattr(body_module, "build_plain", lambda spec, plan: None)
    alone = text_of(replace(description), fixed_base=fixed_base)
    assert found == [alone] * 3


def test_bodies_with_meshes_are_built_otherwise() -> None:
    description = part([Mesh(uri="", path=None, data=box(0.1, 0.1, 0.1))])
    world = World(profile=BULLET, visual_geoms=False)
    for k in range(3):
        world.add_description(description, (k, 0.0, 1.0), drives=False)
    world.ensure_compiled()
    assert world.live_model.nmesh == 1 and (world.live_model.geom_dataid >= 0).sum() == 3
