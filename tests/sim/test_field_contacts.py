"""Points on height fields are those of least squares; MuJoCo leaves room for them where shapes are near."""

from __future__ import annotations

import copy

import mujoco
import numpy as np
import pytest
from scipy.optimize import nnls
from scipy.spatial.transform import Rotation

from roboyard.sim.stepping.narrow_phase import field_contacts
from roboyard.sim.stepping.narrow_phase.closest_points import BEYOND, BOX, FIRST, FOUND, SECOND, SPHERE
from roboyard.sim.stepping.narrow_phase.field_kernels import (
    AXES,
    WORK,
    is_beyond,
    on_triangle,
    radius_around,
)

SIGNS = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float)
NO_HULLS, NO_SPANS = np.zeros((0, 3)), np.zeros((2, 2), np.int32)


def _nearest(one: np.ndarray, two: np.ndarray) -> float:
    """The distance of two hulls, by least squares over the shares of their corners, which sum up to 1."""
    n, m = len(one), len(two)
    sums = 1e4 * np.array([[1] * n + [0] * m, [0] * n + [1] * m])
    shares, _ = nnls(np.vstack([np.c_[one.T, -two.T], sums]), [0, 0, 0, 1e4, 1e4])
    return float(np.linalg.norm(shares[:n] @ one - shares[n:] @ two))


def _work(place: np.ndarray, axes: np.ndarray, half: np.ndarray, triangle: np.ndarray) -> np.ndarray:
    """A box's core and box, and a triangle."""
    work = np.zeros(WORK)
    work[FIRST : FIRST + 15] = np.concatenate([place, axes.ravel(), half])
    work[SECOND + 3 : SECOND + 12] = triangle.ravel()
    work[AXES : AXES + 12] = np.concatenate([place, (axes * half).T.ravel()])
    return work


@pytest.mark.parametrize("kind", [SPHERE, BOX])
def test_a_shape_and_a_triangle_have_the_distance_of_least_squares(kind: int) -> None:
    rng = np.random.default_rng(kind)
    near = beyond = 0
    for _ in range(300):
        place, triangle = 0.3 * rng.normal(size=3), 0.2 * rng.normal(size=(3, 3))
        axes = Rotation.from_quat(rng.normal(size=4)).as_matrix()
        half = np.zeros(3) if kind == SPHERE else rng.uniform(0.02, 0.1, 3)
        reach = float(rng.uniform(0.05, 0.5))
        work = _work(place, axes, half, triangle)
        wanted = _nearest(place + (SIGNS * half) @ axes.T, triangle)
        if wanted < 1e-6:
            continue
        radius = radius_around(kind, 0, NO_HULLS, NO_SPANS, work)
        assert radius == pytest.approx(np.linalg.norm(half), abs=1e-12)
        if is_beyond(work, radius, reach):
            assert wanted > reach
            beyond += 1
        apart, is_known = on_triangle(kind, 0, 1, NO_HULLS, NO_SPANS, reach, work)
        if wanted > reach:
            assert not is_known or apart > reach
            continue
        near += 1
        assert is_known and apart < BEYOND
        assert apart == pytest.approx(wanted, abs=1e-6)
        way = work[FOUND : FOUND + 3] - work[FOUND + 3 : FOUND + 6]
        assert np.linalg.norm(way) == pytest.approx(apart, abs=1e-9)
        np.testing.assert_allclose(np.cross(way, work[FOUND + 6 : FOUND + 9]), 0.0, atol=1e-9)
    assert near > 50 and beyond > 50


FIELD = """<mujoco><asset><hfield name="h" nrow="9" ncol="13" size="0.6 0.4 0.2 0.1"/></asset><worldbody>
    <geom name="field" type="hfield" hfield="h" pos="0.3 -0.2 0.1" euler="10 20 30"/>
    <body name="moved" pos="0 0 2"><freejoint/><geom type="{}" pos="0.02 0 0.01" euler="0 40 0"/></body>
    </worldbody></mujoco>"""
SHAPES = {"sphere": "0.06", "box": "0.05 0.08 0.03", "capsule": "0.04 0.06", "cylinder": "0.05 0.07"}


@pytest.mark.skipif(not field_contacts.is_installed(), reason="MuJoCo's table is elsewhere")
@pytest.mark.parametrize("shape", SHAPES)
def test_there_is_room_for_points_wherever_mujoco_finds_one(shape: str) -> None:
    model = mujoco.MjModel.from_xml_string(FIELD.format(f'{shape}" size="{SHAPES[shape]}'))
    rng = np.random.default_rng(3)
    model.hfield_data[:] = rng.uniform(0, 1, len(model.hfield_data))
    marked = copy.copy(model)
    marked.opt.disableflags |= field_contacts.MARK
    data, other = mujoco.MjData(model), mujoco.MjData(marked)
    turn = Rotation.from_euler("XYZ", [10, 20, 30], degrees=True)
    found = rooms = 0
    for _ in range(400):
        place = rng.uniform([-0.75, -0.55, -0.3], [0.75, 0.55, 0.5])
        data.qpos[:3] = np.array([0.3, -0.2, 0.1]) + turn.apply(place)
        data.qpos[3:] = Rotation.from_quat(rng.normal(size=4)).as_quat()
        other.qpos[:] = data.qpos
        mujoco.mj_forward(model, data)
        mujoco.mj_forward(marked, other)
        assert other.ncon in (0, field_contacts.MOST)
        assert not other.nefc and (other.contact.dist == field_contacts.AWAY).all()
        inside = -0.3 < place[2] < -0.02  # in MuJoCo's solid, under all triangles
        assert other.ncon or not data.ncon or inside
        found, rooms = found + (data.ncon > 0), rooms + (other.ncon > 0)
    assert found > 20 and 20 < rooms < 300
