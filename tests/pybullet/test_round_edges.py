"""getClosestPoints of boxes and cylinders, whose edges are round in Bullet: numbers of PyBullet 3.2.7."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import roboyard.pybullet as p
from roboyard.pybullet.api import contact_points
from roboyard.pybullet.connections import CLIENTS

HULL = [[0.1, 0, 0], [-0.1, 0.02, 0], [0, 0.1, 0.03], [0, -0.05, 0.1], [0.02, 0.02, -0.1]]
SHAPES: dict[str, dict[str, Any]] = {
    "box": {"shapeType": p.GEOM_BOX, "halfExtents": [0.05, 0.08, 0.1]},
    "bar": {"shapeType": p.GEOM_BOX, "halfExtents": [0.1, 0.03, 0.06]},
    "cylinder": {"shapeType": p.GEOM_CYLINDER, "radius": 0.06, "height": 0.2},
    "sphere": {"shapeType": p.GEOM_SPHERE, "radius": 0.05},
    "capsule": {"shapeType": p.GEOM_CAPSULE, "radius": 0.04, "height": 0.1},
    "hull": {"shapeType": p.GEOM_MESH, "vertices": HULL},
}
PAIRS = """
box bar -0.014 -0.224 0.109 -1.18 -1.15 0.67 -2.29 0.077983 -0.02113 -0.08 0.09905
box bar -0.053 -0.138 0.027 0.2 1.36 -0.5 0.4 -0.002554 -0.04908 -0.08 0.05995
box bar -0.017 0.088 0.002 -1.26 -0.35 0.7 0.06 -0.060778 -0.04918 0.07998 0.07921
box cylinder -0.043 0.246 0.003 -0.59 0.16 -0.52 -0.39 0.050687 -0.02842 0.08 0.00446
box cylinder -0.032 0.126 -0.074 0.18 0.67 2.02 -0.22 -0.038824 -0.03656 0.07979 -0.09961
box cylinder -0.085 0.023 -0.018 -0.37 0.67 2.28 -0.95 -0.062731 -0.05 -0.00158 -0.07563
box sphere -0.053 0.159 0.186 -0.39 0.46 0.22 0.29 0.067258 -0.04903 0.07968 0.09974
box sphere -0.101 -0.045 0.102 0.03 -0.45 0.73 0.48 0.001086 -0.05 -0.045 0.09906
box sphere -0 -0.067 0.06 -0.1 -0.33 0.21 -0.03 -0.063000 -0 -0.08 0.06
box capsule 0.002 0.105 0.227 0.2 -0.88 0.98 0.31 0.089292 0.00125 0.07913 0.09999
box capsule -0.04 0.06 -0.132 0.55 1.59 2.16 -1.02 -0.016382 -0.04297 0.07934 -0.09994
box capsule -0.056 0.069 0.016 -0.27 1.29 1.04 0.58 -0.037296 -0.04995 0.0793 0.01482
bar hull -0.126 0.198 -0.086 0.77 0.49 -1.72 -1.43 0.074882 -0.09941 0.02988 -0.05925
bar hull 0.012 -0.056 -0.139 -0.24 -0.25 0.57 0.5 0.002734 -0.02315 -0.02973 -0.05969
bar hull -0.032 0.021 -0.081 0.17 0.27 1.23 -0.1 -0.046587 -0.01239 0.02902 -0.06
cylinder hull 0.137 0.205 0.043 -1.04 -1.01 0.29 2.09 0.121734 0.0241 0.05495 -0.02727
cylinder hull -0.092 -0.099 0.064 0.28 -0.45 -0.28 -2.43 0.003265 -0.03731 -0.04699 0.04371
cylinder hull 0.043 0.079 -0 0.66 1.14 1.56 -0.31 -0.059867 0.0564 0.02048 0.01862
cylinder sphere -0.216 0.029 -0.122 1.09 -0.17 -1.61 0.12 0.109594 -0.05946 0.00798 -0.09914
cylinder sphere -0.054 -0.14 0.001 0.32 -2.14 2.08 1.36 0.040053 -0.02159 -0.05598 0.001
cylinder sphere -0.057 0.068 0.012 0.68 0.42 0.4 -1.97 -0.021270 -0.03856 0.04597 0.012
"""
"""Both shapes, position and orientation (not of length 1) of the second one, distance, point on the first."""


def _read(row: str) -> tuple[Any, ...]:
    first, second, *numbers = row.split()
    position, orientation, (distance,), point = np.split(np.array(numbers, float), [3, 7, 8])
    return first, second, position, orientation, float(distance), point


@pytest.mark.parametrize("row", PAIRS.strip().splitlines())
def test_closest_points_are_those_of_pybullet(client: int, row: str) -> None:
    *names, position, orientation, distance, point = _read(row)
    bodies = [p.createMultiBody(1, p.createCollisionShape(**SHAPES[name])) for name in names]
    turn = np.array(orientation) / np.linalg.norm(orientation)
    p.resetBasePositionAndOrientation(bodies[1], position, turn)
    scene: Any = CLIENTS[client].scene
    (found,) = p.getClosestPoints(*bodies, 0.5)
    assert found[8] == pytest.approx(distance, abs=2e-5)
    assert found[5] == pytest.approx(point, abs=3e-4)
    assert np.subtract(found[5], found[6]) @ found[7] == pytest.approx(distance, abs=2e-5)
    sides = (contact_points._geoms_of(scene, body, contact_points.ANY_LINK).places for body in bodies)
    sizes = scene.world.live_model.geom_size.copy()
    (plain,) = contact_points._closest_points(scene, scene.world, *sides, 0.5)
    assert plain[:5] == found[:5]
    for one, two in zip(plain[5:9], found[5:9], strict=True):
        assert one == pytest.approx(two, abs=1e-9)
    np.testing.assert_array_equal(scene.world.live_model.geom_size, sizes)


@pytest.mark.parametrize("gap", [0.003, -0.002])
@pytest.mark.parametrize(("turn", "nearer"), [(0.0, 0.0), (np.pi / 4, (np.sqrt(2.0) - 1.0) * 0.001)])
def test_an_edge_towards_a_ball_is_round(client: int, turn: float, nearer: float, gap: float) -> None:
    box = p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.05] * 3)
    ball = p.createMultiBody(0, p.createCollisionShape(p.GEOM_SPHERE, radius=0.1))
    reach = 0.05 * (np.cos(turn) + np.sin(turn))
    body = p.createMultiBody(1, box, -1, [0.1 + reach + gap, 0, 0], p.getQuaternionFromEuler([0, 0, turn]))
    assert p.getClosestPoints(ball, body, 0.02)[0][8] == pytest.approx(gap + nearer, abs=1e-6)
    at_pose = p.getClosestPoints(
        ball,
        -1,
        0.02,
        collisionShapeB=box,
        collisionShapePositionB=[0.1 + reach + gap, 0, 0],
        collisionShapeOrientationB=p.getQuaternionFromEuler([0, 0, turn]),
    )
    assert at_pose[0][8] == pytest.approx(gap + nearer, abs=1e-6)


def test_thin_plates_and_planes_keep_their_edges(client: int) -> None:
    plate = p.createMultiBody(1, p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.1, 0.1, 0.0005]))
    ball = p.createMultiBody(1, p.createCollisionShape(p.GEOM_SPHERE, radius=0.1), -1, [0.3, 0.3, 0])
    expected = np.hypot(0.2, 0.2) - 0.1
    assert p.getClosestPoints(plate, ball, 1.0)[0][8] == pytest.approx(expected, abs=1e-6)
    ground = p.createMultiBody(0, p.createCollisionShape(p.GEOM_PLANE))
    turn = p.getQuaternionFromEuler([0, np.pi / 4, 0])
    box = p.createMultiBody(
        1, p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.1] * 3), -1, [0, 0, 0.2], turn
    )
    assert p.getClosestPoints(ground, box, 1.0)[0][8] == pytest.approx(0.2 - 0.1 * np.sqrt(2.0), abs=1e-6)
