"""Closest and deepest points of cores are those of closed forms, and of other algorithms."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import linprog, nnls
from scipy.spatial.transform import Rotation

from roboyard.sim.stepping.narrow_phase.closest_points import (
    AROUND,
    BOX,
    CAPSULE,
    CYLINDER,
    FAR,
    FIRST,
    FLAT,
    FOUND,
    MESH,
    SECOND,
    SPHERE,
    closest_of_segments,
    closest_points,
)
from roboyard.sim.stepping.narrow_phase.deepest_points import WORK, deepest_points

SIGNS = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float)


def _work(*cores: tuple[np.ndarray, np.ndarray, np.ndarray]) -> np.ndarray:
    """Place, axes and half sizes of two cores."""
    work = np.zeros(WORK)
    for at, (place, axes, half) in zip((FIRST, SECOND), cores, strict=True):
        work[at : at + 15] = np.concatenate([place, np.ravel(axes), half])
    return work


def _random_pair(rng: np.random.Generator, way: float):
    """Return hulls of random points, about so far apart: corners, spans, corners in the world, and work."""
    hulls = [rng.normal(size=(n, 3)) * 0.1 for n in (8, 12)]
    axes = [Rotation.from_quat(rng.normal(size=4)).as_matrix() for _ in hulls]
    places = [np.zeros(3), way * rng.normal(size=3)]
    corners = [h @ a.T + x for h, a, x in zip(hulls, axes, places, strict=True)]
    work = _work(*((x, a, np.zeros(3)) for x, a in zip(places, axes, strict=True)))
    return np.concatenate(hulls), np.array([[0, 8], [8, 12]], np.int32), corners, work


def _distance(one: np.ndarray, two: np.ndarray) -> float:
    """The distance of two hulls, by least squares over the shares of their corners, which sum up to 1."""
    n, m = len(one), len(two)
    sums = 1e4 * np.array([[1] * n + [0] * m, [0] * n + [1] * m])
    shares, _ = nnls(np.vstack([np.c_[one.T, -two.T], sums]), [0, 0, 0, 1e4, 1e4])
    return float(np.linalg.norm(shares[:n] @ one - shares[n:] @ two))


def _overlap(one: np.ndarray, two: np.ndarray) -> bool:
    """Whether two hulls have a point in common, by a linear program."""
    n, m = len(one), len(two)
    equal = np.vstack([np.c_[one.T, -two.T], np.r_[np.ones(n), np.zeros(m)], np.r_[np.zeros(n), np.ones(m)]])
    return linprog(np.zeros(n + m), A_eq=equal, b_eq=[0, 0, 0, 1, 1], bounds=(0, None)).status == 0


def test_hulls_apart_have_the_distance_of_least_squares():
    rng = np.random.default_rng(1)
    compared = 0
    for _ in range(15):
        hulls, spans, (one, two), work = _random_pair(rng, 0.35)
        if _overlap(one, two):
            continue
        compared += 1
        found = closest_points(MESH, MESH, hulls, spans, 0, 1, 0.0, FAR, work)
        assert found == pytest.approx(_distance(one, two), abs=1e-6)
        assert np.linalg.norm(work[FOUND : FOUND + 3] - work[FOUND + 3 : FOUND + 6]) == pytest.approx(found)
    assert compared > 6


def test_hulls_that_overlap_come_apart_by_the_way_and_by_no_shorter_one():
    rng = np.random.default_rng(2)
    compared = 0
    for _ in range(15):
        hulls, spans, (one, two), work = _random_pair(rng, 0.05)
        if closest_points(MESH, MESH, hulls, spans, 0, 1, 0.0, FAR, work) != AROUND:
            assert not _overlap(one, two)
            continue
        compared += 1
        depth = -deepest_points(MESH, MESH, hulls, spans, 0, 1, work)
        way = work[FOUND + 6 : FOUND + 9] * depth
        assert depth > 0
        assert not _overlap(one + 1.0001 * way, two)
        assert _overlap(one + 0.999 * way, two)
        others = rng.normal(size=(6, 3))
        for other in 0.999 * depth * others / np.linalg.norm(others, axis=1)[:, None]:
            assert _overlap(one + other, two)
        np.testing.assert_allclose(work[FOUND + 3 : FOUND + 6] - work[FOUND : FOUND + 3], way, atol=1e-9)
    assert compared > 6


@pytest.mark.parametrize("kind", [SPHERE, CAPSULE])
def test_a_ball_and_a_capsule_beside_a_box(kind: int):
    """Sampled points of the segment, clamped to the box."""
    rng, nothing, spans = np.random.default_rng(3), np.zeros((0, 3)), np.zeros((2, 2), np.int32)
    half = np.array([0.3, 0.2, 0.1])
    for _ in range(30):
        axes, place = Rotation.from_quat(rng.normal(size=4)).as_matrix(), rng.normal(size=3)
        length = 0.2 if kind == CAPSULE else 0.0
        points = place + np.linspace(-length, length, 2001)[:, None] * axes[:, 2]
        wanted = np.linalg.norm(points - np.clip(points, -half, half), axis=1).min()
        if wanted < 1e-3:
            continue
        work = _work((np.zeros(3), np.eye(3), half), (place, axes, np.array([0, 0, length])))
        found = closest_points(BOX, kind, nothing, spans, 0, 1, 0.0, FAR, work)
        assert found == pytest.approx(wanted, abs=1e-5)


def test_a_cylinder_over_a_box_is_as_high_as_its_lowest_rim():
    work = _work(
        (np.zeros(3), np.eye(3), np.ones(3)),
        (
            np.array([0.1, 0.2, 2.0]),
            Rotation.from_euler("x", 0.3).as_matrix(),
            np.array([0.3, 0.3, 0.4]),
        ),
    )
    spans = np.zeros((2, 2), np.int32)
    found = closest_points(BOX, CYLINDER, np.zeros((0, 3)), spans, 0, 1, FLAT, FAR, work)
    assert found == pytest.approx(1.0 - 0.4 * np.cos(0.3) - 0.3 * np.sin(0.3), abs=1e-9)


def test_segments():
    """Crossed ones, and one beyond the other's end."""
    turned = Rotation.from_euler("x", 90, degrees=True).as_matrix()
    half = np.array([0, 0, 1.0])
    work = _work((np.zeros(3), np.eye(3), half), (np.array([0.5, 0.2, 0.3]), turned, half))
    assert closest_of_segments(work) == pytest.approx(0.5)
    np.testing.assert_allclose(work[FOUND : FOUND + 6], [0, 0, 0.3, 0.5, 0, 0.3], atol=1e-12)
    work = _work((np.zeros(3), np.eye(3), half), (np.array([0, 0, 2.5]), np.eye(3), half))
    assert closest_of_segments(work) == pytest.approx(0.5)


def test_corners_of_boxes_are_those_of_hulls():
    """A box is the hull of its corners, whichever of both finds the points."""
    rng = np.random.default_rng(4)
    half = np.array([0.1, 0.2, 0.15])
    hulls, spans = np.concatenate([SIGNS * half, SIGNS * half]), np.array([[0, 8], [8, 8]], np.int32)
    for _ in range(20):
        poses = [
            (x, Rotation.from_quat(rng.normal(size=4)).as_matrix(), half)
            for x in (np.zeros(3), rng.normal(size=3))
        ]
        work = _work(*poses)
        as_boxes = closest_points(BOX, BOX, hulls, spans, 0, 1, FLAT, FAR, work)
        assert closest_points(MESH, MESH, hulls, spans, 0, 1, FLAT, FAR, work) == pytest.approx(
            as_boxes, abs=1e-12
        )
