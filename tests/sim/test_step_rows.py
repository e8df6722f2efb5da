"""Contacts and constraint rows in MuJoCo's memory, compared with the arrays that its module returns."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pytest
from sim_robots import arm

from roboyard.sim import World
from roboyard.sim.physics_profile import BULLET
from roboyard.sim.stepping import step_row_kernels, step_rows
from roboyard.sim.stepping.contact_rows import ContactRows
from roboyard.sim.stepping.impulses.records import DENSE, EXTRA
from roboyard.sim.stepping.step_rows import ROWS, StepRows

SCENE = """<mujoco><option cone="elliptic"/><worldbody><geom type="plane" size="1 1 1"/>
  <body pos="0 0 0.1"><freejoint/><geom type="box" size="0.1 0.1 0.1" condim="6"/></body>
  <body pos="1 0 0.5"><joint name="a" axis="0 1 0" range="-0.1 0.1" limited="true" frictionloss="0.3"/>
    <geom type="capsule" size="0.05" fromto="0 0 0 0.4 0 0.1"/></body></worldbody></mujoco>"""
CONTACT = ("geom", "efc_address", "dim", "dist", "pos", "frame", "friction", "mu", "exclude")


@pytest.fixture
def without_memory(monkeypatch: pytest.MonkeyPatch):
    """Return a function after which arrays come from MuJoCo's module only."""

    def forbid() -> None:
        monkeypatch.setattr(step_rows, "layout", lambda: None)

    return forbid


@pytest.mark.parametrize("height", [0.0, 3.0])
@pytest.mark.parametrize("in_memory", [True, False])
@pytest.mark.parametrize("kind", ["dense", "sparse"])
def test_contacts_and_rows_are_those_of_mujoco(
    height: float, in_memory: bool, kind: str, without_memory
) -> None:
    """In a new step they are elsewhere; without contacts there are rows of the joint only."""
    assert step_rows.layout() is not None, "a new version of MuJoCo: see step_rows.py"
    if not in_memory:
        without_memory()
    model = mujoco.MjModel.from_xml_string(SCENE)
    model.opt.jacobian = getattr(mujoco.mjtJacobian, f"mjJAC_{kind.upper()}")
    data = mujoco.MjData(model)
    found = StepRows(data, model.nv, is_sparse=kind == "sparse")
    data.qpos[2] += height
    data.qpos[7], data.qvel[6] = 0.2, 1.0
    for step in range(3):
        mujoco.mj_step(model, data)
        mujoco.mj_forward(model, data)
        assert data.nefc > data.ncon and (data.ncon == 0) == (height > 0), step
        assert found.look() == (data.ncon, data.ne, data.nf, data.nl, data.nefc, data.nJ)
        for name, block, start in zip(ROWS, found.rows, found.rows.starts, strict=False):
            if name.startswith("efc_J_") and kind == "dense":
                continue
            wanted = getattr(data, name)
            np.testing.assert_array_equal(block[start : start + wanted.size], wanted.ravel(), err_msg=name)
            if in_memory:
                assert np.shares_memory(block[start : start + wanted.size], wanted), name
        for name, field in zip(CONTACT, found.contacts, strict=True):
            wanted = getattr(data.contact, name)
            np.testing.assert_array_equal(field[: data.ncon], wanted, err_msg=name)


def test_addresses_outside_the_block_are_refused() -> None:
    """Each array must be within the block as a whole, and the block must be the one that was found."""
    places, starts = np.arange(2, 16), np.zeros(13, np.int64)
    good = np.array([0, 1000, *(1000 + 80 * k for k in range(13)), 1000])

    def search(
        words: np.ndarray,
        size: int = 1200,
        contacts: int = 1,
        rows: int = 5,
        entries: int = 10,
        is_sparse: int = 1,
    ) -> int:
        counts = np.array([contacts, 0, 0, 0, rows, entries], np.int32)
        return step_row_kernels.find_rows(words, places, counts, starts, 1000, size, 600, 2, is_sparse)

    assert search(good, is_sparse=0) == 1
    assert starts.tolist() == [0, 20, *(10 * k for k in range(2, 10)), 0, 0, 0]
    assert search(good) == 1
    assert starts.tolist() == [0, 20, *(10 * k for k in range(2, 10)), 200, 220, 240]
    for at, value in ((1, 2000), (4, 992), (4, 1161), (4, 2128), (11, 2192), (2, 0), (15, 1008), (14, 2184)):
        words = good.copy()
        words[at] = value
        assert search(words) == 0, (at, value)
    assert search(good, size=999) == 0 and search(good, contacts=3) == 0 and search(good, rows=-1) == 0
    assert search(good, entries=-1) == 0 and search(good, entries=200) == 0
    assert search(good, size=759, is_sparse=0) == 0 and search(good, size=760, is_sparse=0) == 1
    assert search(np.where(np.arange(16) > 1, 0, good), contacts=0, rows=0, entries=0) == 1


@pytest.fixture
def rows_of_mujoco(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let MuJoCo make all rows, as it does where the addresses are not known."""
    monkeypatch.setattr(ContactRows, "serves", lambda *_: False)


def _states(steps: int, *, keeps_points: bool) -> np.ndarray:
    """Return the states of a world with motors, contacts and bodies that come and go.

    On a floor that is a box, a cylinder keeps points of earlier steps besides the one that MuJoCo finds;
    spheres on a plane keep none.
    """
    world = World(profile=BULLET)
    if keeps_points:
        world.add_box((4.0, 4.0, 0.2), position=(0.0, 0.0, -0.1), mass=0.0)
    else:
        world.add_plane()
    whole = arm()  # without the finger that mimics another, whose equality leaves all rows to MuJoCo
    robot = world.add_description(
        replace(whole, links=whole.links[:4], joints=whole.joints[:3]), (0, 0, 1.7), fixed_base=True
    )
    for joint in robot.joints:
        world.motors.set(joint, position=0.7, max_force=30.0)
    states, alone, kept = [], 0, 0
    for step in range(steps):
        if step == steps // 3:
            if keeps_points:
                world.add_box((0.3, 0.3, 0.3), position=(-0.9, 0.0, 0.14), mass=1.0)
                world.add_cylinder(0.1, 0.3, position=(0.6, 0.0, 0.14), mass=0.5)
            else:
                world.add_sphere(0.15, position=(-0.9, 0.0, 0.14), mass=1.0)
                world.add_sphere(0.1, position=(0.6, 0.0, 0.09), mass=0.5)
        if step == 2 * steps // 3:
            world.remove(world.bodies[-1])
        world.step()
        data = world.live_data
        alone += data.ncon > 0 and (data.nf > 0 or world.stepping.in_turn.contact_rows.is_last)
        kept += world.stepping.manifolds.points.notes[EXTRA] > 0
        states.append(np.concatenate([np.resize(data.qpos, 24), np.resize(data.qvel, 24), [data.time]]))
    assert alone > steps // 3
    assert (kept > steps // 6) == keeps_points
    return np.array(states)


@pytest.mark.parametrize("keeps_points", [False, True])
def test_steps_are_the_same_to_the_last_bit_without_the_addresses(
    keeps_points: bool, without_memory, rows_of_mujoco: None
) -> None:
    with_addresses = _states(240, keeps_points=keeps_points)
    without_memory()
    np.testing.assert_array_equal(_states(240, keeps_points=keeps_points), with_addresses)
    assert np.ptp(with_addresses, axis=0).max() > 0.1


@pytest.mark.parametrize("keeps_points", [False, True])
def test_steps_with_rows_that_are_made_here_are_the_same(
    keeps_points: bool, request: pytest.FixtureRequest
) -> None:
    ours = _states(120, keeps_points=keeps_points)
    request.getfixturevalue("rows_of_mujoco")
    np.testing.assert_allclose(ours, _states(120, keeps_points=keeps_points), atol=1e-7)


def _states_of_boxes(steps: int) -> np.ndarray:
    """Return the states of a held arm and of boxes that land, whose rows MuJoCo's solver has."""
    world = World(profile=replace(BULLET, motor_rounds=0))
    world.add_plane()
    whole = arm()
    robot = world.add_description(
        replace(whole, links=whole.links[:4], joints=whole.joints[:3]), (0, 0, 1.7), fixed_base=True
    )
    for joint in robot.joints:
        world.motors.set(joint, position=0.7, max_force=30.0)
    for k in range(12):
        box = world.add_box((0.1, 0.1, 0.1), position=(0.3 + 0.2 * k, 1.0, 0.051 + 0.01 * k), mass=0.3)
        world.surfaces.set_damping(box.links[0], 0.3, 0.2)
        world.surfaces.set_compliance(box.links[0], 2e3 * (k % 3), 40.0)
        world.surfaces.set_restitution(box.links[0], 0.1 * (k % 2))
    states, most = [], 0
    for _ in range(steps):
        world.step()
        data = world.live_data
        most = max(most, data.nefc)
        states.append(np.concatenate([data.qpos, data.qvel]))
    assert most > DENSE
    return np.array(states)


def test_rows_are_handed_to_mujocos_solver_as_without_the_addresses(without_memory) -> None:
    with_addresses = _states_of_boxes(90)
    without_memory()
    np.testing.assert_allclose(_states_of_boxes(90), with_addresses, atol=1e-9)
    assert np.ptp(with_addresses, axis=0).max() > 0.05


def test_the_stored_layout_is_the_one_found_until_a_file_of_mujoco_changes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    found = step_rows.find_layout()
    assert found is not None
    for stored in (False, True):
        if stored:
            monkeypatch.setattr(step_rows, "find_layout", lambda: pytest.fail("it is stored"))
        layout = step_rows.layout.__wrapped__()
        assert layout is not None
        np.testing.assert_array_equal(layout.places, found.places)
        assert layout[1:] == found[1:]
    (file,) = (tmp_path / "roboyard" / "mujoco").glob("numbers-rows-*")
    assert file.stat().st_mode & 0o77 == 0
    whole = file.read_text()
    monkeypatch.setattr(step_rows, "find_layout", lambda: None)
    state = whole.split("\n")[0]
    for damaged in (whole[:-3], "", "junk", whole.replace(state, state + "0")):
        file.write_text(damaged)
        assert step_rows.layout.__wrapped__() is None
    file.write_text(whole)
    assert step_rows.layout.__wrapped__() is not None
    file.chmod(0o620)
    assert step_rows.layout.__wrapped__() is None
