"""The compiled loop over kept contact points does what a plain one in Python does."""

from __future__ import annotations

from itertools import combinations

import numpy as np

from roboyard.sim.stepping import manifold_kernels as kernels
from roboyard.sim.stepping.step_row_kernels import Contacts

BOX, MESH = 6, 7
REACH = 0.01


def _rotation(rng: np.random.Generator, angle: float) -> np.ndarray:
    x, y, z = rng.normal(size=3) * angle
    skew = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    left, _, right = np.linalg.svd(np.eye(3) + skew)
    return left @ right


def _twin(kept: dict, contacts: list, frames: dict) -> tuple[dict, list]:
    """Update {pair: [(place on one, place on two, normal)]}; return it and extra (contact, gap, middle)."""
    new, extra = {}, []
    for i, (pair, position, normal, dist) in enumerate(contacts):
        (p1, r1), (p2, r2) = frames[pair[0]], frames[pair[1]]
        points = list(kept.get(pair, []))

        def state(point, p1=p1, r1=r1, p2=p2, r2=r2):
            a, b = p1 + r1 @ point[0], p2 + r2 @ point[1]
            gap = (b - a) @ point[2]
            return gap, np.linalg.norm(b - a - gap * point[2]), (a + b) / 2

        fresh = None
        if dist <= REACH:
            fresh = (
                r1.T @ (position - dist / 2 * normal - p1),
                r2.T @ (position + dist / 2 * normal - p2),
                normal,
            )
            far = [np.linalg.norm(point[0] - fresh[0]) for point in points]
            if far and min(far) < REACH:
                points[int(np.argmin(far))] = fresh
            elif len(points) < 4:
                points.append(fresh)
            else:
                gaps = [state(point)[0] for point in points]
                deepest = int(np.argmin(gaps)) if min(gaps) < dist else -1
                areas = []
                for m in range(4):
                    a, b, c = (points[k][0] for k in range(4) if k != m)
                    areas.append(-1.0 if m == deepest else np.linalg.norm(np.cross(fresh[0] - a, c - b)))
                points[int(np.argmax(areas))] = fresh
        k = 0
        while k < len(points):
            gap, slid, middle = state(points[k])
            if points[k] is not fresh and (gap > REACH or slid > REACH):
                points[k] = points[-1]  # the last one takes its place
                points.pop()
                continue
            if points[k] is not fresh:
                extra.append((i, gap, middle))
            k += 1
        if points:
            new[pair] = points
    return new, extra


def test_points_are_kept_as_a_plain_loop_keeps_them() -> None:
    rng = np.random.default_rng(5)
    types = np.array([MESH, MESH, BOX, 2], np.int32)
    bodies = np.arange(4, dtype=np.int32)
    kinds = np.zeros((8, 8), np.uint8)
    kinds[MESH, MESH] = kinds[MESH, BOX] = kinds[BOX, MESH] = 1
    margins, reaches = np.zeros(4), np.full(4, REACH)
    places = rng.normal(size=(4, 3)) * 0.02
    turns = [np.eye(3)] * 4
    tables = [(np.zeros(8, np.int64), np.zeros(8, np.int32), np.zeros((8, 4, 16))) for _ in range(2)]
    source, extra = np.zeros(32, np.int32), np.zeros((32, 13))
    fresh, ends, slots = np.zeros(15), np.zeros(4, np.int64), np.zeros(40, np.int32)
    anchors = np.zeros(4, np.uint8)
    kept: dict = {}
    before, most = 0, 0
    for _ in range(200):
        places = places + rng.normal(size=(4, 3)) * 5e-4
        turns = [turn @ _rotation(rng, 0.01) for turn in turns]
        pairs = [pair for pair in combinations(range(4), 2) if rng.random() < 0.9]
        normal = np.array([0.0, 0.0, 1.0])
        contacts = [
            (pair, rng.normal(size=3) * np.array([0.05, 0.05, 1e-3]), normal, rng.normal() * 0.004)
            for pair in pairs
        ]
        frame = np.tile(np.concatenate([normal, [1.0, 0, 0, 0, 1, 0]]), (len(pairs), 1))
        count = len(pairs)
        given = Contacts(
            *(np.array(pairs, np.int32), np.zeros(count, np.int32), np.zeros(count, np.int32)),
            *(np.array([c[3] for c in contacts]), np.array([c[1] for c in contacts]), frame),
            *(np.zeros((count, 5)), np.zeros(count)),
        )
        found = kernels.keep_points(
            *(given, count, kinds, types, bodies, places, np.array(turns).reshape(4, 9), margins, reaches),
            *(anchors, 1.0, before, *tables[0], *tables[1], fresh, source, extra, slots, ends),
        )
        tables.reverse()
        before = int(ends[0])
        frames = dict(enumerate(zip(places, turns, strict=True)))
        kept, expected = _twin(
            kept, [c if 3 not in c[0] else (c[0], c[1], c[2], 9.0) for c in contacts], frames
        )
        assert sorted(source[: int(found)].tolist()) == [i for i, _, _ in expected]
        rows = np.column_stack([source[: int(found)], extra[: int(found), 12], extra[: int(found), :3]])
        wanted = np.array([[i, gap, *middle] for i, gap, middle in expected]).reshape(-1, 5)
        order, sought = np.lexsort(rows.T[::-1]), np.lexsort(wanted.T[::-1])
        np.testing.assert_allclose(rows[order], wanted[sought], atol=1e-12)
        most = max(most, *(len(points) for points in kept.values()), 0)
    assert most == 4
