"""Sums of masses that are computed for the bodies that changed are those that MuJoCo computes of all."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from roboyard.sim.build.inertia_sums import InertiaSums

ARM = '<body pos="1 0 0"><joint/><geom size=".1"/><body pos="0 0 .3"><joint/><geom size=".1"/></body></body>'
FREE = '<body pos="0 {0} 1"><freejoint/><geom type="box" size=".1 .2 .3"/></body>'
OTHERS = {
    "off the frame": '<body pos="0 5 1"><freejoint/><geom type="box" size=".1 .2 .3" pos=".1 0 0"/></body>',
    "two links": '<body pos="0 5 1"><freejoint/><geom size=".1"/>' + ARM + "</body>",
    "a hinge": '<body pos="0 5 1"><joint/><geom size=".1"/></body>',
    "armature": '<body pos="0 5 1"><joint type="free" armature="0.1"/><geom size=".1"/></body>',
}
SUMS = ("body_subtreemass", "dof_M0", "dof_invweight0", "body_invweight0")


def model_of(*bodies: str) -> mujoco.MjModel:
    return mujoco.MjModel.from_xml_string(f"<mujoco><worldbody>{''.join(bodies)}</worldbody></mujoco>")


def sums_of(model: mujoco.MjModel) -> list[np.ndarray]:
    return [getattr(model, name).copy() for name in SUMS]


def test_sums_of_free_bodies_are_those_of_mujoco() -> None:
    model = model_of(ARM, *(FREE.format(k) for k in range(3)), ARM)
    data, sums, rng = mujoco.MjData(model), InertiaSums(), np.random.default_rng(2)
    assert not sums.update(model, 0)
    mujoco.mj_setConst(model, data)
    sums.note(model, 0)
    free = [k for k in range(model.nbody) if model.body_dofnum[k] == 6]
    for _ in range(50):
        for k in rng.choice(free, 2):
            model.body_mass[k] = 10 ** rng.uniform(-3, 3)
            model.body_inertia[k] = model.body_mass[k] * rng.uniform(0.5, 1.0, 3)
        assert sums.update(model, 0)
        found = sums_of(model)
        mujoco.mj_setConst(model, data)
        for ours, all_of_them in zip(found, sums_of(model), strict=True):
            np.testing.assert_allclose(ours, all_of_them, rtol=3e-16, atol=0)


@pytest.mark.parametrize("name", OTHERS)
def test_other_bodies_are_left_to_mujoco(name: str) -> None:
    model = model_of(FREE.format(0), OTHERS[name])
    sums = InertiaSums()
    sums.note(model, 0)
    before = sums_of(model)
    model.body_mass[2] *= 2.0
    assert not sums.update(model, 0)
    for found, old in zip(sums_of(model), before, strict=True):
        np.testing.assert_array_equal(found, old)


def test_the_first_body_without_gravity_and_new_rows_are_left_to_mujoco() -> None:
    model = model_of(FREE.format(0), FREE.format(1))
    sums, data = InertiaSums(), mujoco.MjData(model)
    sums.note(model, 0)
    model.body_mass[1] *= 2.0
    assert not sums.update(model, 1)
    model.body_gravcomp[1] = 1.0
    assert not sums.update(model, 0)
    mujoco.mj_setConst(model, data)
    sums.note(model, 0)
    model.body_gravcomp[1], model.body_mass[1] = 0.0, 3.0
    assert sums.update(model, 0)
    data.qvel[2] = 1.0
    mujoco.mj_forward(model, data)
    assert data.qacc[2] == pytest.approx(-9.81)
