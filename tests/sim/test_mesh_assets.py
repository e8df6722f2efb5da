"""Meshes of specs: what MuJoCo computed of one is used again, and bounded."""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np
import pytest

from roboyard.shapes.mesh import TriangleMesh
from roboyard.sim import World
from roboyard.sim.build import mesh_assets
from roboyard.sim.build.mesh_assets import MeshAssets, forget_meshes
from roboyard.transforms import Array


def _ball(points: int, seed: int) -> TriangleMesh:
    from scipy.spatial import ConvexHull

    vertices = np.random.default_rng(seed).normal(size=(points, 3))
    vertices /= np.linalg.norm(vertices, axis=1)[:, None]
    return TriangleMesh(vertices=vertices, faces=ConvexHull(vertices).simplices)


def _spec(*, hull: bool, vertices: Array, faces: np.ndarray) -> Any:
    spec = mujoco.MjSpec()
    name = MeshAssets(spec).add(TriangleMesh(vertices=vertices, faces=faces), hull=hull)
    body = spec.worldbody.add_body(name="body")
    collides = int(hull)
    body.add_geom(
        type=mujoco.mjtGeom.mjGEOM_MESH, meshname=name, contype=collides, conaffinity=collides, mass=1.0
    )
    return spec


@pytest.mark.parametrize("hull", [False, True])
def test_a_mesh_of_a_file_in_memory_is_that_of_its_numbers(hull: bool) -> None:
    """The first compile, one that uses what was computed, and one of plain numbers give the same arrays."""
    ball = _ball(80, seed=int(hull))
    mujoco.mj_clearCache(mujoco.mj_getCache())
    spec = _spec(hull=hull, vertices=ball.vertices, faces=ball.faces)
    models = [spec.compile(), spec.compile()]
    vertices, faces = models[0].mesh_vert, models[0].mesh_face
    assert len(vertices) == 80 and len(faces) == len(ball.faces)

    plain = _spec(hull=hull, vertices=ball.vertices, faces=ball.faces)
    mesh = plain.meshes[0]
    stored = np.frombuffer(plain.assets.pop(mesh.file), "<f4", 240, 16)
    numbers = np.frombuffer(spec.assets[mesh.file], "<i4", 3 * len(faces), 16 + 960)
    mesh.file, mesh.uservert, mesh.userface = "", stored.tolist(), numbers.tolist()
    expected = plain.compile()
    for model in models:
        for name in dir(expected):
            value = getattr(expected, name)
            if isinstance(value, np.ndarray) and name not in ("mesh_pathadr", "_sizes"):
                np.testing.assert_array_equal(getattr(model, name), value, err_msg=name)


def test_what_mujoco_keeps_of_meshes_is_bounded(monkeypatch: pytest.MonkeyPatch) -> None:
    cache = mujoco.mj_getCache()
    mujoco.mj_clearCache(cache)
    monkeypatch.setattr(mesh_assets, "MOST_KEPT", 100_000)
    for seed in range(5):
        world = World()
        world.add_mesh(_ball(60, seed), position=(0, 0, 1))
        world.step()
        assert 0 < mujoco.mj_getCacheSize(cache) < 200_000
    monkeypatch.setattr(mesh_assets, "MOST_KEPT", 0)
    forget_meshes()
    assert mujoco.mj_getCacheSize(cache) == 0


def test_a_removed_mesh_leaves_its_file_with_its_last_user() -> None:
    spec = mujoco.MjSpec()
    assets = MeshAssets(spec)
    name = assets.add(_ball(20, 0), hull=True)
    assets.retain(name)
    assets.release(name)
    assert len(spec.assets) == 1
    assets.release(name)
    assert not spec.assets and not spec.meshes
