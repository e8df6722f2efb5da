"""Rays in compiled code meet what MuJoCo's own rays meet, number for number."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from roboyard import World
from roboyard.native import can_call
from roboyard.sim.mujoco_library import mujoco_library
from roboyard.sim.queries import rays, shape_rays

GROUPS = np.array([1, 1, 0, 1, 1, 1], dtype=np.uint8)
KINDS = ("box", "sphere", "capsule", "cylinder", "ellipsoid", "mesh")
TETRAHEDRON = "0 0 0  1 0 0  0 1 0  0 0 1"

pytestmark = pytest.mark.skipif(not can_call(mujoco_library), reason="loops call no functions of C")


def scene(rng):
    """Return model and data of shapes of all kinds and groups, some of them hidden, two in one place."""
    bodies = "".join(
        f'<body pos="{x} {y} {z}" quat="{w} {i} {j} {k}"><geom type="{KINDS[n % 6]}" group="{n % 5}" '
        + ('mesh="m"' if n % 6 == 5 else 'size=".3 .4 .2"')
        + f' rgba="1 1 1 {n % 7}"/></body>'
        for n, (x, y, z, w, i, j, k) in enumerate(rng.normal(size=(36, 7)) * [2, 2, 2, 1, 1, 1, 1])
    )
    same = '<geom type="box" size="1 1 1" pos="9 9 9"/>'
    model = mujoco.MjModel.from_xml_string(
        f'<mujoco><asset><mesh name="m" vertex="{TETRAHEDRON}"/><hfield name="h" nrow="4" ncol="4" '
        'size="2 2 1 .1"/><material name="none" rgba="1 1 1 0"/></asset><worldbody><geom type="plane" '
        'size="5 5 1" pos="0 0 -1"/><geom type="hfield" hfield="h" pos="-2 -2 -1"/><geom type="sphere" '
        f'size="3" material="none"/>{same}{same}{bodies}</worldbody></mujoco>'
    )
    model.hfield_data[:] = rng.random(16)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return model, data


def test_rays_meet_what_mujoco_rays_meet():
    rng = np.random.default_rng(3)
    model, data = scene(rng)
    starts, ways = rng.normal(size=(3000, 3)) * 3, rng.normal(size=(3000, 3))
    starts[:100], ways[:100] = [9.3, 9.2, 20.0], [0, 0, -1]
    ways /= np.linalg.norm(ways, axis=1)[:, None]
    geoms, distances, normals = np.zeros(3000, dtype=np.int32), np.zeros(3000), np.zeros((3000, 3))
    lengths, work = rng.uniform(0.1, 12.0, 3000), np.zeros(shape_rays.WORK)
    records = shape_rays.ray_records(model, data, GROUPS, has_backs=False)
    assert records is not None
    shapes = shape_rays.SHAPES.of(records)
    shape_rays.cast_rays(shapes, starts, ways, lengths, work, geoms, distances, normals)
    geom, normal, hits, far = np.zeros(1, dtype=np.int32), np.zeros(3), 0, 0
    for i in range(3000):
        wanted = mujoco.mj_ray(model, data, starts[i], ways[i], GROUPS, True, -1, geom, normal)
        if 0.0 <= wanted <= lengths[i]:
            hits += 1
            assert (geoms[i], distances[i], *normals[i]) == (geom[0], wanted, *normal)
            one = shape_rays.cast_ray(shapes, *starts[i], *ways[i], lengths[i], work)
            assert (one, *work[9:]) == (geom[0], *normal, wanted)
        else:
            far += 1
            assert geoms[i] == -1 or distances[i] > lengths[i]
    assert hits > 300 < far


def test_shapes_of_the_same_arrays_differ_in_rows_alone():
    model, data = scene(np.random.default_rng(4))
    before = shape_rays.ray_records(model, data, GROUPS, has_backs=False)
    assert before is not None
    for group in (0, 2, 9, -3):
        model.geom_group[::2] = group
        found = shape_rays.ray_records(model, data, GROUPS, has_backs=False, before=before)
        fresh = shape_rays.ray_records(model, data, GROUPS, has_backs=False)
        assert found is not None
        assert fresh is not None
        assert found.rows.dtype == fresh.rows.dtype == np.int32
        assert found.rows.tolist() == fresh.rows.tolist()
        assert found[1:] == before[1:]
        assert all(np.shares_memory(a, b) for a, b in zip(found[1:9], fresh[1:9], strict=True) if a.size)
    turned = shape_rays.ray_records(model, data, GROUPS, has_backs=True, before=before)
    assert turned is not None
    assert turned.has_backs == 1


def test_without_machine_code_rays_are_mujoco_own(monkeypatch):
    world = World()
    world.add_plane()
    world.add_box((1, 1, 1), position=(0, 0, 1))
    starts, ends = [(0.1, 0.2, 5), (0.3, 0.1, 4), (3, 0, 4)], [(0, 0, -5), (0, 0.1, -5), (3, 0, 1)]
    wanted = world.rays(starts, ends)
    monkeypatch.setattr(shape_rays, "ray_records", lambda *given, **named: None)
    world.kept_rays.clear()
    found = world.rays(starts, ends)
    same = world.rays(starts[:1] * 2, ends[:2])
    for name in ("owners", "fraction", "position", "normal", "geoms"):
        assert np.array_equal(getattr(wanted, name), getattr(found, name))
    assert same.geoms.tolist() == [wanted.geoms[0]] * 2


def test_surfaces_of_one_shape_are_found_one_after_the_other():
    world = World()
    world.add_plane()
    world.add_box((1, 1, 1), position=(0, 0, 1))
    world.add_sphere(0.2, position=(3, 0, 1))
    start, way = (0.1, 0.2, 5.0), (0.0, 0.0, -10.0)
    met = rays.shapes_on_ray(world, start, way)
    assert len(met) == 2
    assert rays.shapes_on_ray(world, start, (0.0, 0.0, 0.0)) == []
    found = sorted(surface for geom in met for surface in rays.surfaces_on_ray(world, geom, start, way, 1e-5))
    fractions = sorted(fraction for _, fraction, _ in found)
    assert np.allclose(fractions, [0.35, 0.45, 0.5], atol=1e-12)
    assert sorted(normal[2] for _, _, normal in found) == [-1.0, 1.0, 1.0]
