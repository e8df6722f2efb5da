"""Bodies of several hulls land as PyBullet's do; the numbers are PyBullet 3.2.7's."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

import roboyard.pybullet as p

RING = """<robot name="ring"><link name="ring"><inertial><mass value="0.1"/>
<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>
<collision><geometry><mesh filename="ring.obj"/></geometry></collision></link></robot>"""
TRIANGLES = (
    *((0, 1, 3), (0, 3, 2), (4, 6, 7), (4, 7, 5), (0, 4, 5), (0, 5, 1)),
    *((2, 3, 7), (2, 7, 6), (0, 2, 6), (0, 6, 4), (1, 5, 7), (1, 7, 3)),
)
"""Of the eight corners of one piece of the ring."""
PIECES = 8


def _write_ring(folder: Path) -> Path:
    """Write a ring of convex pieces, 1 cm high, with radii of 1 and 4 cm."""
    lines = []
    for k in range(PIECES):
        lines.append(f"o piece{k}")
        for radius in (0.01, 0.04):
            for edge in (k, k + 1):
                angle = edge * 2 * math.pi / PIECES
                x, y = radius * math.cos(angle), radius * math.sin(angle)
                lines += [f"v {x:.6f} {y:.6f} {z}" for z in (-0.005, 0.005)]
        lines += ["f " + " ".join(str(8 * k + corner + 1) for corner in face) for face in TRIANGLES]
    (folder / "ring.obj").write_text("\n".join(lines) + "\n")
    urdf = folder / "ring.urdf"
    urdf.write_text(RING)
    return urdf


def test_rings_of_hulls_stop_before_they_touch(client: int, tmp_path: Path) -> None:
    p.setGravity(0, 0, -9.8)
    places = [[x, y, 0] for x in (-0.1, 0.1) for y in (-0.1, 0.1)]
    plate = p.createCollisionShapeArray(
        shapeTypes=[p.GEOM_BOX] * 4,
        halfExtents=[[0.1, 0.1, 0.01]] * 4,
        radii=[0] * 4,
        collisionFramePositions=places,
    )
    p.createMultiBody(0, plate, basePosition=[0, 0, -0.01])
    ring = str(_write_ring(tmp_path))
    rings = [p.loadURDF(ring, [0, 0.05, 0.012]), p.loadURDF(ring, [0, 0.05, 0.027])]
    heights = {}
    for step in range(1, 241):
        p.stepSimulation()
        heights[step] = [p.getBasePositionAndOrientation(body)[0][2] for body in rings]
    steps = (8, 9, 10, 11, 16, 20, 30, 60, 240)
    expected = (
        *((0.005878, 0.020878), (0.005887, 0.019348), (0.005895, 0.017648), (0.005903, 0.017675)),
        *((0.005933, 0.017781), (0.005949, 0.017839), (0.005972, 0.017922), (0.005989, 0.017978)),
        (0.00599, 0.01798),
    )
    np.testing.assert_allclose([heights[step] for step in steps], expected, atol=5e-6)
    speeds = [np.linalg.norm(p.getBaseVelocity(body)) for body in rings]
    assert max(speeds) < 0.005


@pytest.mark.parametrize(
    ("angles", "is_compound"),
    [
        *(((0, 0, 0), False), ((1.57075, 1.57075, 0), True), ((1.5708, 0, 0), True)),
        *(((1.57079632679, 0, 0), False), ((3.14159, 0, 0), False), ((0, 1.57, 0), True)),
        *(((0, 0, 1.57), True), ((1.5708, 1.5708, 0), True), ((0.1, 0.2, 0.3), True)),
        *(((0, 0, 0.5), False), ((-1.5708, 0, 0), True), ((1.57, 0, 0), True)),
    ],
)
def test_rounding_decides_whether_a_turned_shape_is_at_its_inertial_frame(
    client: int, tmp_path: Path, angles: tuple[float, float, float], is_compound: bool
) -> None:
    """A compound is the first body of its contacts; of which frames it is one is as in PyBullet 3.2.7."""
    place = f'<origin rpy="{" ".join(map(repr, angles))}"/>'
    (tmp_path / "ball.urdf").write_text(
        f"""<robot name="ball"><link name="ball"><inertial>{place}<mass value="1"/>
        <inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>
        <collision>{place}<geometry><sphere radius="0.2"/></geometry></collision></link></robot>"""
    )
    ground = p.createMultiBody(
        0, p.createCollisionShape(p.GEOM_BOX, halfExtents=[5, 5, 0.1]), basePosition=[0, 0, -0.1]
    )
    ball = p.loadURDF(str(tmp_path / "ball.urdf"), [0, 0, 0.19])
    p.stepSimulation()
    assert p.getContactPoints()[0][1:3] == ((ball, ground) if is_compound else (ground, ball))
