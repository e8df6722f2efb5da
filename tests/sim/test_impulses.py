"""Rows solved in turn: both ways are a plain loop in Python, and forces alone accelerate as in MuJoCo."""

from dataclasses import replace
from typing import Any

import mujoco
import numpy as np
import pytest
from sim_robots import arm

from roboyard.sim import World
from roboyard.sim.physics_profile import BULLET
from roboyard.sim.stepping import kernels as step_kernels
from roboyard.sim.stepping.dynamics import inertia
from roboyard.sim.stepping.impulses import grouping, lanes, layout, table
from roboyard.sim.stepping.impulses.records import BLOCK, DENSE, KEEP, LINES, OTHERS, SOLVE
from roboyard.sim.stepping.sequential import solver_arrays
from roboyard.sim.stepping.step_rows import ALL


def problem(seed: int, arm: int) -> dict[str, np.ndarray]:
    """Return an arm and a free body with four motors, two normals and the sliding rows of two.

    `dense` holds the whole rows of the Jacobian, `jacobian` those of their trees.
    """
    rng = np.random.default_rng(seed)
    tree_dof, tree_dofs = np.array([0, arm], np.int32), np.array([arm, 6], np.int32)
    nv = arm + 6
    mass = np.zeros((nv, nv))
    for start, size in zip(tree_dof, tree_dofs, strict=True):
        part = rng.normal(size=(size, size))
        mass[start : start + size, start : start + size] = part @ part.T + np.eye(size)
    rows = np.array(
        [[k, 0, -1, -1] for k in range(4)]
        + [[4, 0, 1, 4], [5, -1, 1, 5]]
        + [[6 + k, 0, 1, 4] for k in range(2)]
        + [[8 + k, -1, 1, 5] for k in range(2)],
        np.int32,
    )
    jacobian, entries, spans = np.zeros((10, nv)), np.zeros((10, nv)), np.zeros((10, 4), np.int32)
    for n, (_, a, b, _) in enumerate(rows):
        done = 0
        for side, tree in enumerate((a, b)):
            if tree >= 0:
                spans[n, 2 * side], spans[n, 2 * side + 1] = tree_dof[tree], tree_dofs[tree]
                here = slice(tree_dof[tree], tree_dof[tree] + tree_dofs[tree])
                jacobian[n, here] = rng.normal(size=tree_dofs[tree])
                entries[n, done : done + tree_dofs[tree]] = jacobian[n, here]
                done += tree_dofs[tree]
    goals = np.zeros((10, 6))
    goals[:, 0] = rng.normal(size=10)
    goals[:4, 1], goals[:4, 2] = -0.3, 0.3
    goals[4:6, 2] = 1e10
    goals[6:, 1] = goals[6:, 2] = 0.4
    goals[5, 4] = 0.05
    goals[2, 5] = -0.4
    return {
        "rows": rows,
        "spans": spans,
        "goals": goals,
        "ends": np.array([4, 6, 6, 6, 10], np.int32),
        "parts": np.array([[0, 4, 4, 6, 6, 6, 6, 6, 6, 10], [1] + [0] * 9], np.int32),
        "jacobian": entries,
        "dense": jacobian,
        "response": np.linalg.solve(mass, jacobian.T).T.copy(),
        "scaled": np.linalg.solve(np.linalg.cholesky(mass), jacobian.T).T.copy(),
        "tree_dof": tree_dof,
        "tree_dofs": tree_dofs,
    }


def reference(given: dict[str, np.ndarray], rounds: int) -> np.ndarray:
    """Return the impulses after some rounds, by dense products."""
    J, R, goals = given["dense"], given["response"], given["goals"]
    impulses, change = np.zeros(10), np.zeros(J.shape[1])
    own = np.einsum("nd,nd->n", J, R) + goals[:, 4] - goals[:, 5]

    def wish(n: int) -> float:
        return impulses[n] + (goals[n, 0] - goals[n, 4] * impulses[n] - J[n] @ change) / own[n]

    for turn in range(rounds):
        for n in [*(range(3, -1, -1) if turn % 2 == 0 else range(4)), 4, 5]:
            new = np.clip(wish(n), goals[n, 1], goals[n, 2])
            change += R[n] * (new - impulses[n])
            impulses[n] = new
        for n, normal in ((6, 4), (8, 5)):
            new = np.array([wish(n), wish(n + 1)])
            bound = 0.4 * max(impulses[normal], 0.0)
            new *= min(1.0, bound / np.linalg.norm(new))
            change += (new - impulses[n : n + 2]) @ R[n : n + 2]
            impulses[n : n + 2] = new
    return impulses


def by_lanes(
    given: dict[str, np.ndarray],
    scaled: np.ndarray,
    diagonal: np.ndarray,
    goals: np.ndarray,
    rounds: int,
    change: np.ndarray,
    *,
    is_pyramid: bool = False,
) -> None:
    """Solve in lanes, with work arrays of numbers that must not be read."""
    spans, dofs = given["spans"], given["tree_dofs"]
    packed = np.full(given["jacobian"].shape, np.nan)
    for n, (first, size, other, others) in enumerate(spans.tolist()):
        a, b = given["rows"][n, 1:3]
        if size and not diagonal[a]:
            packed[n, :size] = scaled[n, first : first + size]
        if others and not diagonal[b]:
            packed[n, size : size + others] = scaled[n, other : other + others]
    lanes.solve_in_turn(
        *(given["rows"], spans, goals, given["ends"], given["parts"], given["jacobian"], packed),
        *(given.get("roots", np.full(len(change), np.nan)), diagonal, given["tree_dof"], dofs),
        *(np.zeros(len(dofs), np.int32), np.full((len(spans), layout.PLACES), -1, np.int32)),
        *(np.full(len(spans) * (layout.STRIDE + len(change)), np.nan), np.full(9 * len(change), np.nan)),
        *(rounds, 0.0, is_pyramid, change),
    )


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("arm", [4, 8, 19])
@pytest.mark.parametrize("rounds", [1, 2, 50])
def test_both_ways_of_solving_in_turn_are_the_plain_loop(seed: int, arm: int, rounds: int) -> None:
    given = problem(seed, arm)
    expected, scaled = reference(given, rounds), given["scaled"]
    rows, spans, ends, parts = (given[name] for name in ("rows", "spans", "ends", "parts"))
    nv, width = arm + 6, 10 + -10 % BLOCK
    for by_table in (True, False):
        goals, change = given["goals"].copy(), np.zeros(nv)
        if by_table:
            across = np.zeros((nv, width))
            across[:, :10] = scaled.T
            table.solve_by_table(
                *(rows, spans, goals, ends, parts, across.ravel(), rounds, 0.0, False),
                *(np.full(10 * width, np.nan), np.full(LINES * width, np.nan), change),
            )
        else:
            by_lanes(given, scaled, np.zeros(2, np.uint8), goals, rounds, change)
        assert np.allclose(goals[:, 3], expected, atol=1e-12)
        assert np.allclose(change, expected @ scaled, atol=1e-12)


def pile(seed: int, sizes: list[int], contacts: int) -> dict[str, np.ndarray]:
    """Return two groups of trees with motors, and contacts that spin, roll and slide, some in a row alike.

    Trees of six degrees of freedom have a diagonal inertia. The first tree of each group has motors.
    """
    rng = np.random.default_rng(seed)
    tree_dofs = np.array(sizes * 2, np.int32)
    tree_dof = (np.cumsum(tree_dofs) - tree_dofs).astype(np.int32)
    nv, count = int(tree_dofs.sum()), len(sizes)
    mass = np.zeros((nv, nv))
    for start, size in zip(tree_dof, tree_dofs, strict=True):
        part = rng.normal(size=(size, size))
        whole = np.diag(rng.uniform(0.5, 2.0, size)) if size == 6 else part @ part.T + np.eye(size)
        mass[start : start + size, start : start + size] = whole
    kinds: list[list[tuple[int, int, int]]] = [[] for _ in range(5)]
    parts = np.zeros((2 * count + 1, 10), np.int32)
    parts[-1, 0] = 2
    for group in range(2):
        touching = []
        while len(touching) < contacts:
            pair = [int(t) for t in rng.choice(np.arange(-1, count), 2, replace=False)]
            for _ in range(min(rng.choice([1, 2, 3, 4, 5, 8]), contacts - len(touching))):
                a, b = pair if rng.random() < 0.95 else pair[::-1]
                touching.append(tuple(t + group * count if t >= 0 else -1 for t in (a, b)))
        normals = 2 * 3 + group * contacts
        for kind, rows in enumerate(kinds):
            parts[group, 2 * kind] = len(rows)
            if kind == 0:
                rows += [(group * count, -1, -1)] * 3
            for k, (a, b) in enumerate(touching if kind else []):
                rows += [(a, b, normals + k)] * (1 if kind < 3 else 2)
            parts[group, 2 * kind + 1] = len(rows)
    ends = np.cumsum([len(rows) for rows in kinds]).astype(np.int32)
    for kind in range(1, 5):
        parts[:2, 2 * kind : 2 * kind + 2] += ends[kind - 1]
    listed = [row for rows in kinds for row in rows]
    rows = np.array([[n, *row] for n, row in enumerate(listed)], np.int32)
    dense, entries = np.zeros((len(rows), nv)), np.full((len(rows), 2 * max(sizes)), np.nan)
    spans = np.zeros((len(rows), 4), np.int32)
    for n, (_, a, b, _) in enumerate(rows):
        done = 0
        for side, tree in enumerate((a, b)):
            if tree >= 0:
                first, size = tree_dof[tree], tree_dofs[tree]
                spans[n, 2 * side], spans[n, 2 * side + 1] = first, size
                dense[n, first : first + size] = entries[n, done : done + size] = rng.normal(size=size)
                done += size
    goals = np.zeros((len(rows), 6))
    goals[:, 0] = rng.normal(size=len(rows))
    goals[: ends[0], 1], goals[: ends[0], 2] = -0.3, 0.3
    goals[ends[0] : ends[1], 2] = 1e10
    goals[ends[0] : ends[1] : 3, 4] = 0.05
    goals[ends[1] : ends[3], 2], goals[ends[3] :, 2] = 0.1, 0.4
    return {
        "rows": rows,
        "spans": spans,
        "goals": goals,
        "ends": np.append(ends, np.int32(len(rows))).astype(np.int32),
        "parts": parts,
        "jacobian": entries,
        "dense": dense,
        "response": np.linalg.solve(mass, dense.T).T.copy(),
        "scaled": np.linalg.solve(np.linalg.cholesky(mass), dense.T).T.copy(),
        "roots": 1.0 / np.sqrt(np.diag(mass)),
        "tree_dof": tree_dof,
        "tree_dofs": tree_dofs,
    }


def impulses_of_pile(given: dict[str, np.ndarray], rounds: int, *, is_pyramid: bool = False) -> np.ndarray:
    """Return the impulses of all groups after some rounds, by dense products.

    is_pyramid: rows of friction are bounded alone, and none resist spinning.
    """
    J, R, goals, rows, ends = (given[name] for name in ("dense", "response", "goals", "rows", "ends"))
    impulses, change = np.zeros(len(J)), np.zeros(J.shape[1])
    own = np.einsum("nd,nd->n", J, R) + goals[:, 4] - goals[:, 5]

    def wish(n: int) -> float:
        return impulses[n] + (goals[n, 0] - goals[n, 4] * impulses[n] - J[n] @ change) / own[n]

    def put(n: int, impulse: float) -> None:
        nonlocal change
        change = change + R[n] * (impulse - impulses[n])
        impulses[n] = impulse

    for group in given["parts"][: given["parts"][-1, 0]]:
        for turn in range(rounds):
            joints = range(group[0], group[1])
            for n in [*(joints if turn % 2 else joints[::-1]), *range(group[2], group[3])]:
                put(n, np.clip(wish(n), goals[n, 1], goals[n, 2]))
            alone = [*range(group[6], group[7]), *range(group[8], group[9])] if is_pyramid else []
            for n in alone or range(group[4], group[4] if is_pyramid else group[5]):
                bound = goals[n, 2] * impulses[rows[n, 3]]
                if bound > 0.0:
                    put(n, np.clip(wish(n), -bound, bound))
            for n in () if is_pyramid else [*range(group[6], group[7], 2), *range(group[8], group[9], 2)]:
                bound = goals[n, 2] * impulses[rows[n, 3]]
                if bound > 0.0 or n >= ends[3]:
                    new = np.array([wish(n), wish(n + 1)])
                    new *= min(1.0, bound / max(np.linalg.norm(new), 1e-300))
                    put(n, new[0])
                    put(n + 1, new[1])
    return impulses


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize(
    "sizes", [[6, 6, 6], [3, 6, 8], [9, 6, 6], [6, 19, 16, 27]], ids=["free", "narrow", "arm", "robots"]
)
@pytest.mark.parametrize("is_pyramid", [False, True])
def test_piles_in_lanes_are_the_plain_loop(seed: int, sizes: list[int], is_pyramid: bool) -> None:
    """Of free bodies, of small mechanisms, and of both with trees that take several blocks."""
    given = pile(seed, sizes, contacts=24)
    for rounds in (1, 2, 30):
        goals, change = given["goals"].copy(), np.zeros(given["dense"].shape[1])
        diagonal = (given["tree_dofs"] == 6).astype(np.uint8)
        by_lanes(given, given["scaled"], diagonal, goals, rounds, change, is_pyramid=is_pyramid)
        expected = impulses_of_pile(given, rounds, is_pyramid=is_pyramid)
        assert np.allclose(goals[:, 3], expected, atol=1e-11)
        assert np.allclose(change, expected @ given["scaled"], atol=1e-11)
        assert (expected[given["ends"][1] :] != 0.0).any()


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("contacts", [3, 8, 10])
@pytest.mark.parametrize("is_pyramid", [False, True])
def test_piles_by_table_are_the_plain_loop(seed: int, contacts: int, is_pyramid: bool) -> None:
    """With rows of each kind in fours and alone, in two groups."""
    given = pile(seed, [9, 6, 8], contacts)
    count, nv = given["dense"].shape
    width = count + -count % BLOCK
    across = np.zeros((nv, width))
    across[:, :count] = given["scaled"].T
    for rounds in (1, 2, 30):
        goals, change = given["goals"].copy(), np.zeros(nv)
        table.solve_by_table(
            *(given["rows"], given["spans"], goals, given["ends"], given["parts"]),
            *(across.ravel(), rounds, 0.0, is_pyramid, np.full(count * width, np.nan)),
            *(np.full(LINES * width, np.nan), change),
        )
        expected = impulses_of_pile(given, rounds, is_pyramid=is_pyramid)
        assert np.allclose(goals[:, 3], expected, atol=1e-11)
        assert np.allclose(change, expected @ given["scaled"], atol=1e-11)


@pytest.mark.parametrize("balls", [False, True])
def test_the_compiled_loop_solves_a_pile_as_the_plain_one(balls: bool) -> None:
    """Of boxes, or of balls that roll, with an arm among them, by the inertia that MuJoCo has."""
    world = World(profile=BULLET)
    world.add_plane()
    whole = arm()
    robot = world.add_description(replace(whole, links=whole.links[:4], joints=whole.joints[:3]), (0, 0, 1.0))
    for k in range(30):
        place = (0.11 * (k % 3) - 0.11, 0.12 * (k // 3 % 3) - 0.12, 0.055 + 0.101 * (k // 9))
        if balls and k % 2:
            ball = world.add_sphere(0.05, position=place, mass=0.3)
            ball.links[0].set_friction(spinning=0.02, rolling=0.01)
        else:
            world.add_box((0.1, 0.1, 0.1), position=place, mass=0.3)
    for joint in robot.joints:
        world.motors.set(joint, position=0.7, max_force=30.0)
    world.stepping.in_turn.set_rounds(4, 0.0)
    world.step(25)
    model, data, solver = world.live_model, world.live_data, world.stepping.in_turn._solver
    ends, nv = solver.ends, model.nv
    listed = int(ends[4])
    assert (
        listed > DENSE
        and (solver.spans[:listed, 1] == 9).any()
        and ends[5] == world.stepping.in_turn.contact_rows.counts[ALL]
    )
    mass = np.zeros((nv, nv))
    mujoco.mj_fullM(model, data, mass)
    dense = np.zeros((listed, nv))
    for n, (first, size, other, others) in enumerate(solver.spans[:listed].tolist()):
        dense[n, first : first + size] = solver.jacobian[n, :size]
        dense[n, other : other + others] = solver.jacobian[n, size : size + others]
    given = {
        "rows": solver.order,
        "goals": solver.goals[:listed],
        "ends": ends,
        "parts": solver.parts,
        "dense": dense,
        "response": np.linalg.solve(mass, dense.T).T,
    }
    expected = impulses_of_pile(given, 4)
    np.testing.assert_allclose(solver.goals[:listed, 3], expected, atol=1e-9 * np.abs(expected).max())
    assert ((ends[2] > ends[1]) and (ends[3] > ends[2])) == balls


@pytest.mark.parametrize("blocks", [1, 2])
def test_scaled_entries_are_those_of_mujocos_inertia(blocks: int) -> None:
    """Their products are J M^-1 J', and what impulses change is M^-1 J', by MuJoCo's own solution."""
    world = World(profile=BULLET)
    robot = world.add_description(arm(), (0, 0, 1.7))
    world.add_box((0.3, 0.2, 0.1), position=(2.0, 0.0, 0.3), mass=1.0)
    for joint in robot.joints:
        world.motors.set(joint, position=0.7, max_force=30.0)
    world.step(10)
    model, data = world.live_model, world.live_data
    rng = np.random.default_rng(4)
    mujoco.mj_forward(model, data)
    solver = world.stepping.in_turn
    solver.prepare(model, data, world.timestep)
    mechanism, state, nv = solver._mechanism, solver._state, model.nv
    assert mechanism is not None
    jacobian = rng.normal(size=(BLOCK * blocks, nv))
    expected = np.zeros_like(jacobian)
    mujoco.mj_solveM(model, data, expected, jacobian)
    roots, plain = np.zeros(nv), np.zeros(model.ntree, np.uint8)
    assert inertia.find_roots(mechanism, state, roots, plain) == 1
    assert plain.tolist() == [0, 1]
    across = jacobian.T.copy()
    inertia.scale_across(mechanism, state, roots, across.reshape(-1), BLOCK * blocks)
    scaled = np.full((BLOCK * blocks, nv), np.nan)
    for n in range(BLOCK * blocks):
        for tree in range(model.ntree):
            first, size = int(mechanism.tree_dof[tree]), int(mechanism.tree_dofs[tree])
            inertia.scale(mechanism, state, roots, jacobian[n], scaled[n], first, size, first)
    np.testing.assert_allclose(across.T, scaled, rtol=1e-12)
    products = jacobian @ expected.T
    np.testing.assert_allclose(scaled @ scaled.T, products, rtol=1e-9, atol=1e-9 * np.abs(products).max())
    for n in range(BLOCK * blocks):
        inertia.change_velocities(mechanism, state, roots, scaled[n])
    np.testing.assert_allclose(scaled, expected, rtol=1e-9, atol=1e-9 * np.abs(expected).max())


def test_forces_alone_accelerate_as_in_mujoco() -> None:
    """Drag and wrenches along the trees, and the inertia's sparse factor, against MuJoCo's own functions."""
    world = World(profile=BULLET)
    world.add_plane()
    whole = arm()
    robot = world.add_description(
        replace(whole, links=whole.links[:4], joints=whole.joints[:3]), (0, 0, 1.7), fixed_base=True
    )
    box = world.add_box((0.3, 0.2, 0.1), position=(2.0, 0.0, 0.3), mass=1.0)
    for joint in robot.joints:
        world.motors.set(joint, position=0.7, max_force=30.0)
    for link in (*robot.links, *box.links):
        world.surfaces.set_damping(link, 0.3, 0.2, linear_quadratic=0.1, angular_quadratic=0.4)
    world.step(30)
    model, data = world.live_model, world.live_data
    data.qvel[:] = np.random.default_rng(1).normal(size=model.nv)
    data.qfrc_applied[1], data.xfrc_applied[-1] = 0.4, (0.1, -0.2, 0.3, 0.05, 0.02, -0.07)
    mujoco.mj_step1(model, data)
    solver = world.stepping.in_turn
    solver.prepare(model, data, world.timestep)
    inertia.accelerate(solver._mechanism, solver._state, solver._surface, solver._solver)
    ours = data.qfrc_smooth.copy(), data.qacc_smooth.copy()
    step_kernels.add_damping(
        *(solver._surface.damping, model.body_mass, model.body_inertia, model.body_rootid, data.cvel),
        *(data.xipos, data.ximat, data.subtree_com, data.xfrc_applied),
    )
    mujoco.mj_fwdAcceleration(model, data)
    np.testing.assert_allclose(ours[0], data.qfrc_smooth, atol=1e-12)
    np.testing.assert_allclose(ours[1], data.qacc_smooth, atol=1e-9)
    assert np.abs(data.qacc_smooth).min() > 1e-3


def test_rows_are_handed_over_with_what_forces_alone_lead_to() -> None:
    """MuJoCo solves rows where there are no rounds; drag acts without a place among external forces."""
    world = World(profile=BULLET)
    world.stepping.in_turn.set_rounds(0, 0.0)
    world.add_plane()
    boxes = [
        world.add_box((0.1, 0.1, 0.1), position=(0.3 * k, 0.0, 0.0501 + 0.2 * (k % 2)), mass=0.5 + k)
        for k in range(10)
    ]
    for box in boxes:
        world.surfaces.set_damping(box.links[0], 0.3, 0.2, linear_quadratic=0.1, angular_quadratic=0.4)
    world.step(3)
    model, data = world.live_model, world.live_data
    assert mujoco.mj_isSparse(model) and data.ncon
    data.qvel[:] = np.random.default_rng(4).normal(size=model.nv)
    data.xfrc_applied[3] = (0.1, -0.2, 0.3, 0.05, 0.02, -0.07)
    pushes = data.xfrc_applied.copy()
    mujoco.mj_step1(model, data)
    found, solver = world.stepping._compiled[1], world.stepping.in_turn
    solver.prepare(model, data, world.timestep)
    assert solver.execute(found, KEEP, SOLVE) == OTHERS
    solver.hand_over(found)
    ours = data.qfrc_smooth.copy(), data.qacc_smooth.copy()
    assert (data.xfrc_applied == pushes).all()
    step_kernels.add_damping(
        *(solver._surface.damping, model.body_mass, model.body_inertia, model.body_rootid, data.cvel),
        *(data.xipos, data.ximat, data.subtree_com, data.xfrc_applied),
    )
    mujoco.mj_fwdAcceleration(model, data)
    np.testing.assert_allclose(ours[0], data.qfrc_smooth, atol=1e-12)
    np.testing.assert_allclose(ours[1], data.qacc_smooth, atol=1e-9)


def test_sliding_rows_are_those_of_points_on_the_surface() -> None:
    world = World(profile=BULLET)
    world.add_plane()
    box = world.add_box((0.3, 0.2, 0.1), position=(0.0, 0.0, 0.0515), mass=1.0)
    world.surfaces.margins_of = lambda: 0.002 * (world.live_model.geom_type == int(mujoco.mjtGeom.mjGEOM_BOX))
    world.step(3)
    model, data = world.live_model, world.live_data
    data.qvel[:] = np.random.default_rng(3).normal(size=model.nv)
    mujoco.mj_step1(model, data)
    found, solver = world.stepping._compiled[1], world.stepping.in_turn
    points = data.contact.pos + (0.5 * data.contact.dist - 0.002)[:, None] * data.contact.frame[:, :3]
    assert solver.arrange(found) and data.ncon >= 4
    made, row = solver._solver, int(box.mujoco_ids[0])
    for n in range(made.ends[3], made.ends[4]):
        contact = int(np.flatnonzero(data.contact.efc_address == made.order[made.order[n, 3], 0])[0])
        axis = data.contact.frame[contact].reshape(3, 3)[1 + (n - made.ends[3]) % 2]
        jacobian = np.zeros((3, model.nv))
        mujoco.mj_jac(model, data, jacobian, None, points[contact], row)
        np.testing.assert_allclose(
            made.jacobian[n, : made.spans[n, 1] + made.spans[n, 3]], axis @ jacobian, atol=1e-12
        )
        np.testing.assert_allclose(data.efc_vel[made.order[n, 0]], axis @ jacobian @ data.qvel, atol=1e-12)


@pytest.mark.parametrize("rows", [3, 16, 21, 300])
def test_tables_begin_at_lines_of_the_cache(rows: int) -> None:
    """Else an access to four numbers may need two lines, which takes a tenth of some steps."""
    for _ in range(5):
        solver = solver_arrays.of_solver(rows, nv=7, bodies=4, trees=2, entries=7)
        for numbers in (solver.across, solver.table, solver.lines):
            assert numbers.ctypes.data % 64 == 0 and len(numbers) % BLOCK == 0 and not numbers.any()
        assert len(solver.across) == 7 * len(solver.lines) / LINES


@pytest.mark.parametrize("has_groups", [False, True])
def test_rows_of_a_world_in_which_nothing_moves_are_none(has_groups: bool) -> None:
    """The first row of a group came after its last: numbers before an array were written then."""
    solver = solver_arrays.of_solver(8, 0, 1, 0, 8)
    solver.ends[:] = 0
    gather: Any = grouping.gather_groups
    gather(None, None, solver, has_groups)
    for group in solver.parts[: solver.parts[-1, 0]]:
        assert not np.diff(group.reshape(-1, 2)).any()
    before = solver.lines.base.copy()
    table.solve_by_table(
        solver.order, solver.spans, solver.goals, solver.ends, solver.parts, solver.across, 50.0, 1e-7, False,
        solver.table, solver.lines, solver.change,
    )  # fmt: skip
    np.testing.assert_array_equal(solver.lines.base, before)
