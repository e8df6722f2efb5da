"""Rays, boxes and overlaps, compared with PyBullet 3.2.7 and with geometry."""

from __future__ import annotations

from collections.abc import Callable
from math import sqrt
from pathlib import Path
from typing import Any

import pytest

import roboyard.pybullet as p

MISS = (-1, -1, 1.0, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))


def shapes(p: Any) -> list[int]:
    """A box, a sphere, a cylinder and a capsule in a row along x, at a distance of 2 m."""
    made = [
        p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.3, 0.4, 0.5]),
        p.createCollisionShape(p.GEOM_SPHERE, radius=0.4),
        p.createCollisionShape(p.GEOM_CYLINDER, radius=0.3, height=0.8),
        p.createCollisionShape(p.GEOM_CAPSULE, radius=0.2, height=0.6),
    ]
    turn = [0.1, 0.2, 0.3, sqrt(0.86)]
    return [
        p.createMultiBody(
            1, shape, basePosition=[2 * i, 0, 1], baseOrientation=[0, 0, 0, 1] if i != 2 else turn
        )
        for i, shape in enumerate(made)
    ]


def message_of(call: Callable[[], Any]) -> list[str]:
    try:
        return ["no error", repr(call())]
    except Exception as problem:
        return [type(problem).__name__, str(problem)]


def record_rays_from_above(p: Any, folder: Path) -> Any:
    shapes(p)
    xs = (0.0, 0.1, 2.0, 2.2, 4.0, 6.0, 6.1, 8.0)
    return p.rayTestBatch([[x, 0.05, 3] for x in xs], [[x, 0.05, -1] for x in xs])


def record_a_ray_through_all(p: Any, folder: Path) -> Any:
    shapes(p)
    return [
        p.rayTest([-1, 0, 1], [9, 0, 1]),
        p.rayTest([9, 0, 1], [-1, 0, 1]),
        p.rayTest([0, 0, 1], [9, 0, 1]),
    ]


def record_boxes(p: Any, folder: Path) -> Any:
    bodies = shapes(p)
    plane = p.createMultiBody(0, p.createCollisionShape(p.GEOM_PLANE))
    found = [p.getAABB(body) for body in bodies]
    p.resetBasePositionAndOrientation(bodies[0], [0, 0, 1], [0, 0, sqrt(0.5), sqrt(0.5)])
    return [found, p.getAABB(bodies[0]), p.getAABB(bodies[1], -1), len(p.getAABB(plane))]


def record_overlaps(p: Any, folder: Path) -> Any:
    shapes(p)
    boxes = ([-1, -1, 0], [1, 1, 2]), ([-1, -1, 0], [9, 1, 2]), ([0, 0, 5], [1, 1, 6])
    found = [p.getOverlappingObjects(low, high) for low, high in boxes]
    return [None if each is None else sorted(map(list, each)) for each in found]


def record_ray_errors(p: Any, folder: Path) -> Any:
    shapes(p)
    return [
        message_of(lambda: p.rayTestBatch([[0, 0, 0]], [[0, 0, 1], [0, 0, 2]])),
        message_of(lambda: p.getAABB(9)),
        message_of(lambda: p.getAABB(0, 5)),
        message_of(lambda: p.getAABB(-1)),
        message_of(lambda: p.getAABB(0, -2)),
    ]


@pytest.mark.parametrize(
    ("scenario", "tolerance"),
    [
        (record_rays_from_above, 2e-3),
        (record_a_ray_through_all, 2e-3),
        (record_boxes, 1e-6),
        (record_overlaps, 0),
        (record_ray_errors, 0),
    ],
)
def test_answers_are_pybullets(agrees: Any, scenario: Any, tolerance: float) -> None:
    agrees(scenario, tolerance)


@pytest.mark.parametrize("height", [-0.3, -0.1, 0.0, 0.2, 0.35])
def test_a_ray_meets_a_sphere_where_it_should(client: int, height: float) -> None:
    radius = 0.4
    body = p.createMultiBody(1, p.createCollisionShape(p.GEOM_SPHERE, radius=radius))
    (hit,) = p.rayTest([-2, 0, height], [2, 0, height])
    x = -sqrt(radius**2 - height**2)
    assert hit[:2] == (body, -1)
    assert hit[2] == pytest.approx((x + 2) / 4)
    assert hit[3] == pytest.approx((x, 0, height))
    assert hit[4] == pytest.approx((x / radius, 0, height / radius))


def test_a_ray_from_inside_a_convex_shape_misses_it(client: int) -> None:
    p.createMultiBody(1, p.createCollisionShape(p.GEOM_BOX, halfExtents=[1, 1, 1]))
    assert p.rayTest([0, 0, 0], [3, 0, 0]) == (MISS,)
    assert p.rayTestBatch([[0, 0, 0]], [[3, 0, 0]]) == (MISS,)


def test_without_bodies_every_ray_misses(client: int) -> None:
    assert p.rayTest([0, 0, 0], [1, 0, 0]) == (MISS,)
    assert p.rayTestBatch([[0, 0, 0]] * 3, [[1, 0, 0]] * 3) == (MISS,) * 3
    assert p.rayTestBatch([], []) == ()


def test_batches_are_single_rays(client: int) -> None:
    shapes(p)
    starts = [[x / 5, 0.1, 3] for x in range(40)]
    ends = [[x / 5, -0.1, -3] for x in range(40)]
    single = [p.rayTest(start, end)[0] for start, end in zip(starts, ends, strict=True)]
    for one, other in zip(p.rayTestBatch(starts, ends), single, strict=True):
        assert one[:2] == other[:2]
        assert one[2] == pytest.approx(other[2], abs=1e-6)
        assert one[3] == pytest.approx(other[3], abs=1e-6)


def test_rays_pass_groups_outside_their_mask(client: int) -> None:
    near, far = shapes(p)[:2]
    p.setCollisionFilterGroupMask(near, -1, 4, -1)
    assert p.rayTest([-1, 0, 1], [5, 0, 1])[0][0] == near
    assert p.rayTest([-1, 0, 1], [5, 0, 1], collisionFilterMask=4)[0][0] == near
    assert p.rayTest([-1, 0, 1], [5, 0, 1], collisionFilterMask=1)[0][0] == far
    hits = p.rayTestBatch([[-1, 0, 1]], [[5, 0, 1]], collisionFilterMask=1)
    assert hits[0][0] == far


def test_rays_follow_a_moved_body_at_once(client: int) -> None:
    body = shapes(p)[1]
    p.resetBasePositionAndOrientation(body, [0, 10, 0], [0, 0, 0, 1])
    assert p.rayTest([0, 12, 0], [0, 8, 0])[0][:3] == (body, -1, pytest.approx((2 - 0.4) / 4))


def test_too_many_rays_are_refused(client: int) -> None:
    shapes(p)
    count = p.MAX_RAY_INTERSECTION_BATCH_SIZE + 1
    with pytest.raises(p.error, match="Number of rays exceed") as caught:
        p.rayTestBatch([[0, 0, 0]] * count, [[1, 0, 0]] * count)
    assert str(count) in caught.value.__notes__[0]


def test_a_turned_box_has_the_box_of_its_corners(client: int) -> None:
    """A box of half extents a, b turned by 45° about z reaches (a + b) / sqrt(2) along x and y."""
    shape = p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.3, 0.5, 0.2])
    from math import cos, pi, sin

    body = p.createMultiBody(1, shape, baseOrientation=[0, 0, sin(pi / 8), cos(pi / 8)])
    low, high = p.getAABB(body)
    reach = 0.8 / sqrt(2)
    assert high == pytest.approx((reach, reach, 0.2), abs=2e-3)
    assert low == pytest.approx((-reach, -reach, -0.2), abs=2e-3)
