"""Repulsion between parts of a soft body: its loops against NumPy, momentum, and a folded cloth."""

from __future__ import annotations

import numpy as np
import pytest

from roboyard.errors import RoboyardError
from roboyard.sim.physics_profile import BULLET, PLAIN, PhysicsProfile
from roboyard.sim.soft import repulsion_kernels as kernels
from roboyard.sim.soft.face_tree import FaceTree, face_tree, shuffled
from roboyard.sim.soft.materials import Springs
from roboyard.sim.world import World

Array = np.ndarray
STEP = 0.004


def ball(n: int = 8, radius: float = 0.05) -> tuple[Array, Array]:
    """Nodes and triangles of a ball with n rows of n nodes between its poles."""
    nodes, cells = [(0.0, 0.0, radius), (0.0, 0.0, -radius)], []
    for i in range(n):
        t = np.pi * (i + 1) / (n + 1)
        for a in 2 * np.pi * np.arange(n) / n:
            nodes.append((radius * np.sin(t) * np.cos(a), radius * np.sin(t) * np.sin(a), radius * np.cos(t)))

    def at(i: int, j: int) -> int:
        return 2 + i * n + j % n

    for j in range(n):
        cells += [(0, at(0, j), at(0, j + 1)), (1, at(n - 1, j + 1), at(n - 1, j))]
        for i in range(n - 1):
            cells += [(at(i, j), at(i + 1, j), at(i + 1, j + 1)), (at(i, j), at(i + 1, j + 1), at(i, j + 1))]
    return np.array(nodes), np.array(cells, dtype=np.int32)


def leaves(tree: FaceTree, count: int, node: int) -> list[int]:
    if node < count:
        return [node]
    return [leaf for child in tree.children[node - count] for leaf in leaves(tree, count, int(child))]


def weights(corners: Array, node: Array, normal: Array, reach: float) -> Array | None:
    """Weights of a node in a face within reach of it, None outside."""
    offset = node - corners[2]
    if abs(offset @ normal) > reach:
        return None
    sides = np.stack([corners[0] - corners[2], corners[1] - corners[2]], axis=1)
    first = np.linalg.lstsq(sides, offset, rcond=None)[0]
    found = np.array([*first, 1 - first.sum()])
    beyond = reach / np.sqrt(0.5 * np.linalg.norm(np.cross(sides[:, 0], sides[:, 1])))
    return found if (found >= -beyond).all() and (found <= 1 + beyond).all() else None


class Twin:
    """`repel` in NumPy, with recursion instead of a stack."""

    def __init__(self, faces: Array, tree: FaceTree, x: Array, speed: Array, mass: Array, margin: float):
        self.faces, self.tree, self.x, self.v, self.mass, self.margin = faces, tree, x, speed, mass, margin
        normals = np.cross(x[faces[:, 1]] - x[faces[:, 0]], x[faces[:, 2]] - x[faces[:, 0]])
        self.normal = list(normals / np.linalg.norm(normals, axis=1, keepdims=True))
        self.angle = [0.0] * len(faces)
        for one, two in tree.children:
            total = self.normal[one] + self.normal[two]
            between = np.arccos(np.clip(self.normal[one] @ self.normal[two], -1, 1))
            self.angle.append(max(self.angle[one], self.angle[two]) + between / 2)
            self.normal.append(total / np.linalg.norm(total))

    def boxes(self, pad: float) -> list[Array]:
        corners = self.x[self.faces], (self.x + STEP * self.v)[self.faces]
        both = np.concatenate(corners, axis=1)
        found = [
            np.stack([low - pad, high + pad]) for low, high in zip(both.min(1), both.max(1), strict=True)
        ]
        for one, two in self.tree.children:
            low, high = np.minimum(found[one][0], found[two][0]), np.maximum(found[one][1], found[two][1])
            found.append(np.stack([low, high]))
        return found

    def pairs(self, pad: float) -> list[tuple[int, int]]:
        """Pairs of faces in the order in which a stack that grows by the same rule gives them."""
        count, boxes, found = len(self.faces), self.boxes(pad), []

        def children(node: int) -> list[int]:
            return [int(c) for c in self.tree.children[node - count]] if node >= count else [node]

        def visit(one: int, two: int) -> None:
            if one == two:
                if one >= count and self.angle[one] > np.pi:
                    a, b = children(one)
                    visit(a, b)
                    visit(b, b)
                    visit(a, a)
            elif (boxes[one][0] <= boxes[two][1]).all() and (boxes[two][0] <= boxes[one][1]).all():
                if one < count and two < count:
                    if not set(self.faces[one]) & set(self.faces[two]):
                        found.append((one, two))
                    return
                for b in reversed(children(two)):
                    for a in reversed(children(one)):
                        visit(a, b)

        visit(2 * count - 2, 2 * count - 2)
        return found

    def run(self, stiffness: float, friction: float) -> int:
        contacts, reach = [], 2 * self.margin
        for pair in self.pairs(self.margin):
            for of, face in (pair, pair[::-1]):
                for node in self.faces[of]:
                    normal = self.normal[face]
                    found = weights(self.x[self.faces[face]], self.x[node], normal, reach)
                    if found is not None:
                        side = 1.0 if (self.x[node] - self.x[self.faces[face, 2]]) @ normal >= 0 else -1.0
                        contacts.append((node, self.faces[face], found, side * normal))
        self.seed = 243703
        self.push(contacts, reach, stiffness, friction)
        return len(contacts)

    def push(self, contacts: list, reach: float, stiffness: float, friction: float) -> None:
        order = list(range(len(contacts)))
        for k in range(len(order)):
            self.seed = (1664525 * self.seed + 1013904223) & 0xFFFFFFFF
            other = self.seed % len(order)
            order[k], order[other] = order[other], order[k]
        for k in order:
            node, face, share, normal = contacts[k]
            overlap = max(0.0, reach - normal @ (self.x[node] - share @ self.x[face]))
            way = self.v[node] - share @ self.v[face]
            closing, most = way @ normal, 0.1 * overlap / STEP
            if closing > most:
                continue
            impulse = -min(stiffness * STEP * overlap, self.mass[node] * (most - closing))
            impulse += 0.5 * self.mass[node] * min(closing, 0.0)
            sliding = way - closing * normal
            length = np.linalg.norm(sliding)
            lost = 0.0
            if length > 2.2e-16:
                lost = (
                    0.5 * self.mass[node] * min(1, max(0, -2 * friction * impulse / self.mass[node] / length))
                )
            change = 2 / (1 + share @ share) / self.mass[node] * (impulse * normal + lost * sliding)
            self.v[face] += share[:, None] * change
            self.v[node] -= change


def repel(faces: Array, x: Array, speed: Array, margin: float, stiffness: float, friction: float) -> int:
    """Call the loop."""
    tree, count = face_tree(faces), len(faces)
    work = np.zeros((8 * tree.height + 16, 2), np.int32), np.zeros((2 * count - 1, 6))
    work += np.zeros((2 * count - 1, 3)), np.zeros(2 * count - 1)
    room = 24 * count
    return kernels.repel(
        *(faces, tree.children, x, 0, np.full(len(x), 0.01), np.zeros(len(x), np.int32)),
        *(margin, stiffness, friction, 0, STEP, *work),
        *(np.zeros((room, 2), np.int32), np.zeros((room, 6)), np.zeros(room, np.int32), speed),
    )


@pytest.mark.parametrize("friction", [0.0, 0.5])
@pytest.mark.parametrize("stiffness", [0.5, 200.0])
def test_the_loop_as_in_numpy(stiffness: float, friction: float) -> None:
    """A ball that is pressed flat to less than the reach."""
    nodes, faces = ball(6)
    rng, faces = np.random.default_rng(4), shuffled(faces)
    x = nodes * [1.0, 0.3, 1.0] + 1e-4 * rng.normal(size=nodes.shape)  # so that no node is in a face's plane
    speed = 0.02 * rng.normal(size=x.shape)
    expected = Twin(faces, face_tree(faces), x, speed.copy(), np.full(len(x), 0.01), 0.008)
    count = expected.run(stiffness, friction)
    found = speed.copy()
    assert repel(faces, x, found, 0.008, stiffness, friction) == count > 100
    np.testing.assert_allclose(found, expected.v, atol=1e-9)
    np.testing.assert_allclose(found.sum(axis=0), speed.sum(axis=0), atol=1e-12)  # momentum
    assert np.abs(found - speed).max() > 1e-4


def test_ways_that_cross_as_by_the_roots_of_a_polynomial() -> None:
    rng, faces = np.random.default_rng(8), np.array([(0, 1, 2)], dtype=np.int32)
    hits = 0
    for _ in range(1500):
        x, v = rng.normal(size=(4, 3)), rng.normal(size=(4, 3)) / STEP
        rows = [np.poly1d([0.0])]
        way = [[np.poly1d([v[k, c] - v[0, c], x[k, c] - x[0, c]]) for c in range(3)] for k in (1, 2, 3)]
        for c in range(3):
            a, b = (c + 1) % 3, (c + 2) % 3
            rows.append((way[0][a] * way[1][b] - way[0][b] * way[1][a]) * way[2][c])
        polynomial = rows[0] + rows[1] + rows[2] + rows[3]
        expected = False
        for root in polynomial.roots:
            if abs(root.imag) < 1e-12 and 0 < root.real <= STEP:
                at = x + root.real * v
                sides = np.stack([at[0] - at[2], at[1] - at[2]], axis=1)
                first = np.linalg.lstsq(sides, at[3] - at[2], rcond=None)[0]
                expected |= bool(min(*first, 1 - first.sum()) > 0)
        assert kernels.passes(faces, 0, x, 0, 3, v, STEP) == expected
        hits += expected
    assert 30 < hits < 1400


def test_trees_hold_each_face_once_and_join_neighbours_first() -> None:
    _, faces = ball()
    given = shuffled(faces)
    assert sorted(map(tuple, given)) == sorted(map(tuple, faces)) and not np.array_equal(given, faces)
    tree = face_tree(given)
    count = len(faces)
    assert len(tree.children) == count - 1
    assert sorted(leaves(tree, count, 2 * count - 2)) == list(range(count))
    one, two = tree.children[0]
    assert len(set(given[one]) & set(given[two])) == 2
    apart = np.array([(0, 1, 2), (3, 4, 5), (6, 7, 8)], dtype=np.int32)
    assert sorted(leaves(face_tree(apart), 3, 4)) == [0, 1, 2]


def fold(n: int = 9) -> tuple[Array, Array]:
    """Nodes and triangles of a cloth whose one half is 0.1 m to 0.15 m over its other half."""
    line = np.linspace(-0.5, 0.5, n)
    nodes = np.array([(abs(x), y, 0.0 if x < 0 else 0.1 + 0.1 * x) for x in line for y in line])
    cells = []
    for i in range(n - 1):
        for j in range(n - 1):
            a = i * n + j
            cells += [(a, a + n, a + n + 1), (a, a + n + 1, a + 1)]
    return nodes, np.array(cells)


@pytest.mark.parametrize("profile", [PLAIN, BULLET], ids=["plain", "bullet"])
@pytest.mark.parametrize("repulsion", [None, 20.0])
def test_halves_of_a_folded_cloth_lie_on_each_other(profile: PhysicsProfile, repulsion: float | None) -> None:
    world = World(profile=profile)
    world.add_box((4.0, 4.0, 0.2), (0, 0, -0.1), mass=0.0)
    nodes, cells = fold()
    material = Springs(stiffness=40.0, damping=0.1, bending_stiffness=1.0)
    cloth = world.add_soft_body(
        nodes, cells, (0, 0, 0.05), mass=0.5, radius=0.02, material=material,
        self_collision=repulsion is not None, repulsion=repulsion,
    )  # fmt: skip
    world.step(100)
    upper = cloth.positions[45:, 2].mean()
    if repulsion is None:
        assert upper < 0.025
    else:
        assert 0.05 < upper < 0.065
    assert cloth.positions[:36, 2].mean() == pytest.approx(0.02, abs=1e-3)


def test_repulsion_must_be_a_number() -> None:
    nodes, cells = fold(3)
    with pytest.raises(RoboyardError, match="repulsion must be"):
        World().add_soft_body(nodes, cells, material=Springs(stiffness=1.0), repulsion=-1.0)
