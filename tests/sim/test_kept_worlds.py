"""A compiled world that is taken over against one that is compiled, number by number."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from model_numbers import differing

from roboyard.description.model import (
    Box,
    Capsule,
    Collision,
    Inertial,
    Joint,
    Limit,
    Link,
    Mesh,
    Pose,
    RobotDescription,
)
from roboyard.shapes.mesh import TriangleMesh
from roboyard.sim import objects
from roboyard.sim.physics_profile import BULLET
from roboyard.sim.pool import kept_worlds
from roboyard.sim.pool.model_memory import memory_of
from roboyard.sim.world import World

BOX = objects.box([0.1, 0.2, 0.3], mass=0.7, rgba=objects.GREY, friction=None, name="box")
WEDGE = Mesh(
    uri="wedge",
    path=None,
    data=TriangleMesh(
        vertices=np.array([[0, 0, 0], [0.1, 0, 0], [0, 0.2, 0], [0, 0, 0.1]], float),
        faces=np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]], np.int32),
    ),
)
INERTIAL = Inertial(
    mass=1.3,
    origin=Pose(position=(0.01, 0.02, 0.03), quaternion=(0.1, 0.2, 0.3, np.sqrt(1 - 0.14))),
    inertia=(0.02, 0.0, 0.0, 0.03, 0.0, 0.04),
)
ARM = RobotDescription(
    name="arm",
    links=(
        Link(name="base", inertial=INERTIAL, collisions=(Collision(geometry=WEDGE),)),
        Link(name="upper", inertial=INERTIAL, collisions=(Collision(geometry=Box(size=(0.1, 0.1, 0.2))),)),
        Link(
            name="fore", inertial=INERTIAL, collisions=(Collision(geometry=Capsule(radius=0.1, length=0.3)),)
        ),
    ),
    joints=(
        Joint(
            name="one",
            type="revolute",
            parent="base",
            child="upper",
            axis=(0.0, 0.6, 0.8),
            origin=Pose(position=(0.1, 0.0, 0.2)),
            limit=Limit(lower=-1.0, upper=1.0, effort=1.0, velocity=1.0),
        ),
        Joint(name="two", type="spherical", parent="upper", child="fore", origin=Pose(position=(0.3, 0, 0))),
    ),
)


def world(former: Any = None) -> World:
    made = World(profile=BULLET, visual_geoms=False)
    made.is_kept, made.compiles.former = True, former
    return made


def fill(made: World, places: np.ndarray, *, fixed: bool = False) -> World:
    for description, place in zip((BOX, ARM, ARM, BOX), places, strict=True):
        is_fixed = fixed and description is ARM
        made.add_description(description, place[:3], place[3:], fixed_base=is_fixed, drives=False)
    bodies = made.bodies
    made.filters.set(bodies[0].links[0], bodies[1].links[2], collide=False)
    bodies[1].links[1].set_friction(sliding=0.3, rolling=0.01)
    made.ensure_compiled()
    return made


def places(seed: int) -> np.ndarray:
    drawn = np.random.default_rng(seed)
    quaternions = drawn.normal(size=(4, 4))
    quaternions /= np.linalg.norm(quaternions, axis=1, keepdims=True)
    return np.concatenate([drawn.normal(size=(4, 3)), quaternions], axis=1)


def disturb(made: World) -> None:
    """Change all that steps, and numbers of the model that programs change, without touching the spec."""
    made.step(5)
    made.bodies[0].set_velocity([1, 2, 3], [4, 5, 6])
    made.bodies[1].joint("one").velocity = 0.3
    made.gravity, made.timestep = (1, 2, -3), 0.004
    made.step(5)
    memory = memory_of(made.live_model)
    assert memory is not None
    model = made.live_model
    model.geom_friction[:] = 7.0
    model.body_mass[1:] *= 3.0
    model.qpos0[:] += 0.1
    model.stat.meaninertia = 17.0
    made.mark_inertia_changed()
    made.step(1)


@pytest.mark.parametrize("fixed", [False, True])
@pytest.mark.parametrize("moves", [False, True])
def test_a_world_that_is_taken_over_has_the_numbers_of_a_compile(moves: bool, fixed: bool) -> None:
    former, kept = None, []
    for episode in range(6):  # meshes are built at once the first time, and two worlds are compared
        at = places(episode if moves else 0)
        made = fill(world(former), at, fixed=fixed)
        fresh = fill(World(profile=BULLET, visual_geoms=False), at, fixed=fixed)
        assert differing(made.live_model, fresh.live_model) == []
        assert differing(made.live_model.opt, fresh.live_model.opt) == []
        viewed = {"center", "extent", "meansize"} if moves else set()  # of the bodies' places, for viewers
        assert {*differing(made.live_model.stat, fresh.live_model.stat)} <= viewed
        assert differing(made.live_data, fresh.live_data) == []
        disturb(made)
        kept.append(made.live_model)
        former = made.retire()
        made.release()
    assert kept[-3] is kept[-2] is kept[-1]


def test_a_world_with_constraints_is_that_of_a_compile() -> None:
    former, kept = None, []

    def constrained(made: World, at: np.ndarray, pivot: float) -> World:
        box = made.add_description(BOX, at[0, :3], drives=False)
        made.constraints.add_point(box.links[0], None, position_b=(0, 0, pivot))
        arms = [made.add_description(ARM, place[:3], place[3:], drives=False) for place in at[1:3]]
        made.constraints.add_weld(arms[0].links[0], arms[1].links[1], max_force=5.0 + pivot)
        made.ensure_compiled()
        return made

    for episode in range(5):
        at = places(0)
        made = constrained(world(former), at, episode)
        fresh = constrained(World(profile=BULLET, visual_geoms=False), at, episode)
        assert differing(made.live_model, fresh.live_model) == []
        for _ in range(4):
            made.step()
            fresh.step()
        names = {*differing(made.live_data, fresh.live_data)}
        assert names.isdisjoint(("qpos", "qvel", "qacc", "qfrc_constraint", "eq_active", "site_xpos"))
        kept.append(made.live_model)
        made.constraints.remove(made.constraints.all[0])
        made.step()
        former = made.retire()
        made.release()
    assert kept[-2] is kept[-1]


def test_a_changed_spec_is_not_taken_over() -> None:
    for change in (
        lambda made: made.spec,
        lambda made: made.model,
        lambda made: made.data,
        lambda made: made.remove(made.bodies[0]),
        lambda made: setattr(made.bodies[0].links[0], "friction", 0.2),
        lambda made: made.bodies[1].joint("one").set_limits(-0.1, 0.1),
        lambda made: setattr(made.bodies[1].joint("one"), "damping", 0.3),
        lambda made: setattr(made.bodies[1].joint("one"), "armature", 0.3),
        lambda made: made.bodies[0].links[0].set_frictionless(),
        lambda made: made.bodies[0].links[0].set_inertial(Inertial(mass=2.0, inertia=(1, 0, 0, 1, 0, 1))),
        lambda made: made.constraints.add_gear(*(made.bodies[k].joint("one") for k in (1, 2)), 1.0),
        lambda made: made.bodies[0].links[0].flatten_spheres(0.1),
    ):
        made = fill(world(), places(0))
        made.step()
        change(made)
        made.step()
        former = made.retire()
        assert former is None or former.compiles == ()


def test_large_models_are_not_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(kept_worlds, "MOST_BYTES", 100)
    former = None
    for _ in range(4):
        made = fill(world(former), places(0))
        former = made.retire()
        assert former is None or former.compiles[0][1] is None


def test_other_settings_are_compiled_again() -> None:
    former = None
    for _ in range(4):
        made = fill(world(former), places(0))
        former = made.retire()
    assert former is not None
    assert former.compiles[0][1] is not None
    kept = former.compiles[0][1].model
    other = world(former)
    other.solver = "cg"
    assert fill(other, places(0)).live_model is not kept
    again = fill(world(former), places(0))
    assert again.live_model is kept


def test_the_arrays_of_a_model_are_one_block() -> None:
    made = fill(world(), places(0))
    memory = memory_of(made.live_model)
    assert memory is not None
    before = made.live_model.geom_friction.copy()
    copy = memory.copy()
    for values in (made.live_model.geom_friction, made.live_model.qpos0, made.live_model.names_map):
        values[:] = 3
    memory[:] = copy
    assert np.array_equal(made.live_model.geom_friction, before)


def grow(made: World, at: np.ndarray, *, fixed: bool, parts: int = 2) -> None:
    """Add bodies in parts; read and write the state between them, as programs do."""
    every = list(zip((BOX, ARM, ARM, BOX), at, strict=True))
    size = len(every) // parts
    for first in range(0, len(every), size):
        for description, place in every[first : first + size]:
            is_fixed = fixed and description is ARM
            made.add_description(description, place[:3], place[3:], fixed_base=is_fixed, drives=False)
        if first == 0:
            made.filters.set(made.bodies[0].links[0], made.bodies[-1].links[-1], collide=False)
        arm = next((body for body in made.bodies if body.joints), None)
        if arm is not None:
            arm.joint("one").position = 0.3
            arm.joint("one").velocity = -0.2
        box = made.bodies[0]
        box.set_velocity([0.1, 0.2, 0.3], [0, 0, 1])
        made.wrenches.pending = True
        made.live_data.xfrc_applied[-1], made.live_data.qfrc_applied[:3] = 0.5, 0.1
        assert np.isfinite(box.pose[0]).all()
        if fixed and arm is not None:
            arm.set_pose([0.5, 0.1 * first, 0.2])
        made.step(2)
    made.filters.set(made.bodies[1].links[0], made.bodies[3].links[0], collide=False)
    made.ensure_compiled()


@pytest.mark.parametrize("parts", [2, 4])
@pytest.mark.parametrize("fixed", [False, True])
@pytest.mark.parametrize("moves", [False, True])
def test_a_world_that_grows_is_taken_over_at_each_of_its_compiles(
    moves: bool, fixed: bool, parts: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("roboyard.sim.pool.body_pool.STREAK", 100)  # no pooled bodies in the compiled one
    former, kept = None, []
    for episode in range(6):
        at = places(episode if moves else 0)
        made, fresh = world(former), World(profile=BULLET, visual_geoms=False)
        made.pool.disable()
        fresh.pool.disable()
        grow(made, at, fixed=fixed, parts=parts)
        grow(fresh, at, fixed=fixed, parts=parts)
        assert differing(made.live_model, fresh.live_model) == []
        assert differing(made.live_model.opt, fresh.live_model.opt) == []
        assert differing(made.live_data, fresh.live_data) == []
        made.step(5)
        fresh.step(5)
        left = {name for name in differing(made.live_data, fresh.live_data) if not name.startswith("efc_J")}
        assert left == set()  # but for the Jacobian, of which MuJoCo leaves unused places as they were
        kept.append(made.live_model)
        former = made.retire()
        assert former is not None or episode == 0
        made.release()
    assert kept[-3] is kept[-2] is kept[-1]


def test_a_world_that_grows_in_another_way_is_compiled_again() -> None:
    former, models = None, []
    for episode in range(8):
        made, fresh = world(former), World(profile=BULLET, visual_geoms=False)
        for one in (made, fresh):
            one.add_description(BOX, [0, 0, 1])
            one.step()
            one.add_description(BOX if episode in (4, 5) else ARM, [0, 0, 2], fixed_base=True, drives=False)
            one.step()
        assert differing(made.live_model, fresh.live_model) == []
        assert differing(made.live_data, fresh.live_data) == []
        models.append(made.live_model)
        former = made.retire()
        made.release()
    assert models[2] is models[3] and models[3] not in models[4:6]
