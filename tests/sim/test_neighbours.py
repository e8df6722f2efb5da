"""Effects of links of spherical joints on each other, against MuJoCo's Jacobians and inertia."""

from __future__ import annotations

from types import SimpleNamespace

import mujoco
import numpy as np
import pytest

from roboyard.sim.stepping.dynamics import neighbours
from roboyard.sim.stepping.sequential import solver_arrays

FRICTION, LIMIT = 1, 3
"""Types of rows."""
KINDS = "ball", "hinge", "slide", "two hinges", "none"


def tree(rng: np.random.Generator, links: int, *, base: str) -> str:
    """Return an MJCF of a ball and a random tree of links with joints of all kinds, most spherical."""
    children: dict[int, list[int]] = {k: [] for k in range(links)}
    for k in range(1, links):
        children[int(rng.integers(max(0, k - 3), k))].append(k)

    def axis() -> str:
        return " ".join(f"{x:.3f}" for x in rng.normal(size=3))

    def link(k: int) -> str:
        kind = base if k == 0 else KINDS[int(rng.choice(5, p=[0.6, 0.1, 0.1, 0.1, 0.1]))]
        joint = {
            "free": "<freejoint/>",
            "fixed": "",
            "none": "",
            "ball": '<joint type="ball" armature="0.02"/>',
            "hinge": f'<joint axis="{axis()}" armature="0.01"/>',
            "slide": f'<joint type="slide" axis="{axis()}"/>',
            "two hinges": f'<joint axis="{axis()}"/><joint axis="{axis()}" pos="0 0 0.1"/>',
        }[kind]
        inside = "".join(map(link, children[k]))
        place, turn = axis(), " ".join(f"{x:.2f}" for x in rng.uniform(-90, 90, 3))
        return (
            f'<body pos="{place}" euler="{turn}">{joint}<geom type="box" size="0.1 0.2 0.3" pos="0.1 0 0.2" '
            f'mass="{rng.uniform(0.1, 2):.3f}"/>{inside}</body>'
        )

    ball = '<body pos="9 0 0"><freejoint/><geom size="0.1"/></body>'
    return f"<mujoco><worldbody>{ball}{link(0)}</worldbody></mujoco>"


@pytest.mark.parametrize("base", ["free", "fixed", "ball", "hinge"])
@pytest.mark.parametrize("seed", range(6))
def test_links_give_each_other_what_mujocos_inertia_says(seed: int, base: str) -> None:
    rng = np.random.default_rng(seed)
    model = mujoco.MjModel.from_xml_string(tree(rng, 9, base=base))
    data = mujoco.MjData(model)
    mujoco.mj_integratePos(model, data.qpos, rng.normal(size=model.nv), 1.0)
    mujoco.mj_forward(model, data)
    rows = np.array([[k, 0, -1, -1] for k in range(model.nv)], np.int32)
    kind, index = np.full(model.nv, FRICTION, np.int32), np.arange(model.nv, dtype=np.int32)
    kind[::5] = LIMIT
    solver = solver_arrays.of_solver(model.nv, model.nv, model.nbody, model.ntree, model.nv, has_balls=True)
    solver.ends[0] = model.nv
    solver.goals[:, 5] = 0.5
    mechanism, state = solver_arrays.of_model(model)[0], solver_arrays.of_data(data)
    neighbours.note_neighbours(rows, kind, index, mechanism, state, solver, FRICTION)
    expected = np.full(model.nv, 0.5)
    for dof in range(model.nv):
        if kind[dof] == FRICTION and model.jnt_type[model.dof_jntid[dof]] == mujoco.mjtJoint.mjJNT_BALL:
            body = int(model.dof_bodyid[dof])
            turns = [np.zeros((3, model.nv)) for _ in range(2)]
            for place, one in zip(turns, (body, int(model.body_parentid[body])), strict=True):
                mujoco.mj_jacBody(model, data, None, place, one)
            own, before = (data.cdof[dof, :3] @ turn for turn in turns)
            response = np.zeros(model.nv)
            mujoco.mj_solveM(model, data, response.reshape(1, -1), before.reshape(1, -1))
            expected[dof] -= 2.0 * own @ response
    assert base != "free" or (expected != 0.5).any()
    np.testing.assert_allclose(solver.goals[:, 5], expected, rtol=1e-9, atol=1e-9)


def test_rows_of_other_joints_need_no_work_arrays() -> None:
    solver = solver_arrays.of_solver(2, 2, 3, 1, 2)
    solver.ends[0] = 2
    mechanism = SimpleNamespace(joint_type=np.array([3, 3]), dof_joint=np.array([0, 1]))
    rows, kinds = np.array([[0, 0, -1, -1], [1, 0, -1, -1]]), np.full(2, FRICTION)
    neighbours.note_neighbours(rows, kinds, np.arange(2), mechanism, None, solver, FRICTION)
    assert not solver.goals.any()
