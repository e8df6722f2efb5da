"""Bodies that take over spares must be what a compile makes of them, and spares must not be seen."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from roboyard.errors import ModelError
from roboyard.sim import World
from roboyard.sim.moulds import KINDS
from roboyard.sim.profile import BULLET, PLAIN
from roboyard.sim.spares import IDLE_STEPS, STREAK

TRIANGLES = np.array([[0, 0, 0], [0.2, 0, 0], [0, 0.3, 0], [0, 0, 0.4]], dtype=float)


def _mesh():
    from roboyard.shapes.mesh import TriangleMesh

    return TriangleMesh(vertices=TRIANGLES, faces=np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]))


def _grow(world: World, count: int, add=None, steps: int = 1) -> list:
    bodies = []
    for k in range(count):
        place = (0.5 * (k % 5), 0.5 * (k // 5), 0.3)
        bodies.append(world.add_box((0.2, 0.2, 0.2), place) if add is None else add(k, place))
        world.step(steps)
    return bodies


def _mixed(world: World):
    """Bodies of the same make with other numbers each time."""
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
    """The same bodies, compiled by MuJoCo from a spec without spares."""
    world.mark_stale()
    return world.model


def _assert_same_model(live: mujoco.MjModel, real: mujoco.MjModel) -> None:
    """All rows of bodies are the same; the live model may have more of them."""
    trees = int(real.body_bvhnum.sum())  # those of meshes lie behind
    for name in (n for n in dir(mujoco.MjModel) if n.startswith(KINDS)):
        a, b = getattr(live, name), getattr(real, name)
        b = b[:trees] if name.startswith("bvh") else b
        if isinstance(b, np.ndarray) and name != "dof_simplenum":  # which counts on into the spares
            assert a.dtype == b.dtype
            np.testing.assert_allclose(a[: len(b)], b, rtol=1e-12, atol=1e-13, err_msg=name)
    assert live.stat.meaninertia == pytest.approx(real.stat.meaninertia, rel=1e-12)


@pytest.mark.parametrize("profile", [PLAIN, BULLET], ids=["plain", "bullet"])
@pytest.mark.parametrize("visual", [True, False])
def test_rows_are_what_a_compile_gives(profile, visual):
    world = World(profile=profile, visual_geoms=visual)
    world.add_plane()
    _grow(world, 14, _mixed(world))
    assert world.spares.free
    live, revision = world.live_model, world.revision
    assert live.nbody == 1 + 1 + 14 + world.spares.free
    rows = [body.mujoco_ids.copy() for body in world.bodies]
    qpos = world.live_data.qpos.copy()
    # MuJoCo's own arrays of a world without spares
    real = world.model
    assert world.revision > revision and real.nbody == 16 and not world.spares.free
    _assert_same_model(live, real)
    assert [body.mujoco_ids.tolist() for body in world.bodies] == [r.tolist() for r in rows]
    np.testing.assert_array_equal(world.data.qpos, qpos[: real.nq])
    _assert_same_model(real, _compiled_again(world))


def test_few_compiles_for_many_bodies():
    world = World()
    models = []
    for k in range(90):
        world.add_box((0.2, 0.2, 0.2), (k, 0, 1))
        world.step()
        models.append(world.live_model)
    assert len({id(model) for model in models}) == 6  # with 1, 2, 3 + 8, 12 + 12, 25 + 25 and 51 + 51 bodies


def _twin(world: World) -> World:
    """A world of the same bodies, all built at once, in the same state."""
    twin = World(profile=world.profile, visual_geoms=world.visual_geoms)
    for body in world.bodies:
        assert body.description is not None
        copy = twin.add_description(body.description, *body.pose, fixed_base=body.is_fixed, name=body.name)
        for mine, theirs in zip(copy.links, body.links, strict=True):
            mine.friction = theirs.friction
            mine.restitution = theirs.restitution
    data, live = twin.data, world.live_data
    data.time = live.time
    for mine, theirs in zip(twin.bodies, world.bodies, strict=True):
        if mine.free_qpos >= 0:
            data.qpos[mine.free_qpos :][:7] = live.qpos[theirs.free_qpos :][:7]
            data.qvel[mine.free_dof :][:6] = live.qvel[theirs.free_dof :][:6]
            data.qacc_warmstart[mine.free_dof :][:6] = live.qacc_warmstart[theirs.free_dof :][:6]
    twin.mark_moved()
    return twin


@pytest.mark.parametrize("profile", [PLAIN, BULLET], ids=["plain", "bullet"])
def test_same_physics_as_built_at_once(profile):
    world = World(profile=profile)
    world.add_plane()
    _grow(world, 20, _mixed(world), steps=3)
    world.bodies[7].links[0].restitution = 0.5
    free = world.spares.free
    assert free
    twin = _twin(world)
    for _ in range(40):  # contacts blow rounding up, at 120 steps to 1e-8
        world.step()
        twin.step()
    assert world.spares.free == free
    assert world.live_data.ncon == twin.data.ncon > 10
    for mine, theirs in zip(world.bodies, twin.bodies, strict=True):
        np.testing.assert_allclose(mine.pose[0], theirs.pose[0], atol=1e-11)
        np.testing.assert_allclose(mine.pose[1], theirs.pose[1], atol=1e-11)
        np.testing.assert_allclose(mine.velocity[0], theirs.velocity[0], atol=1e-10)


def test_pile_law_comes_with_the_body_that_makes_a_pile():
    world = World(profile=BULLET)
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
    _assert_same_model(live, world.model)


def test_meshes_are_shared_and_released():
    world = World()
    mesh = _mesh()
    bodies = _grow(world, 12, lambda k, place: world.add_mesh(mesh, place, scale=1.0))
    assert world.spares.free
    live = world.live_model
    _assert_same_model(live, world.model)
    for body in bodies:
        world.remove(body)
    assert world.model.nmesh == 0
    assert world.assets._meshes == {}


def test_shapes_that_fit_no_spare_compile_as_ever():
    world = World()
    _grow(world, 9)
    assert world.spares.free
    ball = world.add_mesh(_mesh(), (3, 3, 3))
    world.step()
    assert world.live_model.nmesh == 2  # hull for contact, triangles to look at
    assert ball.pose[0][2] == pytest.approx(3, abs=0.01)
    _assert_same_model(world.live_model, world.model)


def test_spares_are_invisible():
    world = World()
    world.add_plane()
    _grow(world, 10)
    assert world.spares.free
    # all spares wait where the body before them was made
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
    assert world.spares.free
    names = [b.name for b in world.spec.bodies]
    assert not world.spares.free and not any("spare" in name for name in names)
    assert world.model.nv == 60 == len(world.data.qvel)


def test_state_fits_a_world_without_spares():
    world = World()
    _grow(world, 8)
    assert world.spares.free
    saved = world.save_state()
    assert not world.spares.free
    before = [body.pose[0] for body in world.bodies]
    world.step(30)
    world.restore_state(saved)
    for body, place in zip(world.bodies, before, strict=True):
        np.testing.assert_array_equal(body.pose[0], place)


def test_removed_body_leaves_a_spare():
    world = World()
    world.add_plane()
    _grow(world, 8)
    model = world.live_model
    body = world.bodies[-1]
    body.set_velocity((1, 2, 3), (4, 5, 6))
    body.links[0].set_damping(linear=0.3)
    body.links[0].glide(0.0)
    body.links[0].apply_wrench((100.0, 0, 0))
    free = world.spares.free
    world.remove(body)
    assert world.spares.free == free + 1 and world.live_model is model
    world.step()
    again = world.add_sphere(0.1, (1, 1, 1), name=body.name)
    assert world.live_model is model
    world.step()
    speed = world.gravity * world.timestep
    np.testing.assert_allclose(again.velocity[0], speed, atol=1e-12)
    np.testing.assert_array_equal(again.velocity[1], 0)
    assert again.links[0].friction == 1.0 and again.name == body.name
    _assert_same_model(world.live_model, world.model)


def test_adding_and_removing_in_turn_compiles_no_more():
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


def test_body_changed_before_its_compile_is_no_mould_for_others():
    from roboyard.urdf.model import Inertial, Pose

    inertial = Inertial(mass=2.0, origin=Pose(position=(0.05, 0, 0)), inertia=(0.1, 0, 0, 0.1, 0, 0.1))
    world = World()
    for k in range(3):
        body = world.add_box((0.2, 0.2, 0.2), (k, 0, 1))
        body.links[0].set_inertial(inertial)
        world.step()
    assert world.spares.free
    world.remove(body)
    for k in range(2, 5):
        world.add_box((0.2, 0.2, 0.2), (k, 0, 1))
        world.step()
    np.testing.assert_array_equal(world.model.body_mass[1:], [2, 2, 1, 1, 1])
    np.testing.assert_array_equal(world.model.body_simple[1:], [0, 0, 1, 1, 1])


def test_removal_in_the_middle_keeps_everybody_else():
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
    assert world.spares.free
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


def test_nonsense_is_refused_as_ever():
    world = World()
    _grow(world, 5)
    assert world.spares.free
    world.add_box((0.1, 0.1, 0.1), (np.nan, 0, 0))
    with pytest.raises(ModelError):
        world.step()


def test_idle_spares_go():
    world = World()
    _grow(world, 8)
    assert world.spares.free
    world.step(IDLE_STEPS + 1)
    world.step()
    assert world.spares.free == 0
    assert world.live_model.nbody == 9


def test_looking_at_arrays_discourages():
    world = World()
    for k in range(STREAK + 1):
        world.add_box((0.1, 0.1, 0.1), (k, 0, 1))
        world.step()
    assert world.spares.free
    assert world.model.nbody == STREAK + 2
    _grow(world, STREAK)
    assert not world.spares.free
    _grow(world, STREAK + 1)
    assert world.spares.free


def test_robots_between_boxes_get_no_spares():
    world = World()
    for k in range(6):
        world.add_box((0.1, 0.1, 0.1), (k, 0, 1))
        world.add_mjcf(
            f'<mujoco><worldbody><body name="r{k}"><joint/><geom size=".1"/></body></worldbody></mujoco>'
        )
        world.step()
        assert not world.spares.free


def _compiles(world: World, count: int, add) -> int:
    """How many models a world had while `count` times something was added and it stepped."""
    models = []
    for k in range(count):
        add(k)
        world.step()
        models.append(world.live_model)
    return len({id(model) for model in models})


def test_moulds_are_compiled_once_for_bodies_of_one_shape(monkeypatch):
    from roboyard.sim import mould_store

    made = []
    compiled = mould_store.make_mould
    monkeypatch.setattr(mould_store, "_FAMILIES", {})
    monkeypatch.setattr(mould_store, "make_mould", lambda *given: made.append(given) or compiled(*given))
    world = World()
    rng = np.random.default_rng(5)
    for k in range(30):
        size, turn = rng.uniform(0.1, 0.3, 3), rng.normal(size=4)
        world.add_box(size, (k, 0, 1), turn, mass=1.0 + k, rgba=(*rng.uniform(size=3), 1.0))
        world.step()
    assert len(made) == 1
    _assert_same_model(world.live_model, world.model)


@pytest.mark.parametrize("visual", [True, False])
def test_fixed_bodies_are_added_without_compiling_too(visual):
    world = World(visual_geoms=visual)
    ball = world.add_sphere(0.1, (0, 0, 5))
    rng = np.random.default_rng(6)

    def add(k):
        world.add_box(rng.uniform(0.1, 0.3, 3), (k % 6, k // 6, 0.5), rng.normal(size=4), mass=0.0)

    assert _compiles(world, 40, add) < 8
    model = world.live_model
    assert world.spares.free and model.nv == 6  # what is fixed has no degree of freedom, parked or not
    world.add_box((2, 2, 0.2), (10, 0, 0), mass=0.0)
    ball.set_pose((10, 0, 0.3))
    world.step(100)
    assert world.live_model is model and world.contacts(ball)
    assert ball.pose[0][2] == pytest.approx(0.2, abs=1e-3)
    _assert_same_model(model, world.model)


def test_makes_that_alternate_share_the_spares_in_the_order_of_ids():
    world = World()
    world.add_plane()
    rng = np.random.default_rng(7)
    mesh = _mesh()

    def add(k):
        place = (0.5 * (k % 7), 0.5 * (k // 7), 0.4)
        match int(rng.integers(4)):
            case 0:
                world.add_sphere(rng.uniform(0.05, 0.2), place, mass=rng.uniform(1, 2))
            case 1:
                world.add_box(rng.uniform(0.1, 0.3, 3), place, mass=0.0)
            case 2:
                world.add_mesh(mesh, place)
            case _:
                world.add_cylinder(0.1, rng.uniform(0.1, 0.2), place)

    assert _compiles(world, 60, add) < 25
    rows = [int(body.mujoco_ids[0]) for body in world.bodies]
    assert rows == sorted(rows)
    assert world.spares.parked > 0
    twin = _twin(world)
    for _ in range(30):
        world.step()
        twin.step()
    assert world.live_data.ncon == twin.data.ncon > 10
    for mine, theirs in zip(world.bodies, twin.bodies, strict=True):
        np.testing.assert_allclose(mine.pose[0], theirs.pose[0], atol=1e-10)


def test_bodies_that_come_and_go_compile_rarely():
    world = World()
    world.add_plane()
    rng, bodies = np.random.default_rng(8), []

    def add(k):
        place = (0.5 * (k % 7), 0.5 * (k // 7 % 7), 0.3)
        bodies.append(world.add_box(rng.uniform(0.1, 0.3, 3), place, mass=1.0 + k))
        if len(bodies) > 12:
            world.remove(bodies.pop(0))

    assert _compiles(world, 100, add) < 20
    assert len(world.bodies) == 13
    assert (world.contact_arrays().owners >= 0).all()
    twin = _twin(world)
    for _ in range(30):
        world.step()
        twin.step()
    for mine, theirs in zip(world.bodies, twin.bodies, strict=True):
        np.testing.assert_allclose(mine.pose[0], theirs.pose[0], atol=1e-10)
    real = world.model
    assert real.nbody == 14 and not world.spares.parked
    assert [name for name in (real.body(k).name for k in range(14)) if "gone" in name] == []


def test_removed_body_is_away_before_the_next_compile():
    world = World()
    world.add_plane()
    low, high = world.add_box((1, 1, 0.5), (0, 0, 0.25), mass=0.0), world.add_sphere(0.1, (0, 0, 0.6))
    others = [world.add_sphere(0.1, (2, k, 0.1)) for k in range(3)]
    world.step(20)
    model = world.live_model
    world.remove(low)
    world.remove(others[0])
    assert world.live_model is model and world.spares.parked == 2
    assert world.ray((2, 0, 1), (2, 0, -1)).link.body.name == "plane"  # type: ignore[union-attr]
    again = world.add_sphere(0.1, (2, 0, 0.1), name=others[0].name)
    world.step(200)
    assert high.pose[0][2] == pytest.approx(0.1, abs=1e-3)
    assert again.pose[0][2] == pytest.approx(0.1, abs=1e-3)
    assert world.model.nbody == 6 and world.model.body_mass.sum() == pytest.approx(4.0)


def test_what_holds_on_to_a_removed_body_goes_with_it():
    world = World()
    a, b = world.add_box((0.1, 0.1, 0.1), (0, 0, 1)), world.add_box((0.1, 0.1, 0.1), (0.2, 0, 1))
    world.constraints.add_weld(a.links[0], b.links[0])
    world.step()
    world.remove(a)
    world.step()
    np.testing.assert_allclose(b.velocity[1], 0, atol=1e-9)
    assert world.model.nbody == 2 and world.model.neq == 0


def test_mesh_that_only_removed_bodies_used_goes_with_the_next_compile():
    world = World()
    body = world.add_mesh(_mesh(), (0, 0, 1))
    world.step()
    world.remove(body)
    assert world.spares.parked == 1
    assert world.model.nmesh == 0 and world.model.nbody == 1


def test_moulds_do_not_mistake_a_description_for_one_that_is_gone():
    from roboyard.sim.mould_store import MouldStore
    from roboyard.sim.records import BuildOptions
    from roboyard.urdf.model import Collision, Inertial, Link, Mesh, RobotDescription

    store, mesh = MouldStore(), Mesh(uri="", path=None, data=_mesh())
    for k in range(300):  # each may lie where the one before it lay in memory
        inertial = Inertial(mass=1.0 + k % 7, inertia=(1.0, 0.0, 0.0, 1.0, 0.0, 1.0))
        link = Link(name="base", inertial=inertial, collisions=(Collision(geometry=mesh),))
        found = store.find(RobotDescription(name="m", links=(link,)), BuildOptions(fixed_base=False))
        assert found is not None and found.blocks["body_mass"][0] == 1.0 + k % 7
