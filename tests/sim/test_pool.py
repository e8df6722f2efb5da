"""Bodies from the pool equal compiled ones, and inactive bodies have no effect."""

from __future__ import annotations

from dataclasses import replace

import mujoco
import numpy as np
import pytest
from pool_worlds import assert_same_model, mesh, twin_of

from roboyard.errors import RoboyardError
from roboyard.sensors import ForceTorqueSensor, Imu
from roboyard.sim import World
from roboyard.sim.physics_profile import BULLET, PLAIN
from roboyard.sim.pool.body_pool import IDLE_STEPS, MOST_DISCARDED, STREAK


def _grow(world: World, count: int, add=None, steps: int = 1) -> list:
    bodies = []
    for k in range(count):
        place = (0.5 * (k % 5), 0.5 * (k // 5), 0.3)
        bodies.append(world.add_box((0.2, 0.2, 0.2), place) if add is None else add(k, place))
        world.step(steps)
    return bodies


def _mixed(world: World):
    """Bodies of the same layout with other numbers each time."""
    rng = np.random.default_rng(4)

    def add(k, place):
        turn = rng.normal(size=4)
        match k % 4:
            case 0:
                size = rng.uniform(0.1, 0.3, 3)
                return world.add_box(size, place, turn, mass=1 + k, friction=0.1 * k, name=f"b{k}")
            case 1:
                return world.add_sphere(0.1 + 0.01 * k, place, mass=0.5)
            case 2:
                return world.add_cylinder(0.1, 0.2, place, turn, rgba=(0.1, 0.2, 0.3, 0.5))
            case _:
                return world.add_capsule(0.05, 0.2, place, turn, friction=0.3)

    return add


def _compiled_again(world: World) -> mujoco.MjModel:
    """The same bodies, compiled by MuJoCo from a spec without inactive bodies."""
    world.mark_stale()
    return world.model


@pytest.mark.parametrize("profile", [PLAIN, BULLET], ids=["plain", "bullet"])
@pytest.mark.parametrize("visual", [True, False])
def test_rows_equal_those_of_a_compile(profile, visual):
    world = World(profile=profile, visual_geoms=visual)
    world.add_plane()
    _grow(world, 14, _mixed(world))
    assert world.pool.free
    live, revision = world.live_model, world.revision
    assert live.nbody == 1 + 1 + 14 + world.pool.free
    rows = [body.mujoco_ids.copy() for body in world.bodies]
    qpos = world.live_data.qpos.copy()
    # MuJoCo's arrays without inactive bodies
    real = world.model
    assert world.revision > revision and real.nbody == 16 and not world.pool.free
    assert_same_model(live, real)
    assert [body.mujoco_ids.tolist() for body in world.bodies] == [r.tolist() for r in rows]
    np.testing.assert_array_equal(world.data.qpos, qpos[: real.nq])
    assert_same_model(real, _compiled_again(world))


def test_many_bodies_need_few_compiles():
    world = World()
    models = []
    for k in range(90):
        world.add_box((0.2, 0.2, 0.2), (k, 0, 1))
        world.step()
        models.append(world.live_model)
    assert len({id(model) for model in models}) == 6  # with 1, 2, 3 + 8, 12 + 12, 25 + 25 and 51 + 51 bodies


@pytest.mark.parametrize("profile", [PLAIN, BULLET], ids=["plain", "bullet"])
def test_physics_equals_that_of_a_world_built_at_once(profile):
    world = World(profile=profile)
    world.add_plane()
    _grow(world, 20, _mixed(world), steps=3)
    world.bodies[7].links[0].restitution = 0.5
    free = world.pool.free
    assert free
    twin = twin_of(world)
    for _ in range(40):  # contacts blow rounding up, at 120 steps to 1e-8
        world.step()
        twin.step()
    assert world.pool.free == free
    assert world.live_data.ncon == twin.data.ncon > 10
    for mine, theirs in zip(world.bodies, twin.bodies, strict=True):
        np.testing.assert_allclose(mine.pose[0], theirs.pose[0], atol=1e-11)
        np.testing.assert_allclose(mine.pose[1], theirs.pose[1], atol=1e-11)
        np.testing.assert_allclose(mine.velocity[0], theirs.velocity[0], atol=1e-10)


@pytest.mark.parametrize("profile", [PLAIN, BULLET], ids=["plain", "bullet"])
def test_tolerance_is_that_of_active_bodies(profile):
    """MuJoCo's without groups of bodies that touch is relative to the inertia of all."""
    world = World(profile=profile)
    world.add_plane()
    _grow(world, 14, _mixed(world))
    world.remove(world.bodies[-2])

    def check(inactive: bool) -> None:
        option, inertia = world.live_model.opt, world.live_model.dof_M0
        active = sum(inertia[body.free_dof :][:6].sum() for body in world.bodies if body.free_dof >= 0)
        share = active / inertia.sum() if profile is BULLET else 1.0
        assert option.tolerance == pytest.approx(1e-8 * share, rel=1e-9)
        assert (share < 0.99) == (inactive and profile is BULLET)

    check(inactive=True)
    assert world.model.opt.tolerance == 1e-8
    check(inactive=False)


def test_contacts_soften_with_the_body_that_makes_a_pile():
    world = World(profile=replace(BULLET, motor_rounds=0))
    world.add_plane()
    solvers = []
    for k in range(46):
        world.add_box((0.2, 0.2, 0.2), (0.5 * (k % 7), 0.5 * (k // 7), 0.3))
        world.step()
        solvers.append(world.solver)
        assert int(world.live_model.opt.solver) == (1 if world.solver == "cg" else 2)
        assert world.hard_contacts == (world.solver == "newton")
    assert "newton" in solvers and solvers[-1] == "cg"
    live = world.live_model
    assert_same_model(live, world.model)


def test_meshes_are_shared_and_released():
    world = World()
    shape = mesh()
    bodies = _grow(world, 12, lambda k, place: world.add_mesh(shape, place, scale=1.0))
    assert world.pool.free
    live = world.live_model
    assert_same_model(live, world.model)
    for body in bodies:
        world.remove(body)
    assert world.model.nmesh == 0
    assert world.assets._meshes == {}


def test_shapes_without_a_pooled_body_are_compiled():
    world = World()
    _grow(world, 9)
    assert world.pool.free
    ball = world.add_mesh(mesh(), (3, 3, 3))
    world.step()
    assert world.live_model.nmesh == 2  # hull for contact, triangles to look at
    assert ball.pose[0][2] == pytest.approx(3, abs=0.01)
    assert_same_model(world.live_model, world.model)


def test_inactive_bodies_do_not_collide_and_rays_miss_them():
    world = World()
    world.add_plane()
    _grow(world, 10)
    assert world.pool.free
    # all pooled bodies are at the pose of the body before them
    body = world.bodies[-1]
    body.set_pose((50.0, 0, 5))
    hit = world.ray((2.0, 0.5, 3.0), (2.0, 0.5, -3.0))
    assert hit is not None and hit.link.body.name == "plane"
    looking_through = world.ray((2.0, 0.5, 3.0), (2.0, 0.5, -3.0), visual=True)
    assert looking_through is not None and looking_through.link.body.name == "plane"
    world.step(100)
    owners = world.contact_arrays().owners
    assert (owners >= 0).all()
    assert len(world.bodies) == 11
    assert world.pool.free
    names = [b.name for b in world.spec.bodies]
    assert not world.pool.free and not any("pooled" in name for name in names)
    assert world.model.nv == 60 == len(world.data.qvel)


def test_saved_state_fits_after_the_pool_is_cleared():
    world = World()
    _grow(world, 8)
    assert world.pool.free
    saved = world.save_state()
    assert not world.pool.free
    before = [body.pose[0] for body in world.bodies]
    world.step(30)
    world.restore_state(saved)
    for body, place in zip(world.bodies, before, strict=True):
        np.testing.assert_array_equal(body.pose[0], place)


def test_removed_body_can_be_used_again():
    world = World()
    world.add_plane()
    _grow(world, 8)
    model = world.live_model
    body = world.bodies[-1]
    body.set_velocity((1, 2, 3), (4, 5, 6))
    body.links[0].set_damping(linear=0.3)
    body.links[0].set_frictionless(0.0)
    body.links[0].apply_wrench((100.0, 0, 0))
    free = world.pool.free
    world.remove(body)
    assert world.pool.free == free + 1 and world.live_model is model
    world.step()
    again = world.add_sphere(0.1, (1, 1, 1), name=body.name)
    assert world.live_model is model
    world.step()
    speed = world.gravity * world.timestep
    np.testing.assert_allclose(again.velocity[0], speed, atol=1e-12)
    np.testing.assert_array_equal(again.velocity[1], 0)
    assert again.links[0].friction == 1.0 and again.name == body.name
    assert_same_model(world.live_model, world.model)


def test_adding_and_removing_in_turn_stops_compiling():
    world = World()
    world.add_plane()
    seen = []
    for k in range(10):
        body = world.add_box((0.1, 0.1, 0.1 + 0.01 * k), (0, 0, 1), mass=1.0 + k)
        world.step(5)
        seen.append(world.live_model)
        np.testing.assert_allclose(body.velocity[0], 5 * world.gravity * world.timestep, atol=1e-12)
        assert body.bounds[1, 2] - body.bounds[0, 2] == pytest.approx(0.1 + 0.01 * k, abs=1e-6)
        _assert_no_other(world, body)
        world.remove(body)
    assert all(model is seen[-1] for model in seen[4:])
    assert world.model.nbody == 2


def _assert_no_other(world: World, body) -> None:
    hit = world.ray((0, 0, 5), (0, 0, 0.2))
    assert hit is not None and hit.link.body is body


def test_body_changed_before_its_compile_is_not_a_template():
    from roboyard.description.model import Inertial, Pose

    inertial = Inertial(mass=2.0, origin=Pose(position=(0.05, 0, 0)), inertia=(0.1, 0, 0, 0.1, 0, 0.1))
    world = World()
    for k in range(3):
        body = world.add_box((0.2, 0.2, 0.2), (k, 0, 1))
        body.links[0].set_inertial(inertial)
        world.step()
    assert world.pool.free
    world.remove(body)
    for k in range(2, 5):
        world.add_box((0.2, 0.2, 0.2), (k, 0, 1))
        world.step()
    np.testing.assert_array_equal(world.model.body_mass[1:], [2, 2, 1, 1, 1])
    np.testing.assert_array_equal(world.model.body_simple[1:], [0, 0, 1, 1, 1])


def test_removal_in_the_middle_keeps_the_other_bodies():
    world = World()
    bodies = _grow(world, 10)
    places = [body.pose[0] for body in bodies]
    world.remove(bodies[4])
    world.remove(bodies[1])
    left = [k for k in range(10) if k not in (1, 4)]
    assert world.model.nbody == 9
    for k in left:
        np.testing.assert_array_equal(bodies[k].pose[0], places[k])


def test_later_edits_keep_state_and_settings():
    world = World()
    world.add_plane()
    bodies = _grow(world, 14, _mixed(world))
    assert world.pool.free
    bodies[9].links[0].friction = 0.7
    bodies[13].set_velocity((0.1, 0, 0))
    places, speeds = [b.pose for b in bodies], [b.velocity for b in bodies]
    world.constraints.add_point(bodies[12].links[0], bodies[13].links[0], position_a=(0.2, 0, 0))
    world.filters.set(bodies[3].links[0], bodies[13].links[0], collide=False)
    assert world.model.nexclude == 1 and world.model.neq == 1
    for body, place, speed in zip(bodies, places, speeds, strict=True):
        np.testing.assert_array_equal(body.pose[0], place[0])
        np.testing.assert_array_equal(body.velocity[0], speed[0])
    assert bodies[9].links[0].friction == 0.7
    row = bodies[9].links[0].geom_ids[0]
    assert world.model.geom_friction[row, 0] == 0.7


def test_non_finite_positions_are_rejected():
    world = World()
    _grow(world, 5)
    assert world.pool.free
    before = len(world.bodies)
    with pytest.raises(RoboyardError, match="position must be finite"):
        world.add_box((0.1, 0.1, 0.1), (np.nan, 0, 0))
    world.step()
    assert len(world.bodies) == before


def test_inactive_bodies_are_deleted_after_idle_steps():
    world = World()
    _grow(world, 8)
    assert world.pool.free
    world.step(IDLE_STEPS + 1)
    world.step()
    assert world.pool.free == 0
    assert world.live_model.nbody == 9


def test_reading_the_model_delays_the_next_pooled_bodies():
    world = World()
    for k in range(STREAK + 1):
        world.add_box((0.1, 0.1, 0.1), (k, 0, 1))
        world.step()
    assert world.pool.free
    assert world.model.nbody == STREAK + 2
    _grow(world, STREAK)
    assert not world.pool.free
    _grow(world, STREAK + 1)
    assert world.pool.free


def test_sensor_readings_keep_the_pool():
    world = World()
    bodies = _grow(world, 8)
    free = world.pool.free
    assert free
    falling = bodies[-1].links[0]
    np.testing.assert_allclose(Imu(falling).observe()["acceleration"], 0.0, atol=1e-9)
    np.testing.assert_allclose(ForceTorqueSensor(falling).observe()["force"], 0.0, atol=1e-9)
    assert world.pool.free == free


def test_robots_between_boxes_get_no_pooled_bodies():
    world = World()
    for k in range(6):
        world.add_box((0.1, 0.1, 0.1), (k, 0, 1))
        world.add_mjcf(
            f'<mujoco><worldbody><body name="r{k}"><joint/><geom size=".1"/></body></worldbody></mujoco>'
        )
        world.step()
        assert not world.pool.free


def test_bodies_removed_before_a_compile_are_deleted_together():
    """They leave neither names nor meshes behind, and the spec is never much larger."""
    world = World()
    kept = world.add_box((0.2, 0.2, 0.2), (0, 0, 1), name="kept")
    world.step()
    for _ in range(2 * MOST_DISCARDED + 5):
        body = world.add_mesh(mesh(), (0, 0, 2), name="lost")
        assert body.name == "lost"
        world.constraints.add_point(body.links[0], kept.links[0])
        world.remove(body)
        assert len(world.raw_spec.bodies) <= 3 + MOST_DISCARDED
    other = world.add_box((0.1, 0.1, 0.1), (0, 0, 3), name="lost")
    world.remove(other)
    assert [body.name for body in world.spec.bodies] == ["world", "kept/base"]
    assert not world.assets.count
    last = world.add_box((0.1, 0.1, 0.1), (0, 0, 3), name="lost")
    world.step()
    assert (world.live_model.nbody, world.live_model.nmesh, world.live_model.neq) == (3, 0, 0)
    world.add_box((0.1, 0.1, 0.1), (0, 0, 5))
    world.remove(last)  # compiled before
    world.step()
    assert world.model.nbody == 3  # without pooled bodies
    assert kept.position[2] < 1.0
