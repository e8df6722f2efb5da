"""Contacts of meshes over faces of boxes are those of MuJoCo's general search."""

from __future__ import annotations

import ctypes

import mujoco
import numpy as np
import pytest

from roboyard.sim.mujoco_library import mujoco_library
from roboyard.sim.stepping import face_contacts
from roboyard.sim.stepping.shape_forms import PLACED

ONE_POINT = int(mujoco.mjtDisableBit.mjDSBL_MULTICCD)
MARGIN = 0.02

pytestmark = pytest.mark.skipif(not face_contacts.touch_face.address(), reason="MuJoCo's table is elsewhere")


def _scene(rng: np.random.Generator, half: tuple[float, float, float], corners: int):
    """A box of half sizes and the hull of random points, not far away."""
    points = " ".join(f"{v:.6f}" for v in rng.normal(size=3 * corners) * 0.2)
    xml = f"""<mujoco><asset><mesh name="m" vertex="{points}"/></asset><worldbody>
        <geom type="box" size="{half[0]} {half[1]} {half[2]}" margin="{MARGIN / 2}" euler="10 20 30"/>
        <body><freejoint/><geom type="mesh" mesh="m" margin="{MARGIN / 2}"/>
            <inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/></body></worldbody></mujoco>"""
    model = mujoco.MjModel.from_xml_string(xml)
    model.opt.disableflags |= ONE_POINT
    data = mujoco.MjData(model)
    assert face_contacts.install(model, data)
    assert (
        face_contacts.places_of(model, data, face_contacts.OF_MODEL, face_contacts.OF_DATA)
        == face_contacts.PLACES
    )
    return model, data


def _place(rng: np.random.Generator, model: mujoco.MjModel, data: mujoco.MjData) -> None:
    """Put the mesh beside a random place of the box's surface, a little in it or apart from it."""
    half, axis = model.geom_size[0], rng.integers(3)
    local = rng.uniform(-1.1, 1.1, 3) * half
    local[axis] = rng.choice([-1, 1]) * half[axis]
    data.qpos[3:7] = rng.normal(size=4)
    mujoco.mj_normalizeQuat(model, data.qpos)
    data.qpos[:3] = 0.0
    mujoco.mj_kinematics(model, data)
    normal = np.sign(local[axis]) * data.geom_xmat[0].reshape(3, 3)[:, axis]
    corners = model.mesh_vert @ data.geom_xmat[1].reshape(3, 3).T + data.geom_xpos[1]
    depth = rng.uniform(-0.03, 0.03)
    over = (normal @ corners.T).min() + depth
    data.qpos[:3] = data.geom_xmat[0].reshape(3, 3) @ local - over * normal
    mujoco.mj_kinematics(model, data)


@pytest.mark.parametrize("half", [(50.0, 60.0, 5.0), (0.5, 0.4, 0.3), (0.1, 0.05, 0.02)])
@pytest.mark.parametrize("corners", [6, 40])
def test_contacts_equal_those_of_the_general_search(half, corners):
    rng = np.random.default_rng(corners)
    found = taken = 0
    for _ in range(5):
        model, data = _scene(rng, half, corners)
        for _ in range(40):
            _place(rng, model, data)
            mujoco.mj_collision(model, data)
            segment = np.zeros(6)
            distance = mujoco.mj_geomDistance(model, data, 0, 1, 1.0, segment)
            written = np.zeros(10)
            answer = face_contacts.touch_face.core(
                model._address, data._address, written.ctypes.data, 0, 1, MARGIN
            )
            found += data.ncon
            if answer < 0:
                continue
            assert answer == data.ncon == (distance < MARGIN) or abs(distance - MARGIN) < 2e-6
            if not data.ncon:
                continue
            taken += 1
            contact = data.contact[0]
            np.testing.assert_allclose(written[0], distance, atol=2e-6)
            np.testing.assert_allclose(written[0], contact.dist, atol=1e-12)
            np.testing.assert_allclose(written[1:4], contact.pos, atol=1e-12)
            np.testing.assert_allclose(written[4:7], contact.frame[:3], atol=1e-12)
            if abs(distance) > 1e-4:
                np.testing.assert_allclose(written[1:4], 0.5 * (segment[:3] + segment[3:]), atol=1e-4)
                direction = np.sign(distance) * (segment[3:] - segment[:3])
                np.testing.assert_allclose(written[4:7], direction / np.linalg.norm(direction), atol=1e-2)
    assert found > 20
    assert taken > (0.8 * found if half[0] > 1 else 0)


def test_it_declines_where_a_face_decides_nothing():
    """Two corners at the same height, corners beyond the box's edge, and several points of a pair."""
    xml = """<mujoco><asset><mesh name="m" vertex="-1 -1 0 1 -1 0 1 1 0.5 -1 1 0.5 0 0 2"/></asset><worldbody>
        <geom type="box" size="9 9 1"/><body><freejoint/><geom type="mesh" mesh="m"/>
            <inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/></body></worldbody></mujoco>"""
    model = mujoco.MjModel.from_xml_string(xml)
    model.opt.disableflags |= ONE_POINT
    data, written = mujoco.MjData(model), np.zeros(10)

    def answer(x: float, turn: float) -> int:
        data.qpos[:] = 0.0
        data.qpos[3:7] = np.cos(turn / 2), 0, np.sin(turn / 2), 0
        mujoco.mj_kinematics(model, data)
        corners = model.mesh_vert @ data.geom_xmat[1].reshape(3, 3).T + data.geom_xpos[1]
        data.qpos[0], data.qpos[2] = x, 0.99 - corners[:, 2].min()
        mujoco.mj_kinematics(model, data)
        return face_contacts.touch_face.core(model._address, data._address, written.ctypes.data, 0, 1, 0.0)

    assert answer(0.0, 0.0) == -1
    model.opt.disableflags |= PLACED
    assert answer(0.0, 0.0) == 1
    assert written[0] == pytest.approx(-0.01, abs=1e-9)
    np.testing.assert_allclose(written[1:4], [-1, -1, 0.995], atol=1e-9)
    model.opt.disableflags &= ~PLACED
    assert answer(0.0, 0.01) == 1
    assert written[0] == pytest.approx(-0.01, abs=1e-9)
    np.testing.assert_allclose(written[4:], [0, 0, 1, 0, 0, 0], atol=1e-12)
    assert answer(8.5, 0.01) == -1  # the lowest corner is at 9.5
    model.opt.disableflags &= ~ONE_POINT
    assert answer(0.0, 0.01) == -1


def test_the_table_has_it_for_boxes_and_meshes_alone():
    library = mujoco_library()
    types = int(mujoco.mjtGeom.mjGEOM_SDF) + 1
    table = (ctypes.c_void_p * (types * types)).in_dll(library, "mjCOLLISIONFUNC")
    convex = ctypes.cast(library.mjc_Convex, ctypes.c_void_p).value
    box, mesh = int(mujoco.mjtGeom.mjGEOM_BOX), int(mujoco.mjtGeom.mjGEOM_MESH)
    assert table[box * types + mesh] == face_contacts.touch_face.address() or table[
        box * types + mesh
    ] not in (None, convex)
    assert table[mesh * types + mesh] == convex
