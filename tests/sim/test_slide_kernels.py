"""Slides that a compiled loop frees, against MuJoCo's Jacobians of the bodies' points."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from roboyard.sim import World
from roboyard.sim.constraints.bounded_rows import free_axis
from roboyard.sim.physics_profile import BULLET
from roboyard.sim.stepping.sequential.slide_kernels import free_slide
from roboyard.sim.stepping.step_rows import StepRows

NAMES = ("efc_J", "efc_pos", "efc_vel", "efc_aref")


@pytest.mark.parametrize("others", [0, 12])
def test_rows_are_those_along_two_directions_across_the_axis(others: int) -> None:
    """Of two boxes that turn, also with a sparse Jacobian, among a point and a weld."""
    world = World(profile=BULLET)
    one, two = (world.add_box((0.2, 0.2, 0.2), position=(0.6 * k, 0.1, 1.0), mass=1.0 + k) for k in range(2))
    for k in range(others):
        world.add_box((0.1, 0.1, 0.1), position=(5.0 + k, 0, 1), mass=1.0)
    world.constraints.add_point(one.links[0], None, position_a=(0.1, 0, 0), position_b=(0.1, 0.1, 1))
    made = world.constraints.add_slide(
        one.links[0], two.links[0], (0.3, 1.0, 0.2), position_a=(0.2, 0.0, 0.0), position_b=(-0.3, 0.05, 0.1)
    )
    world.constraints.add_weld(two.links[0], None, position_b=(0.6, 0.1, 1))
    world.ensure_compiled()
    model, data = world.live_model, world.live_data
    assert mujoco.mj_isSparse(model) == (others > 0)
    draw = np.random.default_rng(1)
    data.qvel[:] = draw.normal(size=model.nv)
    for body in (one, two):
        turn = draw.normal(size=4)
        data.qpos[body.free_qpos + 3 : body.free_qpos + 7] = turn / np.linalg.norm(turn)
    mujoco.mj_step1(model, data)
    before = [getattr(data, name).copy() for name in NAMES]
    assert made.axis is not None
    place = made.element.id, made.site_a.id, made.site_b.id, made.axis
    free_axis(model, data, *place, follows=False)
    wanted = [getattr(data, name).copy() for name in NAMES]
    for name, values in zip(NAMES, before, strict=True):
        getattr(data, name)[:] = values
    found = StepRows(data, model.nv, is_sparse=bool(others))
    found.look()
    assert free_slide(found.rows, found.search, data.site_xmat, made.element.id, made.site_a.id, made.axis)
    for name, values in zip(NAMES, wanted, strict=True):
        rtol = 1e-4 if name == "efc_aref" else 1e-12  # of impedances that differ from row to row
        np.testing.assert_allclose(getattr(data, name), values, rtol=rtol, atol=1e-12)
        assert (values != before[NAMES.index(name)]).any()
