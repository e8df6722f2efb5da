"""Bodies, constraints and filters that come and go between steps: what changes row by row against a client
in which all rows are looked up again each time, to the last bit."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from roboyard import pybullet as p
from roboyard.pybullet.bullet_rules.placed_shapes.shape_rows import ShapeRows
from roboyard.pybullet.connections import CLIENTS
from roboyard.sim.stepping.broad_phase.box_tree import FIRST, LINK, ROOT, SECOND
from roboyard.sim.stepping.impulses.records import (
    CHECKED,
    LINKS,
    LISTED,
    PAIRS,
    RANKED,
    TABLE,
)  # fmt: skip
from roboyard.sim.stepping.manifolds import Manifolds
from roboyard.sim.stepping.sequential.motors import SequentialMotors

STEPS = 150
_HULLS = (
    [[0, 0, 0], [0.2, 0, 0], [0, 0.2, 0], [0, 0, 0.2]],
    [[0, 0, 0], [0.2, 0, 0.01], [0, 0.2, 0.02], [0.05, 0.05, 0.2], [0.1, 0.1, 0.1]],
)
"""Corners of the hulls of two shapes (m)."""


def _looked_up_whole(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let everything be looked up again whenever a body comes or goes."""
    monkeypatch.setattr(Manifolds, "change", lambda self, _, *, is_there: self.invalidate())
    monkeypatch.setattr(SequentialMotors, "change", lambda self, _, *, is_there: self.note_bodies())
    monkeypatch.setattr(ShapeRows, "_update", lambda *_: False)


def _order(points: Any) -> list[int]:
    """Return the links in the order in which the tree of boxes has them."""
    found, left = list[int](), [int(points.tree[ROOT])]
    while left:
        node = left.pop()
        if points.ties[node, SECOND] < 0:
            found.append(int(points.ties[node, LINK]))
        else:
            left += [int(points.ties[node, FIRST]), int(points.ties[node, SECOND])]
    return found


def _arrays(client: int) -> dict[str, np.ndarray]:
    """Return all that the solver of a client is given, in the order of its numbers."""
    world = CLIENTS[client].scene.world
    stepping = world.stepping
    points, in_turn = stepping.manifolds.points, stepping.in_turn
    notes = points.notes
    names = [LINKS, LISTED, RANKED, PAIRS, TABLE]
    count, listed, ranked, pairs, table = notes[names].tolist()
    links = points.links[:count]
    found = {
        "turns": points.turns,
        "ages": points.ages,
        "tree places": points.tree_places,
        "links": points.links,
        "firsts": points.firsts[links],
        "sizes": points.sizes,
        "bounds": points.bounds[links],
        "seats": points.seats[links],
        "boxes": points.nodes[points.leaves[links]],
        "order": np.array(_order(points)),
        "pairs": points.pairs[:, :listed],
        "ranked": points.ranked[:2, :ranked],
        "checked": notes[[CHECKED]],
        "keys": points.keys[table, :pairs],
        "counts": points.counts[table, :pairs],
        "slots": points.slots[: world.live_data.ncon],
        "rules": in_turn._solver.rules,
    }
    counts = found["counts"]
    found["points"] = np.concatenate(
        [np.zeros((0, 17)), *(points.points[table, k, :count] for k, count in enumerate(counts.tolist()))]
    )
    for name in in_turn._surface._fields:
        found[f"surface: {name}"] = getattr(in_turn._surface, name)
    del found["surface: base"]  # work array
    hulls, spans = found.pop("surface: hulls"), found["surface: spans"]
    found["surface: spans"] = spans[:, 1]  # where they begin depends on which hulls were there before
    found["corners"] = np.concatenate([np.zeros((0, 3)), *(hulls[at : at + count] for at, count in spans)])
    for name in ("slot", "limit_slot", "equality_order", "equality_slot", "equality_tree", "equality_site"):
        found[name] = getattr(in_turn._mechanism, name)
    data = world.live_data
    for name in ("qpos", "qvel", "qacc", "xpos", "qfrc_constraint", "eq_active"):
        found[name] = getattr(data, name)
    found["contacts"] = data.contact.pos
    return {name: np.array(values) for name, values in found.items()}


def _chain(base: int, links: int, client: int = 0) -> int:
    """Create an arm of three hinges on a free base of 2 kg."""
    count = 3
    return p.createMultiBody(
        2.0,
        base,
        basePosition=[0.6, 0, 0.5],
        linkMasses=[0.5] * count,
        linkCollisionShapeIndices=[links] * count,
        linkVisualShapeIndices=[-1] * count,
        linkPositions=[[0, 0, 0.3]] * count,
        linkOrientations=[[0, 0, 0, 1]] * count,
        linkInertialFramePositions=[[0, 0, 0]] * count,
        linkInertialFrameOrientations=[[0, 0, 0, 1]] * count,
        linkParentIndices=list(range(count)),
        linkJointTypes=[p.JOINT_REVOLUTE] * count,
        linkJointAxis=[[0, 1, 0]] * count,
        physicsClientId=client,
    )


class _Program:
    """A random program: the same commands for each client that has the same seed."""

    def __init__(self, client: int, seed: int) -> None:
        self.rng, self.client = np.random.default_rng(seed), client
        p.setGravity(0, 0, -9.81, physicsClientId=client)
        self.plane = p.createMultiBody(0, p.createCollisionShape(p.GEOM_PLANE, physicsClientId=client),
                                       physicsClientId=client)  # fmt: skip
        of = {"physicsClientId": client}
        self.shapes = [
            p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.1, 0.12, 0.08], **of),
            p.createCollisionShape(p.GEOM_SPHERE, radius=0.1, **of),
            p.createCollisionShape(p.GEOM_CYLINDER, radius=0.1, height=0.2, **of),
            p.createCollisionShape(p.GEOM_CAPSULE, radius=0.08, height=0.1, **of),
            p.createCollisionShapeArray(
                [p.GEOM_BOX, p.GEOM_SPHERE],
                halfExtents=[[0.1, 0.1, 0.1], [0, 0, 0]],
                radii=[0.0, 0.1],
                collisionFramePositions=[[0, 0, 0], [0, 0, 0.15]],
                **of,
            ),
            *(p.createCollisionShape(p.GEOM_MESH, vertices=corners, **of) for corners in _HULLS),
        ]
        self.bodies: list[int] = []
        self.held: list[int] = []
        self.arm = _chain(self.shapes[0], self.shapes[3], client)

    def change(self) -> None:
        rng, of = self.rng, {"physicsClientId": self.client}
        match int(rng.integers(10)):
            case 0 | 1 | 2 | 3:
                for _ in range(int(rng.integers(1, 3))):
                    mass = float(rng.choice([0.0, 1.0, 1.0, 2.0]))
                    place = [*rng.uniform(-0.3, 0.3, 2), rng.uniform(0.2, 0.8)]
                    shape = int(rng.choice(self.shapes))
                    self.bodies.append(p.createMultiBody(mass, shape, -1, place, **of))
            case 4 | 5 | 6 if self.bodies:
                place = -1 if rng.random() < 0.6 else int(rng.integers(len(self.bodies)))
                p.removeBody(self.bodies.pop(place), **of)
                self.held = [k for k in self.held if k in _constraints(self.client)]
            case 7 if self.bodies:
                body = int(rng.choice(self.bodies))
                kind = int(rng.choice([p.JOINT_FIXED, p.JOINT_POINT2POINT]))
                other, link = (self.arm, int(rng.integers(-1, 3))) if rng.random() < 0.5 else (-1, -1)
                place = [0, 0, 0.1] if other >= 0 else [0, 0, 0.5]
                if p.getDynamicsInfo(body, -1, **of)[0] > 0.0:
                    made = p.createConstraint(body, -1, other, link, kind, [0, 0, 1], [0, 0, 0], place, **of)
                    p.changeConstraint(made, maxForce=50, **of)
                    self.held.append(made)
            case 8 if self.held:
                p.removeConstraint(self.held.pop(int(rng.integers(len(self.held)))), **of)
            case _:
                if self.bodies:
                    body, on = int(rng.choice(self.bodies)), int(rng.integers(2))
                    p.setCollisionFilterPair(body, self.arm, -1, int(rng.integers(-1, 3)), on, **of)
                    p.changeDynamics(body, -1, lateralFriction=float(rng.uniform(0.3, 0.9)), **of)
                    p.setCollisionFilterGroupMask(body, -1, 1, int(rng.integers(1, 4)), **of)


def _constraints(client: int) -> list[int]:
    count = p.getNumConstraints(physicsClientId=client)
    return [p.getConstraintUniqueId(k, physicsClientId=client) for k in range(count)]


def _run(seed: int, look: Callable[[int], Any]) -> list[Any]:
    client = p.connect(p.DIRECT)
    program, found = _Program(client, seed), []
    for step in range(STEPS):
        if step % 3 == 0:
            program.change()
        if step % 20 == 19:
            p.setJointMotorControl2(program.arm, 1, p.POSITION_CONTROL, 0.3, force=20, physicsClientId=client)
        p.stepSimulation(physicsClientId=client)
        found.append(look(client))
    p.disconnect(client)
    return found


@pytest.mark.parametrize("seed", range(6))
def test_rows_that_change_one_by_one_are_those_of_a_full_look_up(
    seed: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    counts = [0]
    whole = Manifolds._bind
    with monkeypatch.context() as counting:

        def bind(self: Manifolds, *given: Any) -> None:
            counts[0] += 1
            whole(self, *given)

        counting.setattr(Manifolds, "_bind", bind)
        one_by_one = _run(seed, _arrays)
        few, counts[0] = counts[0], 0
        _looked_up_whole(counting)
        at_once = _run(seed, _arrays)
    assert few < 0.8 * counts[0]  # others needed a compile
    for step, (ours, theirs) in enumerate(zip(one_by_one, at_once, strict=True)):
        for name, values in ours.items():
            assert np.array_equal(values, theirs[name], equal_nan=True), (step, name)


def _reported(client: int) -> Any:
    of = {"physicsClientId": client}
    bodies = [p.getBodyUniqueId(k, **of) for k in range(p.getNumBodies(**of))]
    return (
        [p.getBasePositionAndOrientation(body, **of) for body in bodies],
        [p.getJointStates(body, range(p.getNumJoints(body, **of)), **of) for body in bodies],
        p.getContactPoints(**of),
    )


@pytest.mark.parametrize("seed", range(3))
def test_contacts_and_efforts_of_the_last_step_outlast_changes(
    seed: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    def look(client: int) -> Any:
        """Read what the last step left after another body came, and after it went."""
        of, scene = {"physicsClientId": client}, CLIENTS[client].scene
        if keeps_always:
            scene.last_step.keep()
        before = _reported(client)
        box = p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.05] * 3, **of)
        made = p.createMultiBody(1.0, box, -1, [5, 5, 5], **of)
        present = _reported(client)
        if keeps_always:
            scene.last_step.keep()
        p.removeBody(made, **of)
        return before, present, _reported(client)

    keeps_always = False
    ours = _run(seed, look)
    for before, present, after in ours:
        assert before[1] == after[1] and before[1] == present[1][:-1]
        _expect_points(present[2], before[2])
        _expect_points(after[2], before[2])
    keeps_always = True
    for theirs, mine in zip(_run(seed, look), ours, strict=True):
        for whole, single in zip(theirs, mine, strict=True):
            assert whole[:2] == single[:2]
            _expect_points(whole[2], single[2])


def _expect_points(found: Any, wanted: Any) -> None:
    """Compare contacts that a compiled loop lists with those that are kept, which NumPy computes."""
    assert [point[:5] for point in found] == [point[:5] for point in wanted]
    for one, two in zip(found, wanted, strict=True):
        numbers = [np.hstack(point[5:]).astype(float) for point in (one, two)]
        np.testing.assert_allclose(*numbers, rtol=1e-11, atol=1e-11)


@pytest.mark.parametrize("compiles", [False, True])
def test_constraints_of_each_kind_come_again_without_a_compile(client: int, compiles: bool) -> None:
    of, states = {"physicsClientId": client}, list[Any]()
    for is_twin in (False, True):
        if is_twin:
            p.disconnect(client)
            of["physicsClientId"] = client = p.connect(p.DIRECT)
        world, states_of = CLIENTS[client].scene.world, list[Any]()
        states.append(states_of)
        program, zero, models = _Program(client, 0), [0, 0, 0], set()
        cube, arm = p.createMultiBody(1.0, program.shapes[0], -1, [0, 0, 1.0], **of), program.arm
        for _ in range(4):
            for (parent, link), (child, other), kind in (
                ((cube, -1), (-1, -1), p.JOINT_POINT2POINT),
                ((cube, -1), (-1, -1), p.JOINT_FIXED),
                ((cube, -1), (arm, 2), p.JOINT_FIXED),
                ((cube, -1), (arm, -1), p.JOINT_POINT2POINT),
                ((arm, 0), (arm, 1), p.JOINT_GEAR),
                ((arm, 1), (arm, 2), p.JOINT_GEAR),
            ):
                if is_twin and compiles:
                    world.mark_stale()
                made = p.createConstraint(
                    parent, link, child, other, kind, [0, 1, 0], zero, [0, 0, 0.2], **of
                )
                if kind == p.JOINT_GEAR:
                    p.changeConstraint(made, gearRatio=-1.0, maxForce=100, **of)
                for _ in range(3):
                    p.stepSimulation(**of)
                states_of.append([world.live_data.qpos.tolist(), p.getConstraintState(made, **of)])
                p.removeConstraint(made, **of)
                p.stepSimulation(**of)
                models.add(id(world.live_model))
        assert (is_twin and compiles) or len(models) <= 4  # one for each number of rows
    assert states[0] == states[1]


def test_a_constraint_that_takes_the_rows_of_another_joins_other_bodies(client: int) -> None:
    """A cube held to the world, then to an arm: numbers of PyBullet 3.2.7, which knows no rows."""
    cube_at = [
        [0.0, 0.0, 0.84],
        [0.0, 0.0, 0.712],
        [0.0, 0.0, 0.6096],
        [0.0, 0.0, 0.507466],
        [0.025381, 0.0, 0.653851],
        [0.060015, 0.0, 0.760726],
        [0.090907, 0.0, 0.839633],
        [0.12169, 0.0, 0.91809],
    ]
    p.setGravity(0, 0, -9.81)
    box = p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.1, 0.12, 0.08])
    capsule = p.createCollisionShape(p.GEOM_CAPSULE, radius=0.08, height=0.1)
    arm, zero, found = _chain(box, capsule), [0, 0, 0], list[Any]()
    cube = p.createMultiBody(1.0, box, -1, [0, 0, 1.0])
    for child in ((-1, -1), (arm, 2)):
        held = p.createConstraint(cube, -1, *child, p.JOINT_POINT2POINT, [0, 1, 0], zero, [0, 0, 0.2])
        for step in range(4):
            if step == 3:
                p.removeConstraint(held)
            p.stepSimulation()
            found.append(p.getBasePositionAndOrientation(cube)[0])
    np.testing.assert_allclose(found, cube_at, atol=1e-6)
    joints = [state[0] for state in p.getJointStates(arm, range(3))]
    np.testing.assert_allclose(joints, [0.000316, -0.087375, -0.1179], atol=1e-6)
