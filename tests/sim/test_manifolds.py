"""The compiled loop over kept contact points does what a plain one in Python does."""

from __future__ import annotations

from itertools import combinations

import numpy as np

from roboyard.sim.stepping import manifold_kernels as kernels
from roboyard.sim.stepping.narrow_phase.fields import no_fields
from roboyard.sim.stepping.step_row_kernels import Contacts

FIELD, SPHERE, BOX, MESH = 1, 2, 6, 7
REACH = 0.01


def _rotation(rng: np.random.Generator, angle: float) -> np.ndarray:
    x, y, z = rng.normal(size=3) * angle
    skew = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    left, _, right = np.linalg.svd(np.eye(3) + skew)
    return left @ right


class _Point:
    """A kept point: places on both bodies, normal, last gap, whether it was held, and its contact."""

    def __init__(self, one: np.ndarray, two: np.ndarray, place: tuple[np.ndarray, int, float]) -> None:
        self.one, self.two, self.held = one, two, False
        self.normal, self.contact, self.gap = place


def _state(point: _Point, frames: dict, pair: tuple[int, int]) -> tuple[float, float, np.ndarray]:
    (p1, r1), (p2, r2) = frames[pair[0]], frames[pair[1]]
    a, b = p1 + r1 @ point.one, p2 + r2 @ point.two
    gap = (b - a) @ point.normal
    return gap, float(np.linalg.norm(b - a - gap * point.normal)), (a + b) / 2


def _least_useful(points: list[_Point], fresh: _Point, dist: float, every: bool) -> int:
    """Return the point that a fifth one replaces; -1 where the others have contacts of this step.

    every: whether points that have a contact of this step are replaced, too.
    """
    gaps = [point.gap for point in points]
    deepest = int(np.argmin(gaps)) if min(gaps) < dist else -1
    areas = []
    for m in range(4):
        a, b, c = (points[k].one for k in range(4) if k != m)
        free = m != deepest and (every or points[m].contact < 0)
        areas.append(np.linalg.norm(np.cross(fresh.one - a, c - b)) if free else -1.0)
    return int(np.argmax(areas)) if max(areas) >= 0.0 else -1


def _twin(
    kept: dict, contacts: list, frames: dict, anchored: set[int], field: int
) -> tuple[dict, list, dict, set[int]]:
    """Update {pair: points}; return it, extra (contact, gap, middle), {contact: gap, middle} held, left ones.

    field: geom of a height field, with which a pair has its kept points and no other contacts.
    """
    new, extra, held, left = {}, [], {}, set()
    for pair in dict.fromkeys(contact[0] for contact in contacts):
        (p1, r1), (p2, r2) = frames[pair[0]], frames[pair[1]]
        points: list[_Point] = list(kept.get(pair, []))
        for point in points:
            point.contact = -1
        mine = [i for i, contact in enumerate(contacts) if contact[0] == pair]
        for i in mine:
            _, position, normal, dist = contacts[i]
            if dist > REACH:
                left |= {i} if field in pair else set()
                continue
            one = r1.T @ (position - dist / 2 * normal - p1)
            fresh = _Point(one, r2.T @ (position + dist / 2 * normal - p2), (normal, i, dist))
            free = [k for k, point in enumerate(points) if point.contact < 0 or field in pair]
            far = {k: np.linalg.norm(points[k].one - fresh.one) for k in free}
            nearest = min(far, key=lambda k: far[k]) if far else -1
            if nearest >= 0 and far[nearest] < REACH:
                gap, slid, middle = _state(points[nearest], frames, pair)
                left |= {points[nearest].contact}
                if points[nearest].held and anchored & set(pair) and gap <= REACH and slid <= REACH:
                    held[i] = gap, middle
                    points[nearest].contact, points[nearest].gap = i, gap
                else:
                    points[nearest] = fresh
            elif len(points) < 4:
                points.append(fresh)
            else:
                place = _least_useful(points, fresh, dist, field in pair)
                if place >= 0:
                    left |= {points[place].contact}
                    points[place] = fresh
        for k in range(len(points) - 1, -1, -1):
            gap, slid, _ = _state(points[k], frames, pair)
            if points[k].contact < 0 and (gap > REACH or slid > REACH):
                points[k] = points[-1]  # the last one takes its place
                points.pop()
            elif points[k].contact < 0:
                points[k].gap = gap
        for point in points:
            if point.contact < 0:
                extra.append((mine[0], *_state(point, frames, pair)[::2]))
            point.held = False
        if points:
            new[pair] = points
    return new, extra, held, left - {-1}


def test_points_are_kept_as_a_plain_loop_keeps_them() -> None:
    rng = np.random.default_rng(5)
    types = np.array([MESH, MESH, BOX, SPHERE, FIELD], np.int32)
    bodies = np.arange(5, dtype=np.int32)
    kinds = np.zeros((8, 8), np.uint8)
    kinds[FIELD, [SPHERE, MESH]] = kinds[[SPHERE, MESH], FIELD] = 1
    kinds[MESH, MESH] = kinds[MESH, BOX] = kinds[BOX, MESH] = 1
    margins, reaches = np.zeros(5), np.full(5, REACH)
    places = rng.normal(size=(5, 3)) * 0.02
    turns = [np.eye(3)] * 5
    tables = [(np.zeros(96, np.int64), np.zeros(96, np.int32), np.zeros((96, 4, 17))) for _ in range(2)]
    source, extra = np.zeros(384, np.int32), np.zeros((384, 13))
    fresh, ends, slots = np.zeros(15), np.zeros(4, np.int64), np.zeros(480, np.int32)
    anchors = np.array([0, 1, 0, 0, 0], np.uint8)
    kept: dict = {}
    before, most, all_held, all_left = 0, 0, 0, 0
    for _ in range(200):
        places = places + rng.normal(size=(5, 3)) * 5e-4
        turns = [turn @ _rotation(rng, 0.01) for turn in turns]
        pairs = [
            pair for pair in combinations(range(5), 2) for _ in range(rng.integers(0, 8 if 4 in pair else 4))
        ]
        if not pairs:
            continue
        normal = np.array([0.0, 0.0, 1.0])
        contacts = [
            (pair, rng.normal(size=3) * np.array([0.02, 0.02, 1e-3]), normal, rng.normal() * 0.004)
            for pair in pairs
        ]
        frame = np.tile(np.concatenate([normal, [1.0, 0, 0, 0, 1, 0]]), (len(pairs), 1))
        count = len(pairs)
        given = Contacts(
            *(np.array(pairs, np.int32), np.zeros(count, np.int32), np.zeros(count, np.int32)),
            *(np.array([c[3] for c in contacts]), np.array([c[1] for c in contacts]), frame),
            *(np.zeros((count, 5)), np.zeros(count), np.zeros(count, np.int32)),
        )
        found = kernels.keep_points(
            *(given, count, kinds, types, bodies, places, np.array(turns).reshape(5, 9), margins, reaches),
            *(anchors, 1.0, before, *tables[0], *tables[1], fresh, source, extra, slots, ends),
            *(np.zeros((0, 4, 3)), np.zeros(0, np.uint8), np.zeros(0, np.int32)),
            *(np.zeros(0), np.zeros((0, 3)), np.zeros((0, 2), np.int32), no_fields()),
        )
        tables.reverse()
        before = int(ends[0])
        frames = dict(enumerate(zip(places, turns, strict=True)))
        ignored = {(0, 3), (2, 3), (2, 4)}
        counted = [(*c[:3], 9.0) if c[0] in ignored else c for c in contacts]
        kept, expected, held, left = _twin(kept, counted, frames, {1}, 4)
        left -= {i for i, c in enumerate(contacts) if c[0] in ignored}
        assert {i for i in range(count) if given.dist[i] >= kernels.AWAY} == left
        assert ends[3] == len(held)
        for i, (gap, middle) in held.items():
            if i in left:
                continue
            np.testing.assert_allclose([given.dist[i], *given.position[i]], [gap, *middle], atol=1e-12)
        assert sorted(source[: int(found)].tolist()) == sorted(i for i, _, _ in expected)
        rows = np.column_stack([source[: int(found)], extra[: int(found), 12], extra[: int(found), :3]])
        wanted = np.array([[i, gap, *middle] for i, gap, middle in expected]).reshape(-1, 5)
        order, sought = np.lexsort(rows.T[::-1]), np.lexsort(wanted.T[::-1])
        np.testing.assert_allclose(rows[order], wanted[sought], atol=1e-12)
        keys, counts, table = tables[0]
        for row in range(before):
            points = kept[divmod(int(keys[row]), 5)]
            assert counts[row] == len(points)
            for m, point in enumerate(points):
                if point.contact >= 0:
                    assert slots[point.contact] == 4 * row + m
                np.testing.assert_allclose(table[row, m, :3], point.one, atol=1e-12)
                point.held = bool(rng.random() < 0.5)
                table[row, m, 15] = point.held
        most = max(most, *(len(points) for points in kept.values()), 0)
        all_held += len(held)
        all_left += len(left)
    assert most == 4
    assert all_held > 20
    assert all_left > 200
