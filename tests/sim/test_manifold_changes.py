"""Loops that are run where bodies came or went, compared with plain versions."""

from __future__ import annotations

import mujoco
import numpy as np
from scipy.spatial.transform import Rotation

from roboyard.sim.stepping.manifold_changes import (
    end_points,
    write_first_boxes,
    write_seen_gaps,
    write_turns,
)
from roboyard.sim.stepping.sequential.solver_arrays import of_model
from roboyard.sim.stepping.sequential.weld_kernels import DIFFER, TOUCH, touching_welds

LINKS = """<mujoco><worldbody><geom type="plane" size="1 1 1"/>
  <body><freejoint/><geom size="0.1"/>
    <body><geom size="0.1"/><body><geom size="0.1" contype="2" conaffinity="4"/></body>
      <body><joint/><geom size="0.1"/><body><geom size="0.1"/></body></body></body></body>
  <body><geom size="0.1"/><body><geom size="0.1"/></body></body></worldbody></mujoco>"""


def test_boxes_hold_the_corners_of_links_where_their_body_was_made() -> None:
    """Links that have a box already, and those without an end, get none; quaternions may have any length."""
    rng = np.random.default_rng(0)
    corners = np.stack(np.meshgrid(*[[-1.0, 1.0]] * 3), axis=-1).reshape(-1, 3)
    for _ in range(20):
        boxes, turn = rng.normal(size=(4, 5, 3)), Rotation.from_quat(rng.normal(size=4))
        boxes[2, 1:] = [*(1e9 * np.eye(3)), np.zeros(3)]
        boxes[:, 4] = np.abs(boxes[:, 4])
        place, leaves = rng.normal(size=3), np.full(9, -1, np.int32)
        leaves[5] = 2
        bounds = np.full((9, 6), 7.0)
        links = np.array([3, 5, 6, 8], np.int32)
        write_first_boxes(
            links,
            boxes,
            np.tile(np.concatenate([place, 3.0 * turn.as_quat()]), (len(links), 1)),
            leaves,
            bounds,
        )
        for link, (middle, *edges, more) in ((3, boxes[0]), (8, boxes[3])):
            points = place + turn.apply(middle + corners @ np.array(edges))
            around = np.concatenate([points.min(axis=0) - more, points.max(axis=0) + more])
            np.testing.assert_allclose(bounds[link], around, atol=1e-12)
        assert bounds[6, 0] > bounds[6, 3]
        assert np.all(bounds[[0, 1, 2, 4, 5, 7]] == 7.0)


def test_mujoco_looks_as_far_as_pairs_push() -> None:
    """Sums of margins reach across the smaller gap of both shapes, but not of two boxes, as these do not."""
    rng = np.random.default_rng(4)
    geoms, bodies, box_margin, most = 40, 12, 5e-4, 0.02
    kinds = rng.choice([0, 2, 3, 5, 6, 7], geoms).astype(np.int32)
    owners = rng.integers(bodies, size=geoms).astype(np.int32)
    widths, gaps = rng.choice([0.0, 0.001], geoms), rng.uniform(0.001, 0.018, geoms)
    reaches = np.where(kinds == 0, np.inf, rng.uniform(0.0005, 0.018, geoms))
    margins, of_bodies = np.full(geoms, 7.0), np.full(bodies, 7.0)
    write_seen_gaps(kinds, owners, widths, reaches, box_margin, most, margins, gaps, of_bodies)
    for a in range(geoms):
        for b in range(geoms):
            seen, pushes = margins[a] + margins[b], min(reaches[a], reaches[b]) + widths[a]
            if kinds[a] == kinds[b] == 6:
                assert seen <= 2 * box_margin
            elif kinds[a] != 0:
                assert seen >= min(pushes, most)
    for body in range(bodies):
        assert of_bodies[body] == max((margins + gaps)[owners == body], default=0.0)


def test_points_of_a_range_of_geoms_end() -> None:
    """The others stay in order, in their own table alone."""
    rng = np.random.default_rng(1)
    for _ in range(20):
        geoms, count = 7, 15
        ages = rng.permutation(geoms).astype(np.int32)
        pairs = rng.integers(geoms, size=(2, count, 2))
        keys = pairs[..., 0] * geoms + pairs[..., 1]
        counts = rng.integers(5, size=(2, count)).astype(np.int32)
        points = rng.normal(size=(2, count, 4, 17))
        first, stop = sorted(rng.integers(geoms + 1, size=2).tolist())
        is_in = (first <= ages) & (ages < stop)
        wanted = [k for k in range(count - 2) if not is_in[pairs[1, k]].any()]
        before = keys.copy(), counts.copy(), points.copy()
        left = end_points(keys, counts, points, ages, 1, count - 2, first, stop)
        assert left == len(wanted)
        for now, old in zip((keys, counts, points), before, strict=True):
            np.testing.assert_array_equal(now[1, :left], old[1, wanted])
            np.testing.assert_array_equal(now[0], old[0])


def test_links_that_touch_one_another_count_as_bodies_of_their_own() -> None:
    """All but those that are fixed to the world, or whose masks have no bit in common."""
    model = mujoco.MjModel.from_xml_string(LINKS)
    (mechanism, _), found = of_model(model), np.empty((2, model.nbody), np.int32)
    assert model.body_weldid.tolist() == [0, 1, 1, 1, 4, 4, 0, 0]
    assert touching_welds(mechanism, model.body_weldid, model.body_dofnum, found) == DIFFER + TOUCH
    assert found.tolist() == [[0, 1, 2, 1, 4, 5, 0, 0], [0, 6, 1, 0, 1, 1, 0, 0]]
    np.testing.assert_array_equal(mechanism.geom_weld, found[0][model.geom_bodyid])
    model.geom_contype[[2, 5]] = 0
    assert touching_welds(mechanism, model.body_weldid, model.body_dofnum, found) == TOUCH
    np.testing.assert_array_equal(found, [model.body_weldid, model.body_dofnum])
    np.testing.assert_array_equal(mechanism.geom_weld, model.body_weldid[model.geom_bodyid])
    model.geom_contype[4] = 0
    assert touching_welds(mechanism, model.body_weldid, model.body_dofnum, found) == 0


def test_turns_are_those_in_which_links_entered_or_will_enter() -> None:
    drawn = np.random.default_rng(5)
    for _ in range(20):
        bodies, geoms, first = 12, 17, 40
        links = drawn.permutation(bodies)[:9].astype(np.int32)
        leaves = np.where(drawn.uniform(size=bodies) < 0.4, -1, drawn.permutation(bodies)).astype(np.int32)
        ties = drawn.integers(0, first, (bodies, 5)).astype(np.int32)
        refreshed = links[drawn.permutation(9)[:3]].copy()
        shapes = drawn.permutation(geoms)[:14].astype(np.int32)
        geom_body = drawn.choice(links, geoms).astype(np.int32)
        of_links, found = np.zeros(bodies, np.int32), np.full(geoms, -7, np.int32)
        write_turns(links, 9, refreshed, 3, leaves, ties, 2, first, shapes, geom_body, of_links, found)
        new = [link for link in links.tolist() if leaves[link] < 0]
        turns = {link: int(ties[leaves[link], 2]) for link in links.tolist() if leaves[link] >= 0}
        turns |= {link: first + k for k, link in enumerate(new)}
        turns |= {link: first + len(new) + k for k, link in enumerate(refreshed.tolist())}
        wanted = [turns[link] if geom in shapes else -7 for geom, link in enumerate(geom_body.tolist())]
        assert found.tolist() == wanted
