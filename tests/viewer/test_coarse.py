"""Coarse meshes: few triangles near the surface, and full ones for pages that can draw them."""

from __future__ import annotations

import json
import struct
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from roboyard import World
from roboyard.rendering.scene import RenderShape
from roboyard.rendering.smoothing import is_closed
from roboyard.shapes import primitives
from roboyard.shapes.mesh import TriangleMesh
from roboyard.viewer.scene.coarse import CoarseMeshes

pytest.importorskip("viser")
from roboyard.viewer import Viewer


def shape(mesh: TriangleMesh, **fields: Any) -> RenderShape:
    return RenderShape(mesh=mesh, position=np.zeros(3), rotation=np.eye(3), frame=0, owner=(0, 0), **fields)


def test_dense_meshes_share_the_triangles_and_stay_near_the_surface() -> None:
    dense = [shape(primitives.sphere(1.0, 200)) for _ in range(3)]
    small = shape(primitives.box())
    coarse = CoarseMeshes(budget=80_000)
    coarse.prepare([*dense, small])
    faces = [len(coarse.of(one).mesh.faces) for one in dense]
    assert sum(len(one.mesh.faces) for one in dense) > 110_000
    assert sum(faces) <= 80_000
    assert coarse.of(small) is small
    radii = np.linalg.norm(coarse.of(dense[0]).mesh.vertices, axis=1)
    assert radii.min() > 0.94  # cells are at most 1 / 60 of the body, 3.3 cm
    assert radii.max() < 1.001


def test_meshes_within_the_budget_keep_their_triangles() -> None:
    one = shape(primitives.sphere(1.0, 40))
    coarse = CoarseMeshes()
    coarse.prepare([one])
    assert coarse.of(one) is one


def test_closed_surfaces_differ_from_open_and_inverted_ones() -> None:
    import trimesh

    ball = trimesh.creation.icosphere()
    assert is_closed(ball.vertices, ball.faces)
    assert not is_closed(ball.vertices, ball.faces[1:])
    assert not is_closed(ball.vertices, ball.faces[:, ::-1])
    assert not is_closed(ball.vertices, ball.faces[:0])


def triangles(data: bytes) -> int:
    (length,) = struct.unpack_from("<I", data, 12)
    document = json.loads(data[20 : 20 + length])
    return sum(document["accessors"][p["indices"]]["count"] // 3 for p in document["meshes"][0]["primitives"])


def test_a_page_that_draws_well_receives_full_meshes_after_the_coarse_ones(
    browser: Callable[..., Any], wait: Callable[..., None], tmp_path: Any
) -> None:
    import trimesh

    trimesh.creation.icosphere(subdivisions=6).export(tmp_path / "ball.stl")
    (tmp_path / "ball.urdf").write_text(
        '<robot name="ball"><link name="ball"><visual><geometry><mesh filename="ball.stl"/></geometry>'
        "</visual></link></robot>"
    )
    world = World()
    world.add_urdf(tmp_path / "ball.urdf", fixed_base=True)
    with Viewer(world, port=0, quiet=True) as viewer:
        page = browser(viewer)
        sent = page.listen(lambda m: m["type"] == "GlbMessage")
        assert 1000 < triangles(sent["props"]["glb_data"]) < 40_000
        viewer.bar.on_quality(1, "low")
        viewer.bar.on_quality(2, "normal")
        full = page.listen(lambda m: m["type"] == "GlbMessage")
        assert triangles(full["props"]["glb_data"]) == 81_920
        gone = page.listen(lambda m: m["type"] == "RemoveSceneNodeMessage")  # a second later
        assert gone["name"] == sent["name"] != full["name"]


def test_the_size_of_a_body_sets_its_cells() -> None:
    ball = primitives.sphere(1.0, 200)
    large, small = shape(ball, scale=(1.0, 1.0, 1.0)), shape(ball, scale=(0.1, 0.1, 0.1))
    coarse = CoarseMeshes(budget=1)
    coarse.prepare([large, replace(small, owner=(1, 0))])
    counts = [len(coarse.of(one).mesh.faces) for one in (large, replace(small, owner=(1, 0)))]
    assert counts[0] == pytest.approx(counts[1], rel=0.1)
