"""Cameras that have the whole robot in their picture."""

from __future__ import annotations

import numpy as np
import pytest

from roboyard.demo.pictures import VIEWS, view_camera


@pytest.mark.parametrize("view", list(VIEWS))
@pytest.mark.parametrize("scale", [0.01, 1.0, 50.0])
def test_a_fitted_camera_has_all_points_inside_and_some_near_the_edge(view: str, scale: float) -> None:
    rng = np.random.default_rng(3)
    points = scale * (rng.normal(size=(60, 3)) * (1.0, 2.0, 0.5) + (3.0, -1.0, 2.0))
    camera = view_camera(points, view, 320, 240)
    column, row, depth = camera.project(points).T
    assert (depth > camera.near).all()
    assert (depth < camera.far).all()
    across, down = np.abs(column / 160.0 - 1.0).max(), np.abs(row / 120.0 - 1.0).max()
    assert max(across, down) == pytest.approx(0.9, abs=0.01)


def test_the_front_view_faces_the_robot() -> None:
    camera = view_camera(np.eye(3), "front", 200, 200)
    looking = -camera.T_world_camera[:3, 2]
    assert looking[0] < -0.9
    assert abs(looking[1]) < 1e-9
