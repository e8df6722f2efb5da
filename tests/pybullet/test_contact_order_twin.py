"""The compiled order of contacts is that of a plain version, in worlds of random bodies."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from plain_box_tree import BoxTree, Node

from roboyard import pybullet as p
from roboyard.pybullet.connections import CLIENTS
from roboyard.sim.stepping.broad_phase.link_boxes import REST
from roboyard.sim.stepping.impulses import contact_order
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

    def __init__(self, model: Any, surface: Any, links: dict[int, list[int]]) -> None:
        """Start without pairs. links: geoms of MuJoCo's bodies, in the order of creation."""
        self.model, self.links = model, links
        self.parts, self.covers, self.compound = surface.parts, surface.covers, surface.compound
        self.visits = surface.visits
        self.entered: list[int] = []
        """Links in the order in which they entered last."""
        self.tree, self.leaves = BoxTree(), dict[int, Node]()
        self.pairs: list[tuple[int, int]] = []
        self.ranked: list[tuple[int, int]] = []
        self.lists: dict[tuple[int, int], list[tuple[int, int]]] = {}
        """Pairs of parts of two compounds with ranks, the last of which takes the place of one that ends."""
        self.checked, self.added, self.is_refreshed = 0, 0, False
        self.trees = model.body_treeid
        self.places = list(dict.fromkeys(int(self.trees[k]) for k in links if self.trees[k] >= 0))

    def _tight(self, data: Any) -> tuple[dict[int, np.ndarray], dict[int, np.ndarray]]:
        """Return the least and largest coordinates of links and geoms: (2, 3) each."""
        of_links, of_geoms = {}, {}
        for link, geoms in self.links.items():
            place, turn = data.xpos[link], data.xmat[link].reshape(3, 3)
            if self.model.geom_type[geoms[0]] == 0:
                of_links[link] = np.array([[-1e18] * 3, [1e18] * 3])
            else:
                of_links[link] = _turned(self.covers[link, :4], place, turn, self.covers[link, 4])
            for geom in geoms:
                of_geoms[geom] = _turned(self.parts[geom, :4], place, turn, self.parts[geom, 4])
        return of_links, of_geoms

    def _may_touch(self, one: int, two: int) -> bool:
        model, (a, b) = self.model, (self.links[one][0], self.links[two][0])
        kind, affinity = model.geom_contype, model.geom_conaffinity
        one, two = sorted((one, two))
        return bool(
            model.body_weldid[one] != model.body_weldid[two]
            and kind[a] & affinity[b] | kind[b] & affinity[a]
            and (one << 16) + two not in model.exclude_signature
        )

    def _add_pairs(self, link: int) -> int:
        """Add new pairs; return how many boxes the link's meets."""
        found = [other for other in self.tree.meeting(self.leaves[link].box) if other != link]
        for other in found:
            pair = min(link, other), max(link, other)
            if self._may_touch(*pair) and pair not in self.pairs:
                self.pairs.append(pair)
        return len(found)

    def refresh(self, links: list[int], data: Any) -> None:
        """Let each of some links leave and come back."""
        self.is_refreshed = True
        tight, _ = self._tight(data)
        for link in links:
            self.tree.remove(self.leaves[link])
            place = 0
            while place < len(self.pairs):
                if link in self.pairs[place]:
                    self._end_pair(place)
                else:
                    place += 1
            self.leaves[link] = self.tree.add(tight[link], link)
            self.entered.remove(link)
            self.entered.append(link)
            self.added += self._add_pairs(link)

    def _end_pair(self, place: int) -> None:
        one, two = self.pairs[place]
        for pair in self.lists.pop((one, two), []):
            self._end_rank(pair)
        for a in self.links[one]:
            for b in self.links[two]:
                self._end_rank((min(a, b), max(a, b)))
        _take_out(self.pairs, place)

    def _end_rank(self, pair: tuple[int, int]) -> None:
        if pair in self.ranked:
            _take_out(self.ranked, self.ranked.index(pair))

    def meet(self, data: Any) -> None:
        """Update the pairs for a step's places of the bodies."""
        tight, of_geoms = self._tight(data)
        met, has_moved = 1 + self.added, self.is_refreshed
        self.added, self.is_refreshed = 0, False
        for link in self.links:
            if link not in self.leaves:
                self.leaves[link] = self.tree.add(tight[link], link)
                self.entered.append(link)
                met += self._add_pairs(link)
                has_moved = True
        for link in self.links:
            enlarged, leaf = _wider(tight[link], 0.02), self.leaves[link]
            if (enlarged[0] < leaf.box[0] - REST).any() or (enlarged[1] > leaf.box[1] + REST).any():
                self.tree.move(leaf, enlarged)
                met += self._add_pairs(link)
                has_moved = True
        if has_moved:
            self.tree.improve()
            self._end_pairs(met)
        else:
            self.tree.way += 1
        for links in self.pairs:
            self._rank(links, of_geoms, data)

    def _rank(self, links: tuple[int, int], of_geoms: dict[int, np.ndarray], data: Any) -> None:
        """Give pairs of shapes ranks, then end those of parts whose boxes have parted."""
        first, second = sorted(links, key=self._place)
        has_parts, listed = bool(self.compound[self.links[first][0]]), self.lists.setdefault(links, [])
        is_list = bool(self.compound[self.links[second][0]])
        for a, b in _descend(self._tree(first), self._tree(second)):
            pair = min(a, b), max(a, b)
            if pair in self.ranked or (has_parts and not _meet(of_geoms[a], of_geoms[b])):
                continue
            if has_parts and not self._meet_along(data, (a, first), (b, second)):
                continue
            self.ranked.append(pair)
            if is_list:
                listed.append(pair)
        pairs = [(min(a, b), max(a, b)) for a in self.links[first] for b in self.links[second]]
        for pair in listed.copy() if is_list else pairs:
            if has_parts and pair in self.ranked and not _meet(of_geoms[pair[0]], of_geoms[pair[1]]):
                self._end_rank(pair)
                if is_list:
                    _take_out(listed, listed.index(pair))

    def _meet_along(self, data: Any, one: tuple[int, int], two: tuple[int, int]) -> bool:
        """Return whether boxes of two parts meet along the axes of the first one's link."""
        (a, link), (b, other) = one, two
        axes = _axes(self.covers[link])
        if axes is None:
            return True
        turn, away = data.xmat[link].reshape(3, 3), data.xmat[other].reshape(3, 3)
        across = axes @ turn.T @ away
        own, others = self.parts[a], self.parts[b]
        half = np.abs(own[1:4] @ axes.T).sum(axis=0) + own[4]
        frame = _axes(self.covers[other]) if self.compound[b] else None
        if frame is None:
            half = half + np.abs(others[1:4] @ across.T).sum(axis=0) + others[4]
        else:
            inner = np.abs(others[1:4] @ frame.T).sum(axis=0) + others[4]
            half = half + np.abs(across @ frame.T) @ inner
        gap = data.xpos[link] + turn @ own[0] - data.xpos[other] - away @ others[0]
        return bool((np.abs(axes @ turn.T @ gap) <= half).all())

    def _place(self, link: int) -> tuple[int, int]:
        """Return what is less for the link of two that Bullet lists first."""
        geom = self.links[link][0]
        kind = 2 if self.model.geom_type[geom] == 0 else 0 if self.compound[geom] else 1
        return kind, self.entered.index(link)

    def _tree(self, link: int) -> Any:
        """Return a link's tree: a geom, or both sides of a node, of which the first one is visited first."""
        geoms = self.links[link]

        def below(node: int, found: list[int]) -> Any:
            if len(found) == 1:
                return found[0]
            side = abs(int(self.visits[geoms[node], 1]))
            return below(node + 1, found[:side]), below(node + side, found[side:])

        return below(0, [geoms[self.visits[geom, 0]] for geom in geoms])

    def _end_pairs(self, fresh: int) -> None:
        left = min(len(self.pairs), max(fresh, len(self.pairs) // 10))
        at = self.checked
        for _ in range(left):
            place = at % len(self.pairs)
            one, two = self.pairs[place]
            if _meet(self.leaves[one].box, self.leaves[two].box) and self._may_touch(one, two):
                at += 1
            else:
                self._end_pair(place)
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
            one, two = (int(self.trees[self.model.geom_bodyid[geom]]) for geom in pair)
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


def _turned(box: np.ndarray, place: np.ndarray, turn: np.ndarray, more: np.ndarray) -> np.ndarray:
    middle, *edges = box @ turn.T
    half = np.abs(edges).sum(axis=0) + more
    return place + middle + np.array([-half, half])


def _axes(cover: np.ndarray) -> np.ndarray | None:
    """Return the axes (3, 3) of a box, None for one without."""
    lengths = np.linalg.norm(cover[1:4], axis=1)
    return cover[1:4] / lengths[:, None] if lengths.all() else None


def _descend(one: Any, two: Any) -> Iterator[tuple[Any, Any]]:
    """Return the pairs of leaves of two trees that are gone down at once, the second one's sides in turn."""
    sides, others = one if isinstance(one, tuple) else (one,), two if isinstance(two, tuple) else (two,)
    if len(sides) + len(others) == 2:
        yield one, two
        return
    for b in others:
        for a in sides:
            yield from _descend(a, b)


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


def _links_of(model: Any, turns: list[int]) -> dict[int, list[int]]:
    """Return the geoms of MuJoCo's bodies, in the order of creation."""
    links = dict[int, list[int]]()
    for geom in turns:
        links.setdefault(int(model.geom_bodyid[geom]), []).append(geom)
    return links


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
            turns = points.turns[: points.notes[SHAPES]].tolist()
            order = _Order(model, in_turn._surface, _links_of(model, turns))
        for body in filtered:
            rows = world.body_by_id[CLIENTS[client].scene.bodies[body].body.id].mujoco_ids
            order.refresh(rows.tolist(), data)
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
        ranks = [tuple(pair) for pair in points.ranked[:2, :ranked].T.tolist()]
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
