"""Boxes, margins and inertias of collision shapes, in figures of real PyBullet 3.2.7."""

from __future__ import annotations

import struct
from itertools import product
from pathlib import Path

import numpy as np
import pytest

import roboyard.pybullet as p

AT = '<inertial><mass value="2"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>'
OFF = AT.replace("<mass", '<origin xyz="0.1 0 0.2" rpy="0.1 0.2 0.3"/><mass')
SHAPES = {
    "ball": '<sphere radius="0.1"/>',
    "box": '<box size="0.1 0.2 0.3"/>',
    "cylinder": '<cylinder radius="0.1" length="0.4"/>',
    "capsule": '<capsule radius="0.1" length="0.4"/>',
    "two": '<mesh filename="two.obj"/>',
}
FIGURES = {
    ("ball", AT): ((0.008, 0.008, 0.008), 0.1, ((0.9, 1.9, 2.9), (1.1, 2.1, 3.1))),
    ("ball", OFF): (
        (0.0136013333, 0.0136013333, 0.0136013333),
        0.001,
        ((0.8274034, 1.8549321, 2.8333188), (1.1725966, 2.1450679, 3.1666812)),
    ),
    ("box", AT): (
        (0.0216666667, 0.0166666667, 0.0083333333),
        0.001,
        ((0.8447368, 1.8810526, 2.8184211), (1.1552632, 2.1189474, 3.1815789)),
    ),
    ("box", OFF): (
        (0.0279009575, 0.0250445678, 0.0180015543),
        0.001,
        ((0.7719717, 1.8338223, 2.7715006), (1.2280283, 2.1661777, 3.2284994)),
    ),
    ("cylinder", AT): (
        (0.034545332, 0.034545332, 0.0141453328),
        0.001,
        ((0.7829263, 1.8444421, 2.7548421), (1.2170737, 2.1555579, 3.2451579)),
    ),
    ("cylinder", OFF): (
        (0.0477430083, 0.051867864, 0.0326941334),
        0.001,
        ((0.6938499, 1.7703587, 2.6893793), (1.3061501, 2.2296413, 3.3106207)),
    ),
    ("capsule", AT): (
        (0.066666664, 0.066666664, 0.0133333328),
        0.1,
        ((0.7421053, 1.8410526, 2.6684211), (1.2578947, 2.1589474, 3.3315789)),
    ),
    ("capsule", OFF): (
        (0.0835847043, 0.0902486286, 0.0380823501),
        0.001,
        ((0.6237582, 1.7483427, 2.6042095), (1.3762418, 2.2516573, 3.3957905)),
    ),
    ("two", AT): (
        (0.0226786681, 0.076812006, 0.0682786717),
        0.001,
        ((0.8896526, 1.9766632, 2.8059474), (1.5735053, 2.5286, 3.3361579)),
    ),
    ("two", OFF): (
        (0.0584086215, 0.1116315045, 0.1054082585),
        0.001,
        ((0.8152116, 1.8479675, 2.6706944), (1.6479463, 2.6572957, 3.4714108)),
    ),
}


def _cuboid(name: str, x: float, first: int) -> str:
    """OBJ lines of an object of 0.1 × 0.2 × 0.3 m whose least corner is at x on the x axis."""
    corners = [(x + 0.1 * i, 0.2 * j, 0.3 * k) for i in (0, 1) for j in (0, 1) for k in (0, 1)]
    sides = ((1, 2, 4, 3), (5, 6, 8, 7), (1, 2, 6, 5), (3, 4, 8, 7), (1, 3, 7, 5), (2, 4, 8, 6))
    lines = [f"o {name}", *(f"v {a:g} {b:g} {c:g}" for a, b, c in corners)]
    lines += ["f " + " ".join(str(first + k) for k in side) for side in sides]
    return "\n".join(lines) + "\n"


def _robot(folder: Path, shape: str, inertial: str, contact: str = "", filters: str = "") -> str:
    (folder / "two.obj").write_text(_cuboid("one", 0.0, 0) + _cuboid("other", 0.5, 8))
    path = folder / f"robot{len(list(folder.iterdir()))}.urdf"
    path.write_text(
        f'<robot name="r"><link name="l">{contact}{inertial}<collision {filters}><geometry>{SHAPES[shape]}'
        "</geometry></collision></link></robot>"
    )
    return str(path)


@pytest.mark.parametrize(("shape", "inertial"), FIGURES)
def test_moments_margin_and_box(client: int, tmp_path: Path, shape: str, inertial: str) -> None:
    moments, margin, box = FIGURES[shape, inertial]
    body = p.loadURDF(_robot(tmp_path, shape, inertial), [1, 2, 3], [0.1, 0.2, 0.3, 0.9])
    found = p.getDynamicsInfo(body, -1)
    np.testing.assert_allclose(found[2], moments, rtol=1e-7)
    assert found[11] == pytest.approx(margin)
    np.testing.assert_allclose(p.getAABB(body), box, atol=2e-7)


_CORNERS = ((-0.124613404, -0.129396826, -0.167867854), (0.192341551, 0.119006768, 0.163659334))
"""Of a box at which Bullet's rounding takes a step of 0.02 mm from y, and nothing from x and z."""
_FACES = (0, 1, 3), (0, 3, 2), (4, 6, 7), (4, 7, 5), (0, 4, 5), (0, 5, 1)
_OTHERS = (2, 3, 7), (2, 7, 6), (0, 2, 6), (0, 6, 4), (1, 5, 7), (1, 7, 3)


@pytest.mark.parametrize(
    ("kind", "box", "moments"),
    [
        (
            "stl",
            ((-0.126613404, -0.131372511, -0.169867854), (0.194341551, 0.120982453, 0.165659334)),
            (0.0297701739, 0.0363707496, 0.0281660573),
        ),
        (
            "obj",
            ((-0.127613404, -0.132396826, -0.170867854), (0.195341551, 0.122006768, 0.166659334)),
            (0.0297742986, 0.0363707510, 0.0281701820),
        ),
    ],
)
def test_hulls_of_files_are_rounded_but_for_those_of_obj_files(
    client: int, tmp_path: Path, kind: str, box: tuple[tuple[float, ...], ...], moments: tuple[float, ...]
) -> None:
    corners = np.array(list(product(*zip(*_CORNERS, strict=True))))
    faces = np.array(_FACES + _OTHERS)
    if kind == "stl":
        records = b"".join(struct.pack("<12fH", 0, 0, 0, *corners[face].ravel(), 0) for face in faces)
        (tmp_path / "box.stl").write_bytes(b" " * 80 + struct.pack("<I", len(faces)) + records)
    else:
        lines = ["v {} {} {}".format(*corner) for corner in corners]
        lines += ["f {} {} {}".format(*face) for face in faces + 1]
        (tmp_path / "box.obj").write_text("\n".join(lines))
    shape = f'<collision><geometry><mesh filename="box.{kind}"/></geometry></collision>'
    file = tmp_path / "box.urdf"
    file.write_text(f'<robot name="box"><link name="box">{AT}{shape}</link></robot>')
    body = p.loadURDF(str(file))
    np.testing.assert_allclose(p.getAABB(body), box, atol=1e-8)
    np.testing.assert_allclose(p.getDynamicsInfo(body, -1)[2], moments, rtol=1e-7)


def test_each_object_of_an_obj_file_has_a_hull(client: int, tmp_path: Path) -> None:
    body = p.loadURDF(_robot(tmp_path, "two", AT), useFixedBase=True)
    (between,) = p.rayTest([0.3, 0.1, 3], [0.3, 0.1, -3])
    (through,) = p.rayTest([0.05, 0.1, 3], [0.05, 0.1, -3])
    assert between[0] == -1 and through[0] == body
    assert len(p.getCollisionShapeData(body, -1)) == 1


def test_a_contact_element_scales_the_inertia(client: int, tmp_path: Path) -> None:
    contact = '<contact><inertia_scaling value="2.5"/></contact>'
    body = p.loadURDF(_robot(tmp_path, "box", AT, contact))
    np.testing.assert_allclose(
        p.getDynamicsInfo(body, -1)[2], (0.0541666667, 0.0416666667, 0.0208333333), rtol=1e-8
    )


def test_collisions_of_a_file_have_groups_and_masks(client: int, tmp_path: Path) -> None:
    p.createMultiBody(0, p.createCollisionShape(p.GEOM_PLANE))
    p.setGravity(0, 0, -10)
    passes = p.loadURDF(_robot(tmp_path, "box", AT, filters='group="0" mask="0"'), [0, 0, 0.16])
    rests = p.loadURDF(_robot(tmp_path, "box", AT), [1, 0, 0.16])
    for _ in range(60):
        p.stepSimulation()
    assert p.getBasePositionAndOrientation(passes)[0][2] < 0
    assert p.getBasePositionAndOrientation(rests)[0][2] == pytest.approx(0.15, abs=2e-3)


def test_boxes_of_bodies_made_by_code(client: int) -> None:
    """A sphere's margin is its radius and cannot be changed; a plane's box is unlimited."""
    ball = p.createMultiBody(1, p.createCollisionShape(p.GEOM_SPHERE, radius=0.1), -1, [0, 0, 1])
    p.changeDynamics(ball, -1, collisionMargin=0.02)
    assert p.getDynamicsInfo(ball, -1)[11] == 0.1
    assert p.getAABB(ball) == ((-0.1, -0.1, 0.9), (0.1, 0.1, 1.1))
    plane = p.createMultiBody(0, p.createCollisionShape(p.GEOM_PLANE))
    assert p.getAABB(plane) == ((-1e30,) * 3, (1e30,) * 3)
    nothing = p.createMultiBody(1, basePosition=[1, 2, 3])
    assert p.getAABB(nothing) == ((1.0, 2.0, 3.0),) * 2 and p.getDynamicsInfo(nothing, -1)[11] == 0.0
    rod = p.createMultiBody(2, p.createCollisionShape(p.GEOM_CYLINDER, radius=0.1, height=0.5))
    np.testing.assert_allclose(p.getDynamicsInfo(rod, -1)[2], (0.0466666667, 0.0466666667, 0.01), rtol=1e-8)
    p.changeDynamics(rod, -1, mass=4, collisionMargin=0.02)
    np.testing.assert_allclose(p.getDynamicsInfo(rod, -1)[2], (0.0933333333, 0.0933333333, 0.02), rtol=1e-8)


def test_joint_state_of_a_ball_joint_starts_with_x(client: int) -> None:
    ball = p.createCollisionShape(p.GEOM_SPHERE, radius=0.1)
    body = p.createMultiBody(
        1, ball, linkMasses=[1], linkCollisionShapeIndices=[ball], linkVisualShapeIndices=[-1],
        linkPositions=[[0, 0, 1]], linkOrientations=[[0, 0, 0, 1]], linkInertialFramePositions=[[0, 0, 0]],
        linkInertialFrameOrientations=[[0, 0, 0, 1]], linkParentIndices=[0],
        linkJointTypes=[p.JOINT_SPHERICAL], linkJointAxis=[[0, 0, 1]],
    )  # fmt: skip
    assert p.getJointState(body, 0)[0] == 0.0
    p.resetJointStateMultiDof(body, 0, [0.6, 0, 0, 0.8])
    assert p.getJointState(body, 0)[0] == pytest.approx(0.6)


def test_boxes_of_capsules_between_two_points(client: int, tmp_path: Path) -> None:
    """Bullet makes them hulls of two balls, whose box is 0.04 m larger on each side."""
    (tmp_path / "m.xml").write_text(
        '<mujoco model="m"><worldbody><body name="a" pos="0 0 1"><geom type="capsule" size="0.08" '
        'fromto="0 0 0 0.2 0.2 0"/><geom type="sphere" size="0.1" pos="0 0 0.3"/></body></worldbody></mujoco>'
    )
    body = p.loadMJCF(str(tmp_path / "m.xml"))[-1]
    np.testing.assert_allclose(p.getAABB(body), [(-0.12, -0.12, 0.88), (0.32, 0.32, 1.4)], atol=1e-7)
    assert p.getDynamicsInfo(body, -1)[11] == 0.0
