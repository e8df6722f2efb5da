"""Pictures drawn in parts by several threads are those drawn in one."""

from __future__ import annotations

import threading

import numpy as np
import pytest

from roboyard.rendering import Camera, software
from roboyard.rendering.parts import Pace, even_bands, in_parts, part_count
from roboyard.shapes import primitives


def balls(shape, alpha=1.0):
    places = [(0.0, 0.0, 0.2), (0.5, -0.4, 0.9), (-0.6, 0.5, 0.5), (0.1, 0.8, 1.3)]
    return [
        shape(primitives.sphere(0.3), position=place, rgba=(0.9, 0.4 + 0.1 * k, 0.2, alpha))
        for k, place in enumerate(places)
    ]


@pytest.mark.parametrize("samples", [1, 4])
@pytest.mark.parametrize("alpha", [1.0, 0.5])
@pytest.mark.parametrize("parallel", [False, True])
def test_parts_make_the_same_picture(parallel, alpha, samples, shape, picture, floor, monkeypatch):
    shapes = [floor, shape(primitives.box(0.5, 0.5, 0.5), position=(0.4, 0.4, 0.3)), *balls(shape, alpha)]
    eye, target = (2.0, -1.6, 1.4), (0.0, 0.0, 0.5)
    if parallel:
        camera = Camera.orthographic(eye, target, width=97, height=71)
    else:
        camera = Camera.look_at(eye, target, width=97, height=71)
    images = []
    for count in (1, 2, 3, 4):
        monkeypatch.setattr(software, "part_count", lambda pixels, count=count: count)
        images.append(picture(shapes, camera, samples=samples))
    assert len(np.unique(images[0].segmentation[..., 0])) > 1 or (images[0].depth < np.inf).any()
    for other in images[1:]:
        assert np.array_equal(other.rgba, images[0].rgba)
        assert np.array_equal(other.depth, images[0].depth)
        assert np.array_equal(other.segmentation, images[0].segmentation)


def test_results_come_in_the_order_of_the_calls():
    assert in_parts([lambda k=k: k for k in range(7)]) == list(range(7))


def test_all_calls_end_before_an_error_is_raised():
    ended = threading.Event()
    begun = threading.Event()

    def slow():
        begun.set()
        ended.wait(0.2)
        ended.set()

    def bad():
        begun.wait(5.0)
        raise ValueError("bad")

    with pytest.raises(ValueError, match="bad"):
        in_parts([bad, slow])
    assert ended.is_set()


def test_threads_of_other_programs_draw_in_one_part():
    found = []
    thread = threading.Thread(target=lambda: found.append(part_count(10**6)))
    thread.start()
    thread.join()
    assert found == [1]
    assert part_count(84 * 84) == 1


def test_one_core_is_kept_to(monkeypatch):
    monkeypatch.setenv("ROBOYARD_THREADS", "1")
    assert part_count(10**6) == 1


@pytest.mark.parametrize(("one", "several", "expected"), [(1.0, 2.0, 1), (2.0, 1.0, 4)])
def test_the_faster_way_is_taken(one, several, expected):
    pace, drawn = Pace(), []
    for _ in range(100):
        parts = pace.parts(4)
        pace.note(parts, one if parts == 1 else several)
        drawn.append(parts)
    assert drawn.count(expected) > 90
    assert 0 < drawn.count(5 - expected) < 10


def test_bands_cover_all_rows_once():
    for height in (1, 3, 7, 200):
        for parts in (1, 2, 4):
            rows = [row for first, end in even_bands(height, parts) for row in range(first, end)]
            assert rows == list(range(height))
