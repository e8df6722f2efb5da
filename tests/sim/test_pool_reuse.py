"""Adding and removing bodies between steps needs few compiles."""

from __future__ import annotations

import numpy as np
import pytest
from pool_worlds import assert_same_model, mesh, twin_of

from roboyard.description.model import Inertial
from roboyard.sim import World


def _compiles(world: World, count: int, add) -> int:
    """How many models a world had while `count` times something was added and it stepped."""
    models = []
    for k in range(count):
        add(k)
        world.step()
        models.append(world.live_model)
    return len({id(model) for model in models})


def test_templates_are_compiled_once_for_bodies_of_one_shape(monkeypatch):
    from roboyard.sim.pool import template_cache

    made = []
    compiled = template_cache.make_template
    monkeypatch.setattr(template_cache, "_FAMILIES", {})
    monkeypatch.setattr(
        template_cache, "make_template", lambda *given: made.append(given) or compiled(*given)
    )
    world = World()
    rng = np.random.default_rng(5)
    for k in range(30):
        size, turn = rng.uniform(0.1, 0.3, 3), rng.normal(size=4)
        world.add_box(size, (k, 0, 1), turn, mass=1.0 + k, rgba=(*rng.uniform(size=3), 1.0))
        world.step()
    assert len(made) == 1
    assert_same_model(world.live_model, world.model)


@pytest.mark.parametrize("visual", [True, False])
def test_fixed_bodies_are_added_without_compiling(visual):
    world = World(visual_geoms=visual)
    ball = world.add_sphere(0.1, (0, 0, 5))
    rng = np.random.default_rng(6)

    def add(k):
        world.add_box(rng.uniform(0.1, 0.3, 3), (k % 6, k // 6, 0.5), rng.normal(size=4), mass=0.0)

    assert _compiles(world, 40, add) < 8
    model = world.live_model
    assert world.pool.free and model.nv == 6  # fixed bodies have no degrees of freedom
    world.add_box((2, 2, 0.2), (10, 0, 0), mass=0.0)
    ball.set_pose((10, 0, 0.3))
    world.step(100)
    assert world.live_model is model and world.contacts(ball)
    assert ball.pose[0][2] == pytest.approx(0.2, abs=1e-3)
    assert_same_model(model, world.model)


def test_alternating_layouts_share_pooled_bodies_in_the_order_of_ids():
    world = World()
    world.add_plane()
    rng = np.random.default_rng(7)
    shape = mesh()

    def add(k):
        place = (0.5 * (k % 7), 0.5 * (k // 7), 0.4)
        match int(rng.integers(4)):
            case 0:
                world.add_sphere(rng.uniform(0.05, 0.2), place, mass=rng.uniform(1, 2))
            case 1:
                world.add_box(rng.uniform(0.1, 0.3, 3), place, mass=0.0)
            case 2:
                world.add_mesh(shape, place)
            case _:
                world.add_cylinder(0.1, rng.uniform(0.1, 0.2), place)

    assert _compiles(world, 60, add) < 25
    rows = [int(body.mujoco_ids[0]) for body in world.bodies]
    assert rows == sorted(rows)
    assert world.pool.inactive > 0
    twin = twin_of(world)
    for _ in range(30):
        world.step()
        twin.step()
    assert world.live_data.ncon == twin.data.ncon > 10
    for mine, theirs in zip(world.bodies, twin.bodies, strict=True):
        np.testing.assert_allclose(mine.pose[0], theirs.pose[0], atol=1e-10)


def test_episodes_that_remove_what_they_added_compile_rarely():
    world = World()
    world.add_plane()
    models, bodies = [], []
    for _ in range(20):
        for body in bodies:
            world.remove(body)
        world.step()
        models.append(world.live_model)
        bodies = [
            world.add_box([0.2] * 3, (0.5 * (k % 7), 0.5 * (k // 7), 0.2 + 0.01 * k)) for k in range(30)
        ]
        for _ in range(5):
            world.step()
            models.append(world.live_model)
        heights = [body.pose[0][2] for body in bodies]
        fallen = 9.81 * world.timestep**2 * 15  # after five steps of a semi-implicit integrator
        np.testing.assert_allclose(heights, [0.2 + 0.01 * k - fallen for k in range(30)], atol=1e-9)
    assert len({id(model) for model in models}) < 8


def test_adding_and_removing_compiles_rarely():
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
    twin = twin_of(world)
    for _ in range(30):
        world.step()
        twin.step()
    for mine, theirs in zip(world.bodies, twin.bodies, strict=True):
        np.testing.assert_allclose(mine.pose[0], theirs.pose[0], atol=1e-10)
    real = world.model
    assert real.nbody == 14 and not world.pool.inactive
    assert [name for name in (real.body(k).name for k in range(14)) if "removed" in name] == []


def test_removed_body_has_no_effect_before_the_next_compile():
    world = World()
    world.add_plane()
    low, high = world.add_box((1, 1, 0.5), (0, 0, 0.25), mass=0.0), world.add_sphere(0.1, (0, 0, 0.6))
    others = [world.add_sphere(0.1, (2, k, 0.1)) for k in range(3)]
    world.step(20)
    model = world.live_model
    world.remove(low)
    world.remove(others[0])
    assert world.live_model is model and world.pool.inactive == 2
    assert world.ray((2, 0, 1), (2, 0, -1)).link.body.name == "plane"  # type: ignore[union-attr]
    again = world.add_sphere(0.1, (2, 0, 0.1), name=others[0].name)
    world.step(200)
    assert high.pose[0][2] == pytest.approx(0.1, abs=1e-3)
    assert again.pose[0][2] == pytest.approx(0.1, abs=1e-3)
    assert world.model.nbody == 6 and world.model.body_mass.sum() == pytest.approx(4.0)


def test_constraints_of_a_removed_body_are_removed():
    world = World()
    a, b = world.add_box((0.1, 0.1, 0.1), (0, 0, 1)), world.add_box((0.1, 0.1, 0.1), (0.2, 0, 1))
    world.constraints.add_weld(a.links[0], b.links[0])
    world.step()
    world.remove(a)
    world.step()
    np.testing.assert_allclose(b.velocity[1], 0, atol=1e-9)
    assert world.model.nbody == 2 and world.model.neq == 0


def test_mesh_of_removed_bodies_is_deleted_at_the_next_compile():
    world = World()
    body = world.add_mesh(mesh(), (0, 0, 1))
    world.step()
    world.remove(body)
    assert world.pool.inactive == 1
    assert world.model.nmesh == 0 and world.model.nbody == 1


def test_deleted_meshes_are_not_used():
    world, next_world, shape = World(), World(), mesh()

    def add(k):
        world.add_mesh(shape, (k, 0, 1))

    assert _compiles(world, 6, add) == 3
    for body in world.bodies:
        world.remove(body)
    assert world.model.nmesh == 0
    next_world.pool.restore_history(world.pool.history)
    for either in (world, next_world):
        for k in range(8):
            either.add_box((0.1, 0.1, 0.1), (k, 0, 1))
            either.step()
        assert len(either.bodies) == 8 and either.model.nmesh == 0


def test_templates_do_not_confuse_descriptions_with_deleted_ones():
    from roboyard.description.model import Collision, Inertial, Link, Mesh, RobotDescription
    from roboyard.sim.build.records import BuildOptions
    from roboyard.sim.pool.template_cache import TemplateCache

    cache, shape = TemplateCache(), Mesh(uri="", path=None, data=mesh())
    for k in range(300):  # each may have the memory address of the one before
        inertial = Inertial(mass=1.0 + k % 7, inertia=(1.0, 0.0, 0.0, 1.0, 0.0, 1.0))
        link = Link(name="base", inertial=inertial, collisions=(Collision(geometry=shape),))
        found = cache.find(RobotDescription(name="m", links=(link,)), BuildOptions(fixed_base=False))
        assert found is not None and found.blocks["body_mass"][0] == 1.0 + k % 7


def test_history_is_passed_on_to_the_next_world():
    def add_ten(world):
        return _compiles(world, 10, lambda k: world.add_box((0.1, 0.1, 0.1 + 0.01 * k), (k, 0, 1)))

    first, second, other = World(), World(), World()
    for world in (first, second, other):
        world.add_plane()
    assert add_ten(first) == 4  # with 1, 2, 3 + 8 and 11 + 11 bodies
    second.pool.restore_history(first.pool.history)
    assert add_ten(second) == 1
    assert_same_model(second.live_model, second.model)
    other.pool.restore_history(World().pool.history)
    assert add_ten(other) == 4


def _rows_of(body, model) -> dict[str, np.ndarray]:
    """Return all numbers of a free body of one link in MuJoCo's arrays, but for references between rows."""
    row, dof = int(body.mujoco_ids[0]), body.free_dof
    geoms = np.flatnonzero(model.geom_bodyid == row)
    of_kind = {"body": [row], "geom": geoms, "dof": range(dof, dof + 6), "jnt": [model.body_jntadr[row]]}
    found = {}
    for name in dir(type(model)):
        kind, _, rest = name.partition("_")
        if kind in of_kind and rest and not rest.endswith(("id", "adr", "num", "user")):
            found[name] = getattr(model, name)[list(of_kind[kind])].copy()
    found["qpos0"] = model.qpos0[body.free_qpos : body.free_qpos + 7].copy()
    return found


def test_bodies_that_go_before_others_come_leave_few_pooled_bodies():
    world = World()
    world.add_plane()
    for k in range(40):
        world.add_box((0.1, 0.1, 0.1), (0.3 * (k % 7), 0.3 * (k // 7), 0.05))
    models = set()
    for k in range(120):
        box = world.add_box((0.1, 0.1, 0.1 + 0.001 * k), (3, 3, 0.5), mass=1.0 + k)
        world.step()
        models.add(id(world.live_model))
        world.remove(box)
        world.step()
        models.add(id(world.live_model))
    assert len(models) <= 5 and 0 < world.pool.inactive <= 12
    box = world.add_box((0.1, 0.1, 0.1), (3, 3, 0.5), mass=2.0)
    found = _rows_of(box, world.live_model)
    twin = twin_of(world)
    compiled = _rows_of(twin.bodies[-1], twin.model)
    for name, values in found.items():
        np.testing.assert_allclose(values, compiled[name], rtol=1e-12, atol=1e-13, err_msg=name)
    for _ in range(60):
        world.step()
        twin.step()
    np.testing.assert_allclose(box.pose[0], twin.bodies[-1].pose[0], atol=1e-10)


@pytest.mark.parametrize("visual", [True, False])
def test_nothing_of_an_earlier_body_is_left_in_its_rows(visual):
    """Frictions, masses, forms and colours that were changed, in the spec and in MuJoCo's arrays."""
    world = World(visual_geoms=visual)
    world.add_plane()
    rng = np.random.default_rng(9)
    changes = (
        lambda body: body.links[0].set_friction(sliding=0.3, rolling=0.01),
        lambda body: setattr(body.links[0], "friction", 0.7),
        lambda body: body.links[0].set_frictionless(),
        lambda body: body.links[0].set_inertial(Inertial(mass=3.0, inertia=(0.1, 0, 0, 0.2, 0, 0.2))),
        lambda body: body.set_velocity([1, 2, 3], [1, 0, 0]),
        lambda body: body.set_pose([1, 2, 3]),
        lambda body: None,
    )
    for k in range(40):
        size = (0.2, 0.2, 0.2) if k % 3 else rng.uniform(0.1, 0.3, 3)
        body = world.add_box(size, (3, 3, 0.5), mass=1.0 + k % 2, rgba=(*rng.uniform(size=3), 1.0))
        changes[k % len(changes)](body)
        world.step()
        if k % 10 == 9:
            kept = world.add_box(size, (4 + k, 3, 0.5), mass=2.0)
            found = _rows_of(kept, world.live_model)
            compiled = _rows_of(kept, world.model)
            for name, values in found.items():
                np.testing.assert_allclose(values, compiled[name], rtol=1e-12, atol=1e-13, err_msg=name)
            world.remove(kept)
        world.remove(body)
        if k % 4:
            world.step()
