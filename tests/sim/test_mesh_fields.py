"""Concave meshes that are searched: the order of their triangles, and which of them are near a box."""

from __future__ import annotations

from collections.abc import Iterable
from functools import reduce
from operator import add

import mujoco
import numpy as np
import pytest

from roboyard.shapes.mesh import TriangleMesh, read_only
from roboyard.sim.build.mesh_fields import BASE, add_field_asset, mesh_field
from roboyard.sim.build.triangle_order import triangle_order
from roboyard.sim.build.triangle_windows import TriangleWindow
from roboyard.sim.stepping.narrow_phase import field_contacts
from roboyard.sim.stepping.narrow_phase.closest_points import SECOND
from roboyard.sim.stepping.narrow_phase.field_kernels import BOUNDS, WORK
from roboyard.sim.stepping.narrow_phase.field_triangles import (
    after,
    end_of_leaf,
    first_triangle,
    next_leaf,
    write_triangle,
)
from roboyard.sim.stepping.narrow_phase.fields import fields_of


def _soup(count: int, seed: int) -> TriangleMesh:
    rng = np.random.default_rng(seed)
    middles = rng.uniform(-2.0, 2.0, (count, 1, 3))
    corners = middles + 0.2 * rng.normal(size=(count, 3, 3))
    faces = np.arange(3 * count, dtype=np.int32).reshape(-1, 3)
    return TriangleMesh(
        vertices=read_only(corners.reshape(-1, 3), np.float64), faces=read_only(faces, np.int32)
    )


def _grid(count: int) -> np.ndarray:
    """(2 count², 3, 3) triangles of a level square, many of which have the same place along an axis."""
    at = np.linspace(0.0, 1.0, count + 1)
    cells = [(at[i], at[j], at[i + 1], at[j + 1]) for j in range(count) for i in range(count)]
    return np.array(
        [
            triangle
            for x, y, u, v in cells
            for triangle in ([(x, y, 0), (u, y, 0), (u, v, 0)], [(x, y, 0), (u, v, 0), (x, v, 0)])
        ]
    )


def _total(numbers: Iterable[float]) -> float:
    """The sum of numbers one after another; that of later Pythons is more accurate."""
    return reduce(add, numbers, 0.0)


def _split(corners: np.ndarray) -> list[int]:
    """The order of `triangle_order` by recursion, one triangle after another."""
    low, high = corners.min(axis=1), corners.max(axis=1)
    thin = high - low < 0.002
    low, high = np.where(thin, low - 0.001, low), np.where(thin, high + 0.001, high)
    least = corners.min(axis=(0, 1)) - 2.0  # Bullet enlarges the box by 1 m, once more after rounding
    first = 65533 / (corners.max(axis=(0, 1)) + 1.0 - least)
    most = 65535 / first + least + 1.0
    scale = 65533 / (most - least)
    whole = np.floor((low - least) * scale).astype(int) // 2 * 2
    odd = np.floor((high - least) * scale + 1).astype(int) // 2 * 2 + 1
    middles = (0.5 * ((odd / scale + least) + (whole / scale + least))).tolist()

    def split(chosen: list[int]) -> list[int]:
        count = len(chosen)
        if count < 2:
            return chosen
        means = [_total(middles[t][axis] for t in chosen) * (1.0 / count) for axis in range(3)]
        spreads = [_total((middles[t][axis] - means[axis]) ** 2 for t in chosen) for axis in range(3)]
        axis = 2 if spreads[2] > max(spreads[0], spreads[1]) else int(spreads[1] > spreads[0])
        place = 0
        for k in range(count):
            if middles[chosen[k]][axis] > means[axis]:
                chosen[k], chosen[place] = chosen[place], chosen[k]
                place += 1
        if place <= count // 3 or place >= count - 1 - count // 3:
            place = count // 2
        return split(chosen[:place]) + split(chosen[place:])

    return split(list(range(len(corners))))


@pytest.mark.parametrize("corners", [_grid(9), np.reshape(_soup(200, 4).vertices, (-1, 3, 3)), _grid(1)])
def test_triangles_are_in_the_order_in_which_their_boxes_are_split(corners: np.ndarray) -> None:
    order = triangle_order(corners).tolist()
    assert sorted(order) == list(range(len(corners)))
    assert order == _split(corners)


def test_the_first_half_is_beyond_the_mean_along_the_axis_of_most_variance() -> None:
    """A strip along y: the triangles of larger y are before those of smaller y."""
    corners = np.array([[(0, y, 0), (0.1, y, 0), (0, y + 0.5, 0)] for y in range(4)], float)
    assert triangle_order(corners).tolist() == [3, 2, 1, 0]


@pytest.mark.parametrize("count", [1, 4, 5, 300])
def test_leaves_that_meet_a_box_have_the_triangles_that_numpy_finds(count: int) -> None:
    mesh = _soup(count, count)
    window = TriangleWindow(mesh=mesh, origin=None, is_file=False)  # type: ignore[arg-type]
    spec = mujoco.MjSpec()
    for name in ("other", "mesh"):
        add_field_asset(spec, name, mesh_field(mesh, single=False))
    turn = (0.5, 0.5, -0.5, 0.5)
    place = (0.1, -0.2, 0.3)
    spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_HFIELD, hfieldname="other")
    window.whole = spec.worldbody.add_geom(
        type=mujoco.mjtGeom.mjGEOM_HFIELD, hfieldname="mesh", pos=place, quat=turn
    )
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    fields = fields_of(model, data, [window])
    assert fields.meshes.tolist() == [-1, 0]
    field = mesh_field(mesh, single=False)
    corners = field.corners.reshape(-1, 3, 3)
    rotation = data.geom_xmat[window.whole.id].reshape(3, 3)
    rng, work, seen = np.random.default_rng(1), np.zeros(WORK), 0
    for _ in range(100):
        middle, half = rng.uniform(-2.5, 2.5, 3), rng.uniform(0.05, 1.6, 3)
        work[BOUNDS : BOUNDS + 6] = np.concatenate([middle - half, middle + half])
        near = (corners.min(axis=1) <= middle + half) & (corners.max(axis=1) >= middle - half)
        found, node = [], next_leaf(fields, 0, 0, work)
        while node >= 0:
            for triangle in range(first_triangle(fields, 0, node), end_of_leaf(fields, 0, node)):
                if write_triangle(fields, window.whole.id, triangle, work):
                    found.append(triangle)
                    world = corners[triangle] @ rotation.T + data.geom_xpos[window.whole.id]
                    np.testing.assert_allclose(work[SECOND + 3 : SECOND + 12], world.ravel(), atol=1e-12)
            node = next_leaf(fields, 0, after(node), work)
        assert found == np.flatnonzero(near.all(axis=1)).tolist()
        seen += len(found)
    assert seen > count


def test_all_nodes_of_a_tree_come_after_their_parents_and_first_children() -> None:
    """15 nodes, of which 8 are leaves, from the first to the second child of each."""
    order, node = [0], 0
    while node >= 0:
        node = 2 * node + 1 if node < 7 else after(node)
        order += [node] if node >= 0 else []
    assert order == [0, 1, 3, 7, 8, 4, 9, 10, 2, 5, 11, 12, 6, 13, 14]


@pytest.mark.skipif(not field_contacts.is_installed(), reason="MuJoCo's table is elsewhere")
@pytest.mark.parametrize("shape", ["sphere", "box", "capsule", "cylinder", "ellipsoid"])
def test_mujoco_finds_nothing_on_a_field_that_stands_for_a_mesh(shape: str) -> None:
    """It only leaves room, where points of known shapes are found later."""
    spec = mujoco.MjSpec()
    add_field_asset(spec, "mesh", mesh_field(_soup(50, 2), single=False))
    spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_HFIELD, hfieldname="mesh")
    body = spec.worldbody.add_body(pos=(0.1, 0.2, 1.0))
    body.add_freejoint()
    body.add_geom(type=getattr(mujoco.mjtGeom, f"mjGEOM_{shape.upper()}"), size=(0.2, 0.3, 0.4))
    model = spec.compile()
    assert model.hfield_size[0, 3] == BASE
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    assert data.ncon == 0
    if shape != "ellipsoid":
        model.opt.disableflags |= field_contacts.MARK
        mujoco.mj_forward(model, data)
        assert data.ncon == field_contacts.MOST and (data.contact.dist == field_contacts.AWAY).all()
        data.qpos[2] = 40.0
        mujoco.mj_forward(model, data)
        assert data.ncon == 0
