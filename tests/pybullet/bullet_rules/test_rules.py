"""Bullet's rules on their own: inertia, bounds, tangents, merging, single precision, stable PD."""

from __future__ import annotations

from math import sqrt
from pathlib import Path

import mujoco
import numpy as np
import pytest

from roboyard.description.model import (
    Box,
    Capsule,
    Collision,
    Cylinder,
    Inertial,
    Joint,
    Link,
    Mesh,
    Plane,
    Pose,
    RobotDescription,
    Sphere,
)
from roboyard.pybullet.bullet_rules import (
    contact_order,
    models,
    motor_kernels,
    shape_bounds,
    shape_inertia,
    single_precision,
)
from roboyard.pybullet.bullet_rules.merging import merge_fixed_links
from roboyard.pybullet.bullet_rules.stable_pd import StablePdTargets, rotation_error, stable_pd_torque
from roboyard.pybullet.state import state_kernels


def bounds(*shapes: Collision, frame: Pose | None = None, implicit: bool = True, from_file: bool = False):
    return shape_bounds.link_bounds(frame or Pose(), shapes, implicit_cylinder=implicit, from_file=from_file)


class TestMoments:
    def test_a_sphere(self) -> None:
        moments = shape_inertia.shape_moments(3.0, bounds(Collision(geometry=Sphere(radius=0.2))))
        assert moments == pytest.approx([0.4 * 3 * 0.04] * 3)

    def test_a_box(self) -> None:
        moments = shape_inertia.shape_moments(12.0, bounds(Collision(geometry=Box(size=(1, 2, 3)))))
        assert moments == pytest.approx((13, 10, 5))

    def test_a_cylinder(self) -> None:
        moments = shape_inertia.shape_moments(12.0, bounds(Collision(geometry=Cylinder(radius=1, length=2))))
        assert moments == pytest.approx((7, 7, 6))

    def test_a_massless_link(self) -> None:
        assert shape_inertia.shape_moments(0.0, bounds()) == (0, 0, 0)

    def test_two_shapes_are_the_box_around_them(self) -> None:
        near = Collision(geometry=Box(size=(1, 1, 1)))
        far = Collision(geometry=Box(size=(1, 1, 1)), origin=Pose(position=(1, 0, 0)))
        moments = shape_inertia.shape_moments(12.0, bounds(near, far))
        assert moments == pytest.approx((2, 5, 5))

    def test_a_link_without_shapes_is_almost_a_point(self) -> None:
        moments = shape_inertia.shape_moments(1.0, bounds(from_file=True))
        assert 0 < max(moments) < 1e-5


class TestBounds:
    @pytest.mark.parametrize(
        ("geometry", "half"),
        [
            (Box(size=(2, 4, 6)), (1, 2, 3)),
            (Sphere(radius=0.5), (0.5, 0.5, 0.5)),
            (Capsule(radius=0.2, length=1), (0.2, 0.2, 0.7)),
            (Cylinder(radius=0.2, length=1), (0.2, 0.2, 0.5)),
        ],
    )
    def test_local_boxes(self, geometry, half) -> None:
        found = shape_bounds.local_bounds(geometry, implicit_cylinder=True)
        assert found == pytest.approx(np.array([-np.array(half), half]))

    def test_a_plane_has_no_local_box(self) -> None:
        assert shape_bounds.local_bounds(Plane(), implicit_cylinder=True) is None
        assert bounds(Collision(geometry=Plane())).kind == "plane"

    def test_kinds(self) -> None:
        kinds = {
            "sphere": Sphere(radius=1), "solid": Box(size=(1, 1, 1)), "cylinder": Cylinder(radius=1, length=1)
        }  # fmt: skip
        for kind, geometry in kinds.items():
            assert bounds(Collision(geometry=geometry)).kind == kind
        assert bounds(Collision(geometry=Cylinder(radius=1, length=1)), implicit=False).kind == "hull"
        moved = Collision(geometry=Sphere(radius=1), origin=Pose(position=(1, 0, 0)))
        assert bounds(moved).kind == "compound"

    def test_a_box_in_the_world_turns(self) -> None:
        corners = bounds(Collision(geometry=Box(size=(2, 4, 6)))).corners
        box = np.array([[*corners.ravel(), 0.0, 1.0]])
        inertial = np.array([[0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]])
        found = np.empty(6)
        at, turned = np.array([[1.0, 2.0, 3.0]]), np.array([[sqrt(0.5), 0.0, 0.0, sqrt(0.5)]])
        state_kernels.link_box(at, turned, inertial, box, 0, 0, found)
        assert found == pytest.approx([-1, 1, 0, 3, 3, 6])


@pytest.mark.parametrize("seed", range(8))
def test_tangents_are_a_right_handed_frame(seed: int) -> None:
    normal = np.random.default_rng(seed).normal(size=3)
    normal /= np.linalg.norm(normal)
    first, second = (np.array(each) for each in contact_order.tangents(tuple(normal)))
    assert np.linalg.norm(first) == pytest.approx(1)
    assert np.cross(normal, first) == pytest.approx(second)


def test_kinds_of_links() -> None:
    def link(*shapes: Collision) -> models.LinkModel:
        return models.LinkModel(
            name="l", mass=1, moments=(1, 1, 1), frame=Pose(), collisions=shapes, visuals=()
        )

    def kinds(*shapes: Collision, from_file: bool = True) -> list[int]:
        return contact_order.kinds_of(link(*shapes), from_file=from_file)

    convex, compound, nested = contact_order.CONVEX, contact_order.COMPOUND, contact_order.NESTED
    sphere = Collision(geometry=Sphere(radius=1))
    assert kinds(sphere) == [convex]
    assert kinds(sphere, sphere) == [compound, compound]
    assert kinds(Collision(geometry=Plane())) == [contact_order.SURFACE]
    moved = Collision(geometry=Sphere(radius=1), origin=Pose(position=(0, 0, 1)))
    assert kinds(moved) == [compound]
    mesh = Collision(geometry=Mesh(uri="hand.obj", path=Path("hand.obj")))
    assert kinds(mesh) == [compound]
    assert kinds(mesh, from_file=False) == [convex]
    assert kinds(mesh, sphere) == [nested, compound]
    assert kinds(mesh, sphere, from_file=False) == [compound, compound]


class TestSinglePrecision:
    @pytest.mark.parametrize("value", [0.1, 1 / 3, 1e-10, 12345.678])
    def test_numbers_are_rounded_to_32_bits(self, value: float) -> None:
        assert single_precision.rounded(value) == (float(np.float32(value)),)

    def test_too_large_numbers_are_infinite(self) -> None:
        assert single_precision.rounded(1e300) == (np.inf,)

    def test_texts_are_refused(self) -> None:
        with pytest.raises(TypeError):
            single_precision.rounded("1")  # type: ignore[arg-type]

    @pytest.mark.parametrize(
        ("given", "found"),
        [
            ((0, 0, 0, -2), (0, 0, 0, 1)),
            ((0, 0, -1, 0), (0, 0, 1, 0)),
            ((-0.8, 0, 0, 0.1), (0.8, 0, 0, -0.1)),
            ((0.5, 0.5, 0.5, -0.9), (-0.5, -0.5, -0.5, 0.9)),
        ],
    )
    def test_the_sign_of_a_quaternion(self, given, found) -> None:
        length = np.linalg.norm(found)
        assert single_precision.canonical_quaternion(given) == pytest.approx([v / length for v in found])

    def test_a_zero_quaternion_has_no_sign(self) -> None:
        assert all(np.isnan(single_precision.canonical(0, 0, 0, 0)))


def test_merged_links_add_their_masses() -> None:
    unit = (1.0, 0.0, 0.0, 1.0, 0.0, 1.0)
    links = tuple(
        Link(
            name=name,
            inertial=Inertial(mass=mass, inertia=unit),
            collisions=(Collision(geometry=Sphere(radius=1)),),
        )
        for name, mass in (("base", 1.0), ("plate", 3.0), ("arm", 2.0))
    )
    joints = (
        Joint(name="weld", type="fixed", parent="base", child="plate", origin=Pose(position=(0, 0, 2))),
        Joint(name="turn", type="continuous", parent="plate", child="arm", origin=Pose(position=(0, 0, 1))),
    )
    merged = merge_fixed_links(RobotDescription(name="r", links=links, joints=joints))
    assert [link.name for link in merged.links] == ["base", "arm"]
    base, inertial = merged.links[0], merged.links[0].inertial
    assert inertial is not None
    assert inertial.mass == 4
    assert inertial.origin.position == pytest.approx((0, 0, 1.5))
    xx, _, _, yy, _, zz = inertial.inertia
    assert (xx, yy, zz) == pytest.approx((5, 5, 2)), "two unit tensors and 1 · 1.5² + 3 · 0.5² about x and y"
    assert [shape.origin.position for shape in base.collisions] == [(0, 0, 0), (0, 0, 2)]
    (joint,) = merged.joints
    assert joint.parent == "base"
    assert joint.origin.position == pytest.approx((0, 0, 3))


def test_a_fixed_base_keeps_its_mass_when_merged() -> None:
    links = tuple(Link(name=name, inertial=Inertial(mass=2.0)) for name in ("base", "plate"))
    joints = (Joint(name="weld", type="fixed", parent="base", child="plate"),)
    merged = merge_fixed_links(RobotDescription(name="r", links=links, joints=joints), fixed_base=True)
    assert merged.links[0].inertial is not None
    assert merged.links[0].inertial.mass == 2.0


def test_lengths_are_scaled_and_masses_are_not() -> None:
    link = Link(
        name="l", inertial=Inertial(mass=2.0, origin=Pose(position=(1, 0, 0))),
        collisions=(Collision(geometry=Box(size=(1, 2, 3)), origin=Pose(position=(0, 1, 0))),),
    )  # fmt: skip
    grown = models.scaled(RobotDescription(name="r", links=(link,)), 2.0).links[0]
    assert grown.inertial is not None
    assert grown.inertial.mass == 2.0
    assert grown.inertial.origin.position == (2, 0, 0)
    assert grown.collisions[0].geometry == Box(size=(2, 4, 6))
    assert grown.collisions[0].origin.position == (0, 2, 0)


@pytest.mark.parametrize("angle", [0.3, -1.0, 2.5])
def test_a_rotation_error_is_axis_times_angle(angle: float) -> None:
    axis = np.array([0.6, 0.0, 0.8])
    target = (*(axis * np.sin(angle / 2)), np.cos(angle / 2))
    assert rotation_error(np.array([1.0, 0, 0, 0]), target) == pytest.approx(axis * angle)


@pytest.mark.parametrize("kp", [10.0, 1e4, 1e6])
def test_stable_pd_control_does_not_overshoot_in_a_step(kp: float) -> None:
    """With implicit damping, gains stay stable that are far too stiff for an explicit spring at this step."""
    model = mujoco.MjModel.from_xml_string(
        '<mujoco><option gravity="0 0 0" timestep="0.02"/><worldbody><body><joint type="hinge" axis="0 0 1"/>'
        '<geom type="box" size=".1 .1 .1" mass="1"/></body></worldbody></mujoco>'
    )
    data, scratch = mujoco.MjData(model), mujoco.MjData(model)
    targets = StablePdTargets.zeros(1)
    targets.kp[:], targets.kd[:] = kp, 0.1 * kp
    for _ in range(300):
        targets.position_error[:] = 0.5 - data.qpos
        scratch.qpos[:], scratch.qvel[:] = data.qpos, data.qvel
        data.qfrc_applied[:] = stable_pd_torque(model, scratch, 0.02, targets, [0])
        mujoco.mj_step(model, data)
        assert abs(data.qpos[0]) < 1.0
    assert data.qpos[0] == pytest.approx(0.5, abs=5e-3)


@pytest.mark.parametrize("shift", [0.0, -100.0])
def test_damped_masses_are_solved_for_some_degrees_of_freedom(shift: float) -> None:
    """As NumPy solves them; not where the sum is not positive definite."""
    draw = np.random.default_rng(2)
    root = draw.normal(size=(6, 6))
    mass, damping, right = root @ root.T + np.eye(6), draw.random(6) + shift, draw.normal(size=6)
    own, out = np.array([4, 0, 3, 5]), np.full(6, 7.0)
    done = motor_kernels.solve_damped(mass, damping, own, right, np.empty((4, 4)), out)
    assert done == (shift == 0.0)
    if done:
        wanted = np.linalg.solve(mass[np.ix_(own, own)] + np.diag(damping[own]), right[own])
        np.testing.assert_allclose(out[own], wanted, rtol=1e-12)
        assert out[1] == out[2] == 7.0


def test_stable_pd_control_respects_its_limit() -> None:
    model = mujoco.MjModel.from_xml_string(
        '<mujoco><worldbody><body><joint type="slide" axis="1 0 0"/><geom size=".1" mass="2"/></body>'
        "</worldbody></mujoco>"
    )
    targets = StablePdTargets.zeros(1)
    targets.kp[:], targets.position_error[:], targets.limit[:] = 1e5, 1.0, 3.0
    assert stable_pd_torque(model, mujoco.MjData(model), 0.002, targets, [0]) == pytest.approx([3.0])
