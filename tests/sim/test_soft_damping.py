"""Damping of soft bodies by the velocities after a step: its loops against dense matrices, and time steps."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from roboyard.sim.physics_profile import BULLET
from roboyard.sim.soft.damping import Damping
from roboyard.sim.soft.damping_kernels import FIXED, ON_A_PLANE, damp, mark_fixed
from roboyard.sim.soft.forces import force_calls
from roboyard.sim.soft.materials import NeoHookean, Springs
from roboyard.sim.soft.rest_shape import Lattice, Solid, lattice, right_handed, solid
from roboyard.sim.soft.stability import parts_of_step
from roboyard.sim.world import World

Array = np.ndarray


def cube() -> tuple[Array, Array]:
    """Nodes and tetrahedra of a cube cut into six."""
    nodes = 0.4 * np.array([(a, b, c) for a in (0, 1) for b in (0, 1) for c in (0, 1)], dtype=float)
    cut = [(0, 4, 6, 7), (0, 6, 2, 7), (0, 2, 3, 7), (0, 3, 1, 7), (0, 1, 5, 7), (0, 5, 4, 7)]
    return nodes, right_handed(nodes, np.array(cut))


def damping_matrix(parts: list[Lattice | Solid], positions: Array) -> Array:
    """Minus the forces of dampers per velocity, by the loops that the explicit steps use."""
    count = positions.size
    found = np.zeros((count, count))
    for k in range(count):
        speed, force, still = np.zeros(count), np.zeros(count), np.zeros(count)
        speed[k] = 1.0
        for given, out in ((speed, force), (np.zeros(count), still)):
            for function, arguments in force_calls(parts, 0, 0, positions, given, out):
                function(*arguments)
        found[:, k] = still - force
    return found


@pytest.mark.parametrize("every", [False, True])
@pytest.mark.parametrize("kinds", ["springs", "solid", "both"])
def test_velocities_as_by_dense_matrices(every: bool, kinds: str) -> None:
    """With one node that is fixed and one that is free in a plane."""
    nodes, cells = cube()
    parts: list[Lattice | Solid] = []
    if kinds != "solid":
        springs = Springs(stiffness=0.0, damping=30.0, damps_all_directions=every, bending_stiffness=0.0)
        parts.append(lattice(nodes, cells, springs))
    if kinds != "springs":
        parts.append(solid(nodes, cells, NeoHookean(mu=2000.0, lam=3000.0, damping=0.1)))
    moved = nodes * [1.1, 0.9, 1.0]
    mass, h, rng = np.full(8, 0.05), 0.004, np.random.default_rng(2)
    speed, normal = rng.normal(size=(8, 3)), np.zeros((8, 3))
    kind = np.zeros(8, np.int32)
    kind[3], kind[5], normal[5] = FIXED, ON_A_PLANE, (0.6, 0.0, 0.8)

    held = np.zeros((4, 24))  # rows of what does not change
    held[:3, 9:12], held[3, 15:18] = np.eye(3), normal[5]
    whole = np.zeros((28, 28))
    whole[:24, :24] = np.diag(np.repeat(mass, 3)) + h * damping_matrix(parts, moved)
    whole[:24, 24:], whole[24:, :24] = held.T, held
    right = np.concatenate([(np.repeat(mass, 3) * speed.ravel()), held @ speed.ravel()])
    expected = np.linalg.solve(whole, right)[:24].reshape(8, 3)

    soft = cast("Any", SimpleNamespace(masses=mass, parts=tuple(parts)))
    found = speed.copy()
    rounds = damp(*Damping(soft)._law, moved, 0, mass, kind, normal, h, np.zeros((5, 8, 3)), found)
    assert 1 < rounds < 60
    np.testing.assert_allclose(found, expected, atol=5e-4)
    assert np.abs(expected - speed).max() > 0.1


def test_what_contacts_decide() -> None:
    """A node that sticks, one that slides, an element that slides, and a node in a corner."""

    def of(*rows: Any) -> Array:
        return np.array(rows, dtype=np.int32)

    up, aside = [0, 0, 1, 0, 1, 0, -1, 0, 0], [1, 0, 0, 0, 1, 0, 0, 0, 1]
    kind, normal = np.zeros(9, np.int32), np.zeros((9, 3))
    mark_fixed(
        of(*[(0, -1)] * 6), of(*[(-1, 0)] * 6), np.arange(0, 18, 3, dtype=np.int32),
        of(*[(-1, -1)] * 2, (-1, 1), *[(-1, -1)] * 3),
        of((-1, 0), (-1, 1), (-1, -1), (-1, 7), (-1, 7), (-1, 8)),
        np.full(6, 3, np.int32), np.array([up, up, up, up, aside, up], dtype=float), np.full((6, 5), 0.5),
        np.array([1.0, 0.1, 0.0, 1.0, 0.5, 0.0, 1.0, 0.4, 0.3, 1.0, 0.5, 0.0, 1.0, 0.5, 0.0, 0.0, 0.0, 0.0]),
        np.array([2], np.int32), 0, of((0, 1, 2), (3, 4, 5)), kind, normal,
    )  # fmt: skip
    assert kind.tolist() == [FIXED, ON_A_PLANE, 0, *[ON_A_PLANE] * 3, 0, FIXED, 0]
    np.testing.assert_array_equal(normal[[1, 3, 4, 5]], [(0.0, 0.0, 1.0)] * 4)


@pytest.mark.parametrize("every", [False, True])
def test_a_node_on_strong_dampers_hangs_by_its_weight(every: bool) -> None:
    """A node of 0.1 kg on two springs of 50 N/m at an angle; explicit steps would have to be shorter."""
    world = World(profile=BULLET, timestep=0.01)
    nodes = np.array([(-0.3, 0.0, 0.0), (0.3, 0.0, 0.0), (0.0, 0.0, -0.4)])
    material = Springs(stiffness=50.0, damping=40.0, damps_all_directions=every)
    body = world.add_soft_body(nodes, [(0, 1, 2)], (0, 0, 1), mass=0.3, material=material)
    body.anchor(0)
    body.anchor(1)
    assert parts_of_step(0.01, *body.fastest_rates) > 10
    assert world.soft.parts(0.01) == 1
    world.step(1)
    held, speed = body.velocities[1:, 2]  # 0.1 dv/dt = -0.1 g - 2 * 40 N s/m (v - held), in one implicit step
    damping = 2 * 40.0 * (1.0 if every else 0.4**2 / 0.5**2)
    assert speed == pytest.approx((-0.1 * 9.81 + damping * held) / (0.1 / 0.01 + damping), rel=1e-3)
    world.step(3000)
    drop = body.positions[2, 2] - 1.0
    length = np.hypot(0.3, drop)
    up = 2 * 50.0 * (length - 0.5) * (-drop / length)
    assert up == pytest.approx(0.1 * 9.81, rel=1e-2)


def test_weight_of_a_damped_body_at_rest_is_carried() -> None:
    """A block of springs with strong dampers comes to rest on a box at the height of one with weak ones."""
    heights = []
    for damping in (0.05, 5.0):
        world = World(profile=BULLET, timestep=0.002)
        world.add_box((2.0, 2.0, 0.2), (0, 0, -0.1), mass=0.0)
        nodes, cells = cube()
        material = Springs(stiffness=300.0, damping=damping, damps_all_directions=True)
        block = world.add_soft_body(nodes, cells, (0, 0, 0.02), mass=1.0, radius=0.01, material=material)
        world.step(3000)
        assert np.abs(block.velocities).max() < 2e-2
        heights.append(block.positions[:, 2].mean())
    assert heights[0] == pytest.approx(heights[1], abs=2e-3)
