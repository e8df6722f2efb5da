"""Contacts of shapes with round edges, and of points that slide; the numbers are PyBullet 3.2.7's."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import roboyard.pybullet as p

HULL = [
    [0.1, 0, 0],
    [-0.08, 0.1, 0],
    [-0.05, -0.09, 0.02],
    [0, 0, 0.12],
    [0.02, 0.03, -0.1],
    [-0.04, 0.01, -0.08],
]
SLAB = [[x, y, z] for x in (-2, 2) for y in (-2, 2) for z in (-0.5, 0)]
LYING = (0, 1.5708, 0)
GROUNDS = {
    "box": ({"shapeType": p.GEOM_BOX, "halfExtents": [0.2, 0.15, 0.1]}, -0.1, (0, 0, 0)),
    "plane": ({"shapeType": p.GEOM_PLANE}, 0.0, (0, 0, 0)),
    "hull": ({"shapeType": p.GEOM_MESH, "vertices": SLAB}, 0.0, (0, 0, 0)),
    "capsule": ({"shapeType": p.GEOM_CAPSULE, "radius": 0.3, "height": 3}, -0.3, LYING),
    "cylinder": ({"shapeType": p.GEOM_CYLINDER, "radius": 1, "height": 0.5}, -0.25, (0, 0, 0)),
}
"""Shape, height and Euler angles of what is thrown on."""
SHAPES = {
    "sphere": {"shapeType": p.GEOM_SPHERE, "radius": 0.1},
    "capsule": {"shapeType": p.GEOM_CAPSULE, "radius": 0.08, "height": 0.3},
    "cylinder": {"shapeType": p.GEOM_CYLINDER, "radius": 0.1, "height": 0.2},
    "hull": {"shapeType": p.GEOM_MESH, "vertices": HULL},
    "box": {"shapeType": p.GEOM_BOX, "halfExtents": [0.1, 0.08, 0.06]},
}
THROWN = {
    ("box", "sphere"): (0.4303451, 0.1200625, -0.2006895, 0.900506, 0.207446, -2.382442),
    ("box", "capsule"): (0.4307315, 0.0941238, -0.2280705, 0.888523, 0.103584, -2.405349),
    ("box", "cylinder"): (0.4420047, 0.0892967, -0.2064884, 0.939504, 0.098236, -2.407044),
    ("box", "hull"): (0.4687066, 0.1459266, -0.3356430, 1.020701, 0.301015, -2.717708),
    ("plane", "capsule"): (0.3517846, 0.1690841, 0.0790753, 0.438162, 0.514100, 0.005645),
    ("plane", "cylinder"): (0.3774883, 0.1732036, 0.0990454, 0.594676, 0.506710, 0.005341),
    ("hull", "hull"): (0.3361480, 0.0859044, 0.0526661, 0.230208, -0.042912, -0.027747),
    ("hull", "box"): (0.3546662, 0.0740049, 0.0789686, 0.286043, 0.024761, 0.020102),
    ("capsule", "capsule"): (0.3550472, 0.2363722, -0.0023630, 0.541647, 0.898423, -0.696898),
    ("capsule", "hull"): (0.3772774, 0.2146545, 0.0132194, 0.602505, 0.684050, -0.628208),
    ("cylinder", "cylinder"): (0.3778206, 0.1730490, 0.0989109, 0.588272, 0.519121, -0.007588),
    ("cylinder", "box"): (0.3608130, 0.0701382, 0.0777318, 0.305250, 0.013590, 0.018082),
}
"""Place (m) and velocity (m/s) after 100 steps, with impacts at edges, some of them deep."""


def _shape(arguments: dict) -> int:
    return p.createCollisionShape(**arguments)


@pytest.mark.parametrize(("ground", "shape"), THROWN)
def test_what_is_thrown_moves_as_there(client: int, ground: str, shape: str) -> None:
    p.setGravity(0, 0, -9.81)
    arguments, height, turn = GROUNDS[ground]
    p.createMultiBody(0, _shape(arguments), -1, [0, 0, height], p.getQuaternionFromEuler(turn))
    body = p.createMultiBody(
        1, _shape(SHAPES[shape]), -1, [0.01, 0.02, 0.2], p.getQuaternionFromEuler([1.3, 0.2, 0.4])
    )
    p.resetBaseVelocity(body, [1.2, 0.3, 0], [0, 3, 1])
    for _ in range(100):
        p.stepSimulation()
    found = p.getBasePositionAndOrientation(body)[0] + p.getBaseVelocity(body)[0]
    np.testing.assert_allclose(found, THROWN[ground, shape], atol=3e-6)


@pytest.mark.parametrize(
    ("lean", "normal", "distance"),
    [
        ((0, 0, 0), (-0.237206, -0.925104, -0.296508), -0.0003137),
        ((0.5, 0.3, 0.2), (-0.237599, -0.925012, -0.296478), -0.0003135),
    ],
)
def test_a_corner_beside_a_round_corner_pushes_along_the_way_between(
    client: int, lean: tuple[float, float, float], normal: tuple[float, float, float], distance: float
) -> None:
    """A hull's corner is a tenth of a millimetre beside the edge of a cube, which is round by 1 mm."""
    p.setTimeStep(1 / 500)
    p.createMultiBody(1, _shape({"shapeType": p.GEOM_BOX, "halfExtents": [0.02] * 3}))
    turn = np.array(p.getMatrixFromQuaternion(p.getQuaternionFromEuler(lean))).reshape(3, 3)
    tip = np.array([[0, 0, 0], [0.01, 0.03, 0.01], [-0.01, 0.03, 0.01], [0, 0.03, -0.01]]) @ turn.T
    hull = {"shapeType": p.GEOM_MESH, "vertices": tip.tolist()}
    p.createMultiBody(0, _shape(hull), -1, [0.0194, 0.02056, 0.0195])
    p.stepSimulation()
    (point,) = p.getContactPoints()
    np.testing.assert_allclose(point[7], normal, atol=2e-6)
    assert point[8] == pytest.approx(distance, abs=1e-7)


CAR = """<robot name="car"><link name="base"><inertial><mass value="10"/>
<inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial></link>{wheels}</robot>"""
WHEEL = """<link name="{n}"><inertial><mass value="1"/>
<inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial><collision>
<origin rpy="1.5708 0 0" xyz="0 0 0"/>
<geometry><cylinder radius="0.17" length="0.11"/></geometry></collision></link>
<joint name="j{n}" type="continuous"><parent link="base"/><child link="{n}"/><origin xyz="{x} {y} 0"/>
<axis xyz="0 1 0"/></joint>"""

DRIVEN = (
    0.9306254,
    -0.0383243,
    0.1709506,
    0.6978800,
    -0.0729953,
    0.0065606,
    -0.0519076,
    0.0128039,
    -0.0910713,
)
"""Place (m), velocity (m/s) and turning (rad/s) of the car after 1.5 s."""


def test_a_car_drives_as_there(client: int, tmp_path: Path) -> None:
    """Its wheels are prisms of 32 sides, whose points slide, end and follow each other as the wheels roll."""
    places = [(0.25, 0.28), (0.25, -0.28), (-0.25, 0.28), (-0.25, -0.28)]
    wheels = "".join(WHEEL.format(n=f"w{k}", x=x, y=y) for k, (x, y) in enumerate(places))
    (tmp_path / "car.urdf").write_text(CAR.format(wheels=wheels), encoding="utf-8")
    p.setGravity(0, 0, -9.81)
    p.createMultiBody(0, _shape({"shapeType": p.GEOM_BOX, "halfExtents": [50, 50, 5]}), -1, [0, 0, -5])
    car = p.loadURDF(str(tmp_path / "car.urdf"), [0, 0, 0.2])
    for step in range(360):
        for joint in range(4):
            speed = 4 + (-1) ** joint * np.sin(step / 240)
            p.setJointMotorControl2(car, joint, p.VELOCITY_CONTROL, targetVelocity=speed, force=10)
        p.stepSimulation()
    found = p.getBasePositionAndOrientation(car)[0] + p.getBaseVelocity(car)[0] + p.getBaseVelocity(car)[1]
    np.testing.assert_allclose(found, DRIVEN, atol=2e-6)
