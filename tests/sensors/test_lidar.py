"""Lidar scans against closed-form geometry and single ray casts."""

from __future__ import annotations

import time

import numpy as np
import pytest

from roboyard.errors import RoboyardError
from roboyard.scenes import home
from roboyard.sensors import Lidar, ScanPattern
from roboyard.sensors.scan_pattern import IMPORTED_PATTERN
from roboyard.sensors.scan_rays import cast_scan
from roboyard.sim import Body, World


def test_default_patterns_match_omnigibson() -> None:
    assert (ScanPattern().rows, ScanPattern().columns) == (1, 360)
    assert (IMPORTED_PATTERN.rows, IMPORTED_PATTERN.columns) == (8, 900)
    assert np.allclose(np.diff(np.degrees(IMPORTED_PATTERN.azimuths)), 0.4)
    assert np.allclose(np.degrees(IMPORTED_PATTERN.elevations), np.arange(14, -15, -4))
    half = ScanPattern(horizontal_fov_deg=90, horizontal_resolution_deg=30, yaw_offset_deg=10)
    assert np.allclose(np.degrees(half.azimuths), [-20, 10, 40])
    assert np.allclose(np.linalg.norm(IMPORTED_PATTERN.directions, axis=-1), 1.0)


def test_ranges_to_four_walls(world: World, mast: Body) -> None:
    """Distance to a wall at x = d along azimuth a is d / cos(a)."""
    for k, d in enumerate((2.0, 3.0, 2.5, 4.0)):
        angle = k * np.pi / 2
        size = (0.2, 9, 3)
        turn = (0, 0, np.sin(angle / 2), np.cos(angle / 2))
        at = (d + 0.1) * np.array([np.cos(angle), np.sin(angle), 0]) + (0, 0, 1.5)
        world.add_box(size, at, turn, mass=0)
    scan = Lidar(mast.link("head")).scan()
    a = scan.pattern.azimuths
    with np.errstate(divide="ignore"):
        walls = np.stack(
            [
                np.where(np.cos(a - k * np.pi / 2) > 1e-9, d / np.cos(a - k * np.pi / 2), np.inf)
                for k, d in enumerate((2.0, 3.0, 2.5, 4.0))
            ]
        )
    assert np.allclose(scan.ranges[0], walls.min(axis=0), atol=1e-9)
    assert np.allclose(scan.points()[:, 2], 0.6)


def test_scan_rotates_with_the_link(world: World, mast: Body) -> None:
    box = world.add_box((0.4, 0.4, 2), (0, 2, 1), mass=0)
    lidar = Lidar(mast.link("head"))
    ahead = 180
    assert np.isinf(lidar.scan().ranges[0, ahead])
    mast.joint("neck").position = np.pi / 2
    scan = lidar.scan()
    assert scan.ranges[0, ahead] == pytest.approx(1.8)
    assert tuple(scan.owners[0, ahead]) == (box.id, 0)
    assert np.allclose(scan.points(world=False)[:, 0].max(), 1.8)


def test_own_robot_is_detected_only_with_sees_itself(world: World, mast: Body) -> None:
    wall = world.add_box((0.2, 4, 2), (3.1, 0, 1), mass=0)
    seen = Lidar(mast.link("head")).scan()
    assert seen.ranges[0, 180] == pytest.approx(3.0)
    assert tuple(seen.owners[0, 180]) == (wall.id, 0)
    groups = world.model.geom_group.copy()
    blocked = Lidar(mast.link("head"), sees_itself=True).scan()
    assert blocked.ranges[0, 180] == pytest.approx(0.25)
    assert mast.links[blocked.owners[0, 180, 1]].name == "ear"
    assert np.array_equal(world.model.geom_group, groups)


def test_ranges_outside_the_limits_are_no_hits(world: World, mast: Body) -> None:
    world.add_box((0.2, 4, 2), (3.1, 0, 1), mass=0)
    near = Lidar(mast.link("head"), pattern=ScanPattern(max_range=2.9)).scan()
    assert np.isinf(near.ranges[0, 180]) and near.normalized()[0, 180] == 1.0
    close = Lidar(mast.link("head"), pattern=ScanPattern(min_range=3.5)).scan()
    assert np.isinf(close.ranges[0, 180]) and (close.owners[0, 180] == -1).all()
    plain = Lidar(mast.link("head"), pattern=ScanPattern(min_range=1, max_range=5)).scan()
    assert plain.normalized()[0, 180] == pytest.approx(0.5)


def test_scan_of_the_flat_agrees_with_single_rays() -> None:
    scene = home()
    place = scene.world.add_box((0.02, 0.02, 0.02), (*scene.spawn[:2], 1.0), mass=0, name="post")
    pattern = ScanPattern(
        vertical_fov_deg=32, vertical_resolution_deg=4, horizontal_resolution_deg=5, max_range=12
    )
    scan = Lidar(place.links[0], pattern=pattern).scan()
    assert scan.ranges.shape == (8, 72)
    ends = scan.position + pattern.directions.reshape(-1, 3) * 12
    for k in range(0, 576, 7):
        start = scan.position + 0.02 * pattern.directions.reshape(-1, 3)[k]
        hit = scene.world.ray(start, ends[k])
        measured = scan.ranges.reshape(-1)[k]
        assert (hit is None) == bool(np.isinf(measured))
        if hit is not None:
            assert np.linalg.norm(hit.position - scan.position) == pytest.approx(measured, abs=1e-6)
            assert (hit.body.id, hit.link.index) == tuple(scan.owners.reshape(-1, 2)[k])


@pytest.mark.parametrize("kind", ["box", "sphere", "cylinder", "capsule", "ellipsoid"])
@pytest.mark.parametrize("spread", [3.0, 0.3], ids=["outside", "inside"])
def test_hits_on_every_solid_agree_with_mujoco(kind: str, spread: float) -> None:
    """Tilted solids around and about a tilted lidar; every ray against `mj_ray`."""
    import mujoco

    draw = np.random.default_rng(3)
    spec = mujoco.MjSpec()
    for _ in range(12):
        quat = draw.normal(size=4)
        size = draw.uniform(0.2, 0.9, 3) if spread > 1 else draw.uniform(0.5, 0.9, 3)
        spec.worldbody.add_geom(
            type=getattr(mujoco.mjtGeom, f"mjGEOM_{kind.upper()}"),
            size=size,
            pos=draw.uniform(-spread, spread, 3),
            quat=quat / np.linalg.norm(quat),
        )
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    turn = np.empty(9)
    mujoco.mju_quat2Mat(turn, np.array([0.8, 0.1, -0.5, 0.33]) / np.linalg.norm([0.8, 0.1, -0.5, 0.33]))
    rotation, at = turn.reshape(3, 3), np.array([0.1, 0.05, -0.1])
    for pattern in (
        ScanPattern(vertical_fov_deg=180, vertical_resolution_deg=9, horizontal_resolution_deg=7),
        ScanPattern(
            horizontal_fov_deg=200,
            horizontal_resolution_deg=3,
            yaw_offset_deg=500,
            vertical_fov_deg=40,
            vertical_resolution_deg=8,
            max_range=2.0,
        ),
    ):
        geoms, distances = cast_scan(model, data, pattern, at, rotation, np.ones(model.ngeom, dtype=bool))
        met = np.zeros(1, dtype=np.int32)
        for place in np.ndindex(geoms.shape):
            ray = rotation @ pattern.directions[place]
            far = mujoco.mj_ray(model, data, at, ray, None, True, -1, met)
            if 0 <= far <= pattern.max_range - 1e-6:
                assert distances[place] == pytest.approx(far, abs=1e-7), place
                assert geoms[place] == met[0]
            else:
                assert not distances[place] < pattern.max_range - 1e-6


def test_meshes_terrain_and_glass(world: World, mast: Body) -> None:
    """Rays hit meshes and height fields, but not fully transparent shapes."""
    from roboyard.shapes.primitives import box

    hill = world.add_heightfield(np.full((8, 8), 1.5), 0.25, (4.0, 0.0, 0.0))
    mesh = world.add_mesh(box(0.2, 0.2, 1.0), (0, 2, 1), mass=0)
    glass = world.add_box((0.1, 3, 3), (-1.0, 0, 0), mass=0)
    wall = world.add_box((0.1, 3, 3), (-3.0, 0, 0), mass=0)
    lidar = Lidar(mast.link("head"))
    scan = lidar.scan()
    assert tuple(scan.owners[0, 180]) == (hill.id, 0)
    assert scan.ranges[0, 180] == pytest.approx(4.0 - 7 * 0.25 / 2, abs=1e-3)
    assert scan.ranges[0, 270] == pytest.approx(1.8)
    assert tuple(scan.owners[0, 270]) == (mesh.id, 0)
    assert tuple(scan.owners[0, 0]) == (glass.id, 0)
    world.model.geom_rgba[np.flatnonzero(world.geom_owners[:, 0] == glass.id), 3] = 0.0
    assert tuple(lidar.scan().owners[0, 0]) == (wall.id, 0)


def test_scan_of_the_flat_is_fast() -> None:
    scene = home()
    place = scene.world.add_box((0.02, 0.02, 0.02), (*scene.spawn[:2], 1.0), mass=0, name="post")
    lidar = Lidar(place.links[0], pattern=IMPORTED_PATTERN)
    assert lidar.scan().ranges.shape == (8, 900)
    times = []
    for _ in range(15):
        start = time.perf_counter()
        lidar.scan()
        times.append(time.perf_counter() - start)
    assert min(times) < 0.003, "0.5 ms on a quiet machine"


@pytest.mark.parametrize(
    "wrong",
    [
        {"horizontal_fov_deg": 400},
        {"vertical_resolution_deg": 0},
        {"min_range": 5, "max_range": 1},
        {"max_range": float("nan")},
        {"horizontal_resolution_deg": 1e-6},
    ],
)
def test_invalid_patterns_raise(wrong: dict[str, float]) -> None:
    with pytest.raises(RoboyardError, match=r"horizontal_fov_deg must be|too large"):
        ScanPattern(**wrong)
