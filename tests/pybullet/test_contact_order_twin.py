"""The compiled order of contacts is that of a plain version, in worlds of random bodies."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from roboyard import pybullet as p
from roboyard.pybullet.connections import CLIENTS
from roboyard.sim.stepping.impulses import contact_order
from roboyard.sim.stepping.impulses.meeting_pairs import SPARE
from roboyard.sim.stepping.impulses.records import (
    CHECKED,
    GROUP,
    LISTED,
    RANGE_END,
    RANGE_START,
    RANK,
    RANKED,
    SHAPES,
    TAKEN_UP,
    WORK,
)  # fmt: skip
from roboyard.sim.stepping.sequential.solution_order import quicksort


class _Order:
    """Bullet's pairs and the order in which it solves them; see `meeting_pairs` and `contact_order`."""

    def __init__(self, model: Any, boxes: np.ndarray, compound: np.ndarray, turns: list[int]) -> None:
        self.model, self.boxes, self.compound, self.turns = model, boxes, compound, turns
        self.wide: dict[int, np.ndarray] = {}
        self.pairs: list[tuple[int, int]] = []
        self.ranked: list[tuple[int, int]] = []
        self.checked, self.added, self.is_refreshed = 0, 0, False
        self.trees = model.body_treeid[model.geom_bodyid]
        self.places = list(dict.fromkeys(int(self.trees[geom]) for geom in turns if self.trees[geom] >= 0))

    def _tight(self, data: Any) -> dict[int, np.ndarray]:
        """Return the least and largest coordinates of geoms: (2, 3) each."""
        found = {}
        for geom in self.turns:
            if self.model.geom_type[geom] == 0:
                found[geom] = np.array([[-1e18] * 3, [1e18] * 3])
                continue
            body = self.model.geom_bodyid[geom]
            turned = self.boxes[geom] @ data.xmat[body].reshape(3, 3).T
            half = np.abs(turned[1:]).sum(axis=0)
            found[geom] = data.xpos[body] + turned[0] + np.array([-half, half])
        return found

    def _may_touch(self, a: int, b: int) -> bool:
        model = self.model
        kind, affinity = model.geom_contype, model.geom_conaffinity
        weld = model.body_weldid[model.geom_bodyid]
        one, two = sorted(model.geom_bodyid[[a, b]].tolist())
        return bool(
            weld[a] != weld[b]
            and kind[a] & affinity[b] | kind[b] & affinity[a]
            and (one << 16) + two not in model.exclude_signature
        )

    def _add_pairs(self, geom: int) -> int:
        """Add new pairs; return how many boxes the geom's meets."""
        met = 0
        for other in reversed(self.turns):
            pair = min(geom, other), max(geom, other)
            meets = other in self.wide and other != geom and _meet(self.wide[geom], self.wide[other])
            met += meets
            if meets and self._may_touch(*pair) and pair not in self.pairs:
                self.pairs.append(pair)
        return met

    def refresh(self, geoms: list[int], data: Any) -> None:
        """Let each of some geoms leave and come back."""
        self.is_refreshed = True
        tight = self._tight(data)
        for geom in geoms:
            place = 0
            while place < len(self.pairs):
                if geom in self.pairs[place]:
                    self._end_rank(self.pairs[place])
                    _take_out(self.pairs, place)
                else:
                    place += 1
            self.wide[geom] = tight[geom]
            self.added += self._add_pairs(geom)

    def _end_rank(self, pair: tuple[int, int]) -> None:
        if pair in self.ranked:
            _take_out(self.ranked, self.ranked.index(pair))

    def meet(self, data: Any) -> None:
        """Update the pairs for a step's places of the bodies."""
        tight = self._tight(data)
        met, has_moved = 1 + self.added, self.is_refreshed
        self.added, self.is_refreshed = 0, False
        for geom in self.turns:
            if geom not in self.wide:
                self.wide[geom] = tight[geom]
                met += self._add_pairs(geom)
                has_moved = True
        for geom in self.turns:
            enlarged = _wider(tight[geom], 0.02)
            if (enlarged[0] < self.wide[geom][0]).any() or (enlarged[1] > self.wide[geom][1]).any():
                is_near = _meet(enlarged, self.wide[geom])
                self.wide[geom] = _wider(tight[geom], 0.02 + SPARE if is_near else 0.02)
                met += self._add_pairs(geom)
                has_moved = True
        if has_moved:
            self._end_pairs(met)
        for pair in self.pairs:
            meets = not self.compound[list(pair)].any() or _meet(tight[pair[0]], tight[pair[1]])
            if not meets:
                self._end_rank(pair)
            elif pair not in self.ranked:
                self.ranked.append(pair)

    def _end_pairs(self, fresh: int) -> None:
        left = min(len(self.pairs), max(fresh, len(self.pairs) // 10))
        at = self.checked
        for _ in range(left):
            place = at % len(self.pairs)
            pair = self.pairs[place]
            if _meet(self.wide[pair[0]], self.wide[pair[1]]) and self._may_touch(*pair):
                at += 1
            else:
                self._end_rank(pair)
                _take_out(self.pairs, place)
        self.checked = at % len(self.pairs) if self.pairs else 0

    def contacts(
        self, geoms: list[tuple[int, int]], apart: list[bool], slots: list[int], joined: np.ndarray
    ) -> list[int]:
        """Return a step's contacts in the order of solution; joined: (n, 2) trees of equalities."""
        group = {tree: place for place, tree in enumerate(self.places)}
        trees = [(int(self.trees[a]), int(self.trees[b])) for a, b in self.pairs]
        for a, b in [*trees, *joined.tolist()]:
            if a >= 0 and b >= 0:
                old, new = group[a], group[b]
                group = {tree: new if key == old else key for tree, key in group.items()}
        items = []
        for rank, pair in enumerate(self.ranked):
            one, two = (int(self.trees[geom]) for geom in pair)
            items.append((group.get(one if one >= 0 else two, -1), rank, 0))
        quicksort(items)
        order = []
        for _, rank, _ in items:
            chain: list[int] = []
            for n, pair in enumerate(geoms):
                if apart[n] or tuple(sorted(pair)) != self.ranked[rank]:
                    continue
                later = [k for k, other in enumerate(chain) if 0 <= slots[n] < slots[other]]
                chain.insert(later[0] if later else len(chain), n)
            order += chain
        loose = [n for n, pair in enumerate(geoms) if not apart[n] and n not in order]
        return order + loose[::-1]


def _wider(box: np.ndarray, width: float) -> np.ndarray:
    return box + np.array([[-width], [width]])


def _meet(one: np.ndarray, two: np.ndarray) -> bool:
    return bool((one[0] <= two[1]).all() and (one[1] >= two[0]).all())


def _take_out(items: list[tuple[int, int]], place: int) -> None:
    """Let the last item take the place of one that ends."""
    last = items.pop()
    if place < len(items):
        items[place] = last


def _random_bodies(rng: np.random.Generator) -> list[int]:
    half = [p.createCollisionShape(p.GEOM_BOX, halfExtents=rng.uniform(0.05, 0.15, 3)) for _ in range(3)]
    shapes = [*half, p.createCollisionShape(p.GEOM_SPHERE, radius=0.1)]
    shapes.append(p.createCollisionShape(p.GEOM_CYLINDER, radius=0.08, height=0.2))
    shapes.append(
        p.createCollisionShapeArray(
            shapeTypes=[p.GEOM_BOX, p.GEOM_SPHERE],
            halfExtents=[[0.1, 0.05, 0.05], [0, 0, 0]],
            radii=[0, 0.07],
            collisionFramePositions=[[0, 0, 0], [0.2, 0, 0]],
        )
    )
    p.createMultiBody(0, p.createCollisionShape(p.GEOM_PLANE))
    p.createMultiBody(0, half[0], basePosition=[0, 0, 0.1])
    bodies = [
        p.createMultiBody(
            rng.uniform(0.5, 2.0),
            shapes[-1 - k % len(shapes)],
            basePosition=[*rng.uniform(-0.4, 0.4, 2), 0.2 + 0.2 * (k // 4)],
        )
        for k in range(14)
    ]
    far = p.createMultiBody(1.0, shapes[3], basePosition=[4, 0, 0.1])
    p.createConstraint(bodies[0], -1, far, -1, p.JOINT_POINT2POINT, [0] * 3, [2, 0, 0], [-2, 0, 0])
    return bodies


def _hanging_spheres() -> int:
    """Return a compound of spheres; just above a block, MuJoCo finds contacts that have no rank."""
    p.createMultiBody(
        0, p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.5, 0.5, 0.1]), basePosition=[-4, 0, 0.1]
    )
    spheres = p.createCollisionShapeArray(
        shapeTypes=[p.GEOM_SPHERE] * 3,
        radii=[0.07] * 3,
        collisionFramePositions=[[0.2 * k, 0, 0] for k in range(3)],
    )
    return p.createMultiBody(1.0, spheres, basePosition=[-4, 0, 1.0])


@pytest.mark.parametrize("seed", range(3))
def test_contacts_are_in_the_order_of_a_plain_version(client: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    p.setGravity(0, 0, -9.81)
    bodies, spheres = _random_bodies(rng), _hanging_spheres()
    world = CLIENTS[client].scene.world
    stepping = world.stepping
    order, most, ended, loose = None, 0, 0, 0
    for step in range(160):
        if step % 10 == 5:
            body = bodies[rng.integers(len(bodies))]
            p.resetBasePositionAndOrientation(body, [*rng.uniform(-0.4, 0.4, 2), 0.6], [0, 0, 0, 1])
            p.resetBaseVelocity(body, rng.normal(size=3), rng.normal(size=3))
            p.resetBasePositionAndOrientation(spheres, [-4, 0, 0.273], [0, 0, 0, 1])
        filtered = list[int]()
        if step % 20 in (7, 8):
            filtered = rng.choice(bodies, 2).tolist()
            p.setCollisionFilterPair(*filtered, -1, -1, 1)
            if step % 20 == 8:
                filtered += [bodies[step // 20]]
                p.setCollisionFilterGroupMask(filtered[2], -1, 1, -1)
        p.stepSimulation()
        model, data, points = world.live_model, world.live_data, stepping.manifolds.points
        in_turn = stepping.in_turn
        if order is None:
            turns, surface = points.turns[: points.notes[SHAPES]].tolist(), in_turn._surface
            order = _Order(model, surface.boxes, surface.compound, turns)
        for body in filtered:
            order.refresh(world.body_by_id[CLIENTS[client].scene.bodies[body].body.id].geom_rows[0], data)
        before = len(order.pairs)
        order.meet(data)
        ended += len(order.pairs) < before
        geoms = [tuple(pair) for pair in data.contact.geom.tolist()]
        surface, mechanism = in_turn._surface, in_turn._mechanism
        apart = (data.contact.dist > surface.reaches[data.contact.geom].min(axis=1)).tolist()
        listed_equalities = mechanism.equality_order[mechanism.equality_order >= 0]
        joined = mechanism.equality_tree[listed_equalities]
        wanted = order.contacts(geoms, apart, points.slots[: len(geoms)].tolist(), joined)
        listed, ranked = points.notes[LISTED], points.notes[RANKED]
        assert [tuple(pair) for pair in points.pairs[:2, :listed].T.tolist()] == order.pairs, step
        ranks = [tuple(points.pairs[:2, place].tolist()) for place in points.ranked[:ranked]]
        assert ranks == order.ranked and points.notes[CHECKED] == order.checked, step
        assert points.sequence[: points.notes[TAKEN_UP]].tolist() == wanted, step
        most = max(most, len(wanted))
        loose = max(loose, sum(tuple(sorted(pair)) not in order.ranked for pair in geoms))
    assert most >= 20 and ended > 20 and loose > 2


def test_pairs_are_sorted_by_groups_as_items_are() -> None:
    rng = np.random.default_rng(2)
    for _ in range(300):
        count = int(rng.integers(0, 40))
        groups = rng.integers(-1, rng.integers(1, 12), count)
        work = np.zeros((WORK, count + 1), np.int32)
        work[GROUP, :count], work[RANK, :count] = groups, np.arange(count)
        contact_order.sort_by_groups(work[RANK], work[GROUP], work[RANGE_START], work[RANGE_END], count)
        items = [(int(group), rank, 0) for rank, group in enumerate(groups)]
        quicksort(items)
        assert work[RANK, :count].tolist() == [rank for _, rank, _ in items]
        assert work[GROUP, :count].tolist() == sorted(groups.tolist())
