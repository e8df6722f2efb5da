"""Computed templates of bodies of one simple shape equal those that MuJoCo compiles."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest

from roboyard.description.model import (
    Box,
    Capsule,
    Collision,
    Cylinder,
    Geometry,
    Inertial,
    Link,
    Material,
    Mesh,
    Pose,
    RobotDescription,
    Sphere,
    Visual,
)
from roboyard.sim.build.records import BuildOptions
from roboyard.sim.pool.analytic_templates import NEARLY, analytic_template, numbers_of
from roboyard.sim.pool.templates import BodyTemplate, make_template

ORIGIN = (0.0, 0.0, 0.0)
UNTURNED = (0.0, 0.0, 0.0, 1.0)


class _Maker:
    """Random bodies, some of whose frames coincide."""

    def __init__(self) -> None:
        self.rng = np.random.default_rng(11)

    def floats(self, count: int, low: float = 0.05, high: float = 0.4) -> tuple[float, ...]:
        return tuple(self.rng.uniform(low, high, count).tolist())

    def pose(self, moved: bool, turned: bool) -> Pose:
        q = self.rng.normal(size=4)
        x, y, z, w = (q / np.linalg.norm(q)).tolist()
        place = self.floats(3, -0.5, 0.5)
        return Pose(
            position=place if moved else ORIGIN,  # type: ignore[arg-type]
            quaternion=(x, y, z, w) if turned else UNTURNED,
        )

    def geometry(self, kind: type) -> Geometry:
        a, b, c = self.floats(3)
        if kind is Box:
            return Box(size=(a, b, c))
        return Sphere(radius=a) if kind is Sphere else kind(radius=a, length=b)

    def body(self, kind: type, shapes: str, shape: Pose, inertial: Pose | None) -> RobotDescription:
        geometry = self.geometry(kind)
        x, y, z = self.floats(3, 0.01, 0.02)
        (mass,) = self.floats(1, 0.1, 4.0)
        collisions = tuple(Collision(geometry=geometry, origin=shape) for s in shapes if s == "c")
        visuals = tuple(
            Visual(geometry=geometry, origin=shape, material=Material(rgba=self.floats(4)))  # type: ignore[arg-type]
            for s in shapes
            if s == "v"
        )
        weight = (
            None
            if inertial is None
            else Inertial(mass=mass, origin=inertial, inertia=(x, 0.0, 0.0, y, 0.0, z))
        )
        link = Link(name="base", inertial=weight, visuals=visuals, collisions=collisions)
        return RobotDescription(name="body", links=(link,))


def _assert_same(computed: BodyTemplate, compiled: BodyTemplate) -> None:
    assert computed.layout == compiled.layout
    assert computed.collisions == compiled.collisions and computed.notes == compiled.notes
    for name, block in compiled.blocks.items():
        found = computed.blocks[name]
        assert np.shape(found) == block.shape, name
        np.testing.assert_allclose(found, block, rtol=1e-12, atol=1e-13, err_msg=name)
    computed_fields, compiled_fields = [computed.body, *computed.geoms], [compiled.body, *compiled.geoms]
    for ours, theirs in zip(computed_fields, compiled_fields, strict=True):
        for name, value in theirs.items():
            if isinstance(value, np.ndarray):
                np.testing.assert_allclose(ours[name], value, rtol=1e-7, err_msg=name)
            elif value == value:
                assert ours[name] == value, name


@pytest.mark.parametrize("fixed", [False, True], ids=["free", "fixed"])
@pytest.mark.parametrize("kind", [Box, Sphere, Cylinder, Capsule])
def test_computed_templates_equal_compiled_ones(kind, fixed):
    maker, options = _Maker(), BuildOptions(fixed_base=fixed)
    for shapes, moved, turned, weight in product(
        ("c", "cv", "ccv", ""), (False, True), (False, True), ("here", "moved", "turned", "both", "shape")
    ):

        def make(shapes=shapes, moved=moved, turned=turned, weight=weight):
            shape = maker.pose(moved, turned)
            inertial = maker.pose(weight in ("moved", "both"), weight in ("turned", "both"))
            return maker.body(kind, shapes, shape, shape if weight == "shape" else inertial)

        first, second = make(), make()
        numbers, family = numbers_of(second, options), make_template(first, options)
        compiled = make_template(second, options)
        assert numbers is not None and family is not None and compiled is not None
        other = numbers_of(first, options)
        assert other is not None and other.signature == numbers.signature
        _assert_same(analytic_template(family, numbers, second), compiled)


def test_fixed_bodies_need_no_mass_and_scale_counts():
    maker = _Maker()
    options = BuildOptions(fixed_base=True, scale=1.7)
    first, second = (maker.body(Cylinder, "c", maker.pose(True, True), None) for _ in range(2))
    numbers, family = numbers_of(second, options), make_template(first, options)
    compiled = make_template(second, options)
    assert numbers is not None and family is not None and compiled is not None
    _assert_same(analytic_template(family, numbers, second), compiled)


def test_bodies_without_a_signature_need_a_compile():
    maker, free = _Maker(), BuildOptions(fixed_base=False)
    here, near = maker.pose(False, False), Pose(position=(NEARLY / 2, 0.0, 0.0))
    assert numbers_of(maker.body(Box, "c", here, here), free) is not None
    assert numbers_of(maker.body(Box, "c", near, here), free) is None
    assert numbers_of(maker.body(Box, "c", here, near), free) is None
    assert numbers_of(maker.body(Box, "c", here, None), free) is None
    other_sign = Pose(quaternion=(0.0, 0.0, 0.0, -1.0))
    assert numbers_of(maker.body(Box, "c", other_sign, here), free) is None
    mesh = Link(name="base", collisions=(Collision(geometry=Mesh(uri="", path=None)),))
    assert numbers_of(RobotDescription(name="m", links=(mesh,)), free) is None
    apart = Link(
        name="base",
        inertial=Inertial(mass=1.0, inertia=(1.0, 0.0, 0.0, 1.0, 0.0, 1.0)),
        collisions=(Collision(geometry=Sphere(radius=0.1)), Collision(geometry=Sphere(radius=0.2))),
    )
    assert numbers_of(RobotDescription(name="a", links=(apart,)), free) is None
