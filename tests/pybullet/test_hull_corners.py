"""Of corners of a hull that are as low as each other, the one touches first that does so in PyBullet.

Recorded with PyBullet 3.2.7.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from roboyard import pybullet as p

ANGLES = {
    5: [0.3, 1.9, 2.2, 4.1, 5.5],
    6: [0.0, 0.9, 2.0, 3.3, 4.4, 5.6],
    7: [2.0 * np.pi * k / 7 for k in range(7)],
}
LANDINGS = {
    (5, 0.0, True, 1.0): ([-0.0294251, 0.0404232, 0.0014572], 10, [-0.13139, 0.01541, 0.00012]),
    (5, 1.1, True, 0.2): ([-0.0493725, -0.007888, 0.0014572], 10, [-0.07266, -0.10989, 0.00078]),
    (5, 0.0, False, 1.0): ([0.0092971, 0.0057406, 0.0014572], 10, [0.03291, 0.10931, -0.00014]),
    (5, 2.5, False, 0.2): ([-0.0038325, -0.0003207, 0.0014572], 10, [-0.01877, -0.02375, -1e-05]),
    (6, 0.0, True, 1.0): ([-0.0208049, 0.0454649, 0.0014572], 10, [-0.22305, 0.44459, -0.13724]),
    (6, 1.1, True, 0.2): ([-0.0499557, 0.0020812, 0.0014572], 10, [-0.48736, -0.02531, -0.09424]),
    (6, 0.0, False, 1.0): ([0.0087653, 0.0065761, 0.0014572], 10, [-0.17035, -0.12166, 0.0127]),
    (6, 2.5, False, 0.2): ([0.0151232, 0.0123276, 0.0014572], 10, [-0.27283, -0.26927, 0.05411]),
    (7, 0.0, True, 1.0): ([-0.0450484, -0.0216916, 0.0014572], 10, [0.24784, -0.02364, 0.07922]),
    (7, 1.1, True, 0.2): ([-0.0011021, -0.0499867, 0.0014572], 10, [0.13204, 0.21105, -0.06798]),
    (7, 0.0, False, 1.0): ([0.0095799, 0.004745, 0.0014572], 10, [0.02283, 0.05546, 9e-05]),
    (7, 2.5, False, 0.2): ([0.0105123, 0.00268, 0.0014572], 10, [-0.03542, 0.03216, -7e-05]),
}
"""Sides, turn (rad), whether the floor is a plane, and mass to the first place of contact (m), the step, and
the angular velocity (rad/s) five steps later."""
PARTS = """o first
v 0.02 0.03 0.01
v -0.02 0.03 0.01
v -0.02 -0.03 0.01
v 0.02 -0.03 0.01
v 0 0 0.05
f 1 2 3 4
f 1 2 5
f 2 3 5
f 3 4 5
f 4 1 5
o second
v 0.1 0 0
v 0.13 0 0
v 0.1 0.02 0
v 0.1 0 0.04
v 0.13 0.02 0.04
f 6 7 8
f 6 7 9
f 6 8 9
f 7 8 10
f 7 9 10
f 8 9 10
"""
ROBOT = """<robot name="r"><link name="b"><inertial><mass value="1"/>
<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial><collision><geometry>
<mesh filename="parts.obj" scale="2 1 -1"/></geometry></collision></link></robot>"""
CORNERS = [
    [0.04, 0.03, -0.01],
    [0.0, 0.0, -0.05],
    [-0.04, 0.03, -0.01],
    [0.04, -0.03, -0.01],
    [-0.04, -0.03, -0.01],
    [0.2, 0.0, -0.04],
    [0.2, 0.02, 0.0],
    [0.26, 0.02, -0.04],
    [0.26, 0.0, 0.0],
    [0.2, 0.0, 0.0],
]
"""Of `ROBOT` (m)."""


def _frustum(sides: int) -> list[list[float]]:
    low = [[0.05 * np.cos(a), 0.05 * np.sin(a), -0.02] for a in ANGLES[sides]]
    return low + [[0.03 * np.cos(a), 0.03 * np.sin(a), 0.02] for a in ANGLES[sides][::-1]]


@pytest.mark.parametrize("landing", LANDINGS)
def test_the_first_of_the_lowest_corners_touches_first(
    client: int, landing: tuple[int, float, bool, float]
) -> None:
    sides, turn, on_plane, mass = landing
    p.setGravity(0, 0, -10)
    kind = {"shapeType": p.GEOM_PLANE} if on_plane else {"shapeType": p.GEOM_BOX, "halfExtents": [1, 1, 0.1]}
    p.createMultiBody(0, p.createCollisionShape(**kind), basePosition=[0, 0, 0 if on_plane else -0.1])
    shape = p.createCollisionShape(p.GEOM_MESH, vertices=_frustum(sides))
    body = p.createMultiBody(
        mass, shape, basePosition=[0, 0, 0.032], baseOrientation=p.getQuaternionFromEuler([0, 0, turn])
    )
    place, step, velocity = LANDINGS[landing]
    for _ in range(step):
        p.stepSimulation()
        assert not p.getContactPoints(body)
    p.stepSimulation()
    (point,) = p.getContactPoints(body)
    assert point[5] == pytest.approx(place, abs=1e-6)
    for _ in range(5):
        p.stepSimulation()
    assert p.getBaseVelocity(body)[1] == pytest.approx(velocity, abs=1e-4)


def test_mesh_data_lists_the_corners_of_each_object_in_pybullets_order(client: int, tmp_path: Path) -> None:
    (tmp_path / "parts.obj").write_text(PARTS)
    (tmp_path / "robot.urdf").write_text(ROBOT)
    body = p.loadURDF(str(tmp_path / "robot.urdf"))
    count, corners = p.getMeshData(body, -1)
    assert count == len(CORNERS)
    np.testing.assert_allclose(corners, CORNERS, rtol=0.0, atol=1e-6)
