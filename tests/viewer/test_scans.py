"""Points of lidars in a scene: positions, colours and cost."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from roboyard import World
from roboyard.sensors import Lidar, ScanPattern
from roboyard.viewer import Viewer
from roboyard.viewer.scene.scans import ITSELF, RAMP, Scans, scan_colors

pytest.importorskip("viser")


@pytest.fixture
def ring() -> tuple[World, Any, Lidar]:
    """Build a lidar between two walls, 0.5 and 20 m away."""
    world = World()
    near = world.add_box((0.2, 4, 1), (0.6, 0, 0.5))
    world.add_box((0.2, 4, 1), (-20.1, 0, 0.5))
    carrier = world.add_box((0.1, 0.1, 0.1), (0, 0, 0.5))
    pattern = ScanPattern(horizontal_resolution_deg=90.0, max_range=50.0)
    return world, near, Lidar(carrier.links[0], pattern=pattern)


def test_points_are_on_hit_surfaces_and_removed_without_hits(ring: tuple[World, Any, Lidar]) -> None:
    world, near, lidar = ring
    with Viewer(world, port=0, quiet=True) as viewer:
        scans = Scans(viewer.server)
        scans.show([lidar])
        assert sorted(scans.points[:, 0].round(4)) == [-20.0, 0.5]
        first = scans._node
        scans.show([lidar])
        assert scans._node is first
        near.set_pose(position=(1.6, 0, 0.5))
        scans.show([lidar, lidar])
        assert sorted(scans.points[:, 0].round(4)) == [-20.0, -20.0, 1.5, 1.5]
        assert len(first.points) == len(first.colors) == 4
        scans.show([])
        assert scans._node is None
        scans.clear()


def test_colours_show_distance_and_the_carrier(ring: tuple[World, Any, Lidar]) -> None:
    _, near, lidar = ring
    scan = lidar.scan()
    by_distance = dict(zip(scan.ranges[scan.hit].round(3), map(tuple, scan_colors(scan, -1)), strict=True))
    assert by_distance[0.5] == tuple(RAMP[0])
    assert by_distance[20.0] == tuple(RAMP[-1])
    own = scan_colors(scan, near.id)[scan.owners[scan.hit][:, 0] == near.id]
    np.testing.assert_array_equal(own, [ITSELF])
