"""Clearances against NumPy formulas, MuJoCo's distances and finite differences."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from roboyard.description.model import Box, Capsule, Cylinder, Heightfield, Mesh, Plane, Pose, Sphere
from roboyard.kinematics import forward_kinematics
from roboyard.planning import CollisionChecker, Obstacle, Obstacles, SphereModel, sphere_robot
from roboyard.planning.kernels.arrays import Work
from roboyard.planning.spheres.sphere_model import SphereRobot
from roboyard.shapes import primitives
from roboyard.shapes.mesh import TriangleMesh
from roboyard.transforms import normalized

JOINTS = [f"joint{i}" for i in range(1, 8)]
TURN = tuple(float(x) for x in normalized([0.3, -0.2, 0.5, 0.8]))


@pytest.fixture(scope="module")
def robot(arm: SphereModel) -> SphereRobot:
    return sphere_robot(arm, JOINTS)


def configurations(robot: SphereRobot, count: int, seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).uniform(
        robot.arrays.lower, robot.arrays.upper, (count, robot.chain.size)
    )


def placed(robot: SphereRobot, q: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Centres, radii and links of all spheres by forward kinematics."""
    frames = forward_kinematics(robot.chain, q, list(robot.links))
    centers, radii, links = [], [], []
    for l, (name, frame) in enumerate(zip(robot.links, frames, strict=True)):
        for sphere in robot.model.spheres[name]:
            centers.append(frame[:3, :3] @ sphere.center + frame[:3, 3])
            radii.append(sphere.radius)
            links.append(l)
    return np.array(centers), np.array(radii), np.array(links)


def box_distance(points: np.ndarray, half: np.ndarray) -> np.ndarray:
    q = np.abs(points) - half
    return np.linalg.norm(np.maximum(q, 0), axis=1) + np.minimum(q.max(axis=1), 0)


def some_boxes() -> list[Obstacle]:
    rng = np.random.default_rng(1)
    return [
        Obstacle(
            name=f"box{i}",
            shape=Box(size=tuple(rng.uniform(0.05, 0.3, 3))),
            pose=Pose(
                position=tuple(rng.uniform([-0.8, -0.8, 0], [0.8, 0.8, 1.1])),
                quaternion=tuple(normalized(rng.normal(size=4))),
            ),
        )
        for i in range(12)
    ]


def expected_distance(robot: SphereRobot, boxes: list[Obstacle], q: np.ndarray) -> float:
    """The smallest signed distance, without any culling."""
    centers, radii, links = placed(robot, q)
    buffer = robot.model.buffer
    least = np.inf
    for box in boxes:
        matrix = box.pose.matrix()
        local = (centers - matrix[:3, 3]) @ matrix[:3, :3]
        assert isinstance(box.shape, Box)
        gaps = box_distance(local, np.array(box.shape.size) / 2) - radii - buffer
        least = min(least, gaps.min())
    for a, b in robot.arrays.pairs:
        one, two = links == a, links == b
        apart = np.linalg.norm(centers[one][:, None] - centers[two][None], axis=-1)
        least = min(least, (apart - radii[one][:, None] - radii[two][None]).min())
    return float(least)


def test_distances_agree_with_numpy(robot: SphereRobot) -> None:
    boxes = some_boxes()
    checker = CollisionChecker(robot, Obstacles(boxes))
    qs = configurations(robot, 300)
    expected = np.array([expected_distance(robot, boxes, q) for q in qs])
    distance, _ = checker.distance(qs, reach=10.0)
    np.testing.assert_allclose(distance, expected, atol=1e-12)


def test_clearance_of_each_link_agrees_with_numpy(robot: SphereRobot) -> None:
    boxes = some_boxes()
    checker = CollisionChecker(robot, Obstacles(boxes))
    for q in configurations(robot, 20):
        found = checker.clearance(q, reach=0.6)
        centers, radii, links = placed(robot, q)
        np.testing.assert_allclose(found.centers, centers, atol=1e-12)
        np.testing.assert_allclose(found.radii, radii + robot.model.buffer, atol=1e-12)
        np.testing.assert_array_equal(found.of_link, links)
        for k, gap in enumerate(found.gaps):
            expected = 0.6
            for box in boxes if robot.arrays.node[k] >= 0 else ():
                matrix = box.pose.matrix()
                local = (centers[links == k] - matrix[:3, 3]) @ matrix[:3, :3]
                assert isinstance(box.shape, Box)
                apart = box_distance(local, np.array(box.shape.size) / 2) - found.radii[links == k]
                expected = min(expected, apart.min())
            assert gap == pytest.approx(expected, abs=1e-12)


def test_free_agrees_with_the_distance_of_moving_links(robot: SphereRobot) -> None:
    boxes = [b for b in some_boxes() if np.linalg.norm(b.pose.position) > 0.5]
    checker = CollisionChecker(robot, Obstacles(boxes))
    qs = configurations(robot, 2000)
    distance, _ = checker.distance(qs, reach=10.0)
    assert 0.1 < (distance >= 0).mean() < 0.9
    np.testing.assert_array_equal(checker.free(qs), distance >= 0)
    np.testing.assert_array_equal(checker.free(qs, margin=0.004)[distance < 0.004], False)


def test_gradient_agrees_with_differences(robot: SphereRobot) -> None:
    checker = CollisionChecker(robot, Obstacles(some_boxes()))
    step = 1e-7
    good = 0
    for q in configurations(robot, 60):
        gradient = checker.nearest(q).gradient
        for j in range(7):
            shift = np.zeros(7)
            shift[j] = step
            high, low = checker.nearest(q + shift), checker.nearest(q - shift)
            good += abs((high.distance - low.distance) / (2 * step) - gradient[j]) < 1e-5
    assert good > 0.98 * 60 * 7  # the rest is where the nearest pair changes


def test_the_pair_is_named(robot: SphereRobot) -> None:
    tip = forward_kinematics(robot.chain, np.zeros(7), "link7")[:3, 3]
    ball = Obstacle(
        name="ball", shape=Sphere(radius=0.05), pose=Pose(position=tuple(np.add(tip, (0.1, 0, 0))))
    )
    nearest = CollisionChecker(robot, Obstacles([ball])).nearest(np.zeros(7))
    assert (nearest.other, nearest.link) == ("ball", "link7")


SHAPES = {
    "box": (Box(size=(0.3, 0.2, 0.4)), mujoco.mjtGeom.mjGEOM_BOX, (0.15, 0.1, 0.2)),
    "sphere": (Sphere(radius=0.2), mujoco.mjtGeom.mjGEOM_SPHERE, (0.2,)),
    "capsule": (Capsule(radius=0.1, length=0.4), mujoco.mjtGeom.mjGEOM_CAPSULE, (0.1, 0.2)),
    "cylinder": (Cylinder(radius=0.12, length=0.3), mujoco.mjtGeom.mjGEOM_CYLINDER, (0.12, 0.15)),
}


def point_distances(obstacle: Obstacle, points: np.ndarray) -> np.ndarray:
    """Distances from points by the kernels: a robot of one sphere, carried by three prismatic joints."""
    from roboyard.planning.kernels.distances import box_distance as box_kernel
    from roboyard.planning.kernels.distances import obstacle_distance

    world = Obstacles([obstacle]).arrays
    if world.boxes.shape[1]:
        return np.array([box_kernel(world.boxes, 0, *p)[0] for p in points])
    return np.array([obstacle_distance(world, 0, *p)[0] for p in points])


@pytest.mark.parametrize("name", SHAPES)
def test_primitives_agree_with_mujoco(name: str) -> None:
    shape, kind, size = SHAPES[name]
    position = (0.1, -0.2, 0.3)
    spec = mujoco.MjSpec()
    spec.worldbody.add_geom(type=kind, size=[*size, 0, 0][:3], pos=position, quat=[TURN[3], *TURN[:3]])
    body = spec.worldbody.add_body()
    body.add_freejoint()
    body.add_geom(type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[0.01, 0, 0])
    model = spec.compile()
    data = mujoco.MjData(model)
    points = np.random.default_rng(2).uniform(-1, 1, (200, 3))
    own = point_distances(
        Obstacle(name="o", shape=shape, pose=Pose(position=position, quaternion=TURN)), points
    )
    for point, distance in zip(points, own, strict=True):
        data.qpos[:3] = point
        mujoco.mj_kinematics(model, data)
        theirs = mujoco.mj_geomDistance(model, data, 0, 1, 10.0, None) + 0.01
        if theirs > 0.01:
            assert abs(theirs - distance) < 1e-5
        else:
            assert distance < 0.011


def test_half_spaces_and_infinite_planes() -> None:
    floor = Obstacle(name="floor", shape=Plane(normal=(0.0, 0.6, 0.8)), pose=Pose(position=(0, 0, 0.1)))
    points = np.random.default_rng(3).normal(size=(50, 3))
    np.testing.assert_allclose(
        point_distances(floor, points), (points - [0, 0, 0.1]) @ [0, 0.6, 0.8], atol=1e-12
    )


def test_meshes_keep_their_concave_parts() -> None:
    # a cup: a ring of walls without a lid; its middle is free although the hull covers it
    walls = []
    for angle in np.arange(0, 2 * np.pi, np.pi / 8):
        part = primitives.box(0.01, 0.04, 0.1)
        c, s = np.cos(angle), np.sin(angle)
        turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
        walls.append(np.add(part.vertices, (0.15, 0, 0)) @ turn.T)
    vertices = np.concatenate(walls)
    faces = np.concatenate([part.faces + 8 * i for i in range(len(walls))])
    cup = Obstacle(
        name="cup",
        shape=Mesh(uri="", path=None, data=TriangleMesh(vertices=vertices, faces=faces.astype(np.int32))),
    )
    inside = np.array([[0, 0, 0], [0.15, 0, 0], [0.05, 0, 0]])
    np.testing.assert_allclose(point_distances(cup, inside), [0.14, -0.01, 0.09], atol=0.012)
    outside = point_distances(cup, np.array([[0.3, 0, 0], [1.0, 0, 0]]))
    assert (outside <= [0.141, 0.841]).all()
    assert (outside >= [0.12, 0.8]).all()


def test_distance_outside_the_grid_is_never_too_large() -> None:
    ball = Mesh(uri="", path=None, data=primitives.sphere(0.1))
    points = np.random.default_rng(5).normal(size=(200, 3))
    own = point_distances(Obstacle(name="ball", shape=ball), points)
    true = np.linalg.norm(points, axis=1) - 0.1
    assert (own <= true + 0.003).all()
    assert (own >= 0.7 * true - 0.003).all()


def test_terrain_is_solid_below_its_surface() -> None:
    x = np.linspace(-1, 1, 21)
    heights = 0.2 * np.sin(2 * x)[:, None] + np.zeros((21, 11))
    terrain = Obstacle(name="hills", shape=Heightfield(heights=heights, cell=(0.1, 0.1)))
    points = np.array([[0, 0, 0.1], [0.5, 0, 0.1], [-0.5, 0.2, 0.0], [0.3, 0.2, 0.2]])
    own = point_distances(terrain, points)
    line = np.stack([np.linspace(-1, 1, 4001), 0.2 * np.sin(2 * np.linspace(-1, 1, 4001))], axis=1)
    for point, distance in zip(points, own, strict=True):
        apart = np.linalg.norm(line - point[[0, 2]], axis=1).min()
        sign = np.sign(point[2] - 0.2 * np.sin(2 * point[0]))
        assert abs(distance - sign * apart) < 0.02


def test_an_obstacle_moves_in_place(robot: SphereRobot) -> None:
    obstacles = Obstacles([Obstacle(name="ball", shape=Sphere(radius=0.2), pose=Pose(position=(0, 0, 9)))])
    checker = CollisionChecker(robot, obstacles)
    assert checker.free(np.zeros((1, 7)))[0]
    tip = forward_kinematics(robot.chain, np.zeros(7), "link7")[:3, 3]
    obstacles.move("ball", Pose(position=tuple(tip)))
    assert not checker.free(np.zeros((1, 7)))[0]
    assert isinstance(checker.work, Work)


def test_motion_bounds_hold(robot: SphereRobot) -> None:
    rng = np.random.default_rng(4)
    for _ in range(300):
        q, other = configurations(robot, 2, seed=int(rng.integers(1 << 30)))
        one, radii, links = placed(robot, q)
        two, _, _ = placed(robot, other)
        for l in range(len(robot.links)):
            own = links == l
            moved = np.linalg.norm(one[own] - two[own], axis=1).max()
            assert moved <= robot.arrays.reach[l] @ np.abs(q - other) + 1e-9
        for p, (a, b) in enumerate(robot.arrays.pairs):
            first = np.linalg.norm(one[links == a][:, None] - one[links == b][None], axis=-1)
            second = np.linalg.norm(two[links == a][:, None] - two[links == b][None], axis=-1)
            assert np.abs(first - second).max() <= robot.arrays.pair_reach[p] @ np.abs(q - other) + 1e-9
    assert len(radii)
