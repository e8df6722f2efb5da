"""Concave meshes of bodies that move are met at their triangles; numbers are those of PyBullet 3.2.7."""

from __future__ import annotations

from pathlib import Path

import pytest

import roboyard.pybullet as p
from roboyard.sim.stepping.narrow_phase import field_contacts

TRAY = """
v -.5 -.5 0\nv .5 -.5 0\nv .5 .5 0\nv -.5 .5 0\nv -.5 -.5 .3\nv .5 -.5 .3\nv -.5 .5 .3\nv .5 .5 .3
f 1 2 3\nf 1 3 4\nf 1 6 2\nf 1 5 6\nf 4 3 8\nf 4 8 7\nf 1 4 7\nf 1 7 5\nf 2 6 8\nf 2 8 3
"""
DRAWER = """<robot name="d"><link name="base"/><link name="drawer">
<inertial><mass value="2"/><inertia ixx=".1" iyy=".1" izz=".1" ixy="0" ixz="0" iyz="0"/></inertial>
<collision concave="yes"><geometry><mesh filename="tray.obj"/></geometry></collision></link>
<joint name="j" type="{}"><parent link="base"/><child link="drawer"/><axis xyz="{}"/>
<limit lower="-1" upper="1" effort="100" velocity="5"/></joint></robot>"""


@pytest.fixture
def tray(client: int, tmp_path: Path) -> Path:
    p.setGravity(0, 0, -10)
    (tmp_path / "tray.obj").write_text(TRAY)
    return tmp_path / "tray.obj"


def _load(tray: Path, kind: str, axis: str, flags: int) -> int:
    file = tray.with_name("drawer.urdf")
    file.write_text(DRAWER.format(kind, axis))
    return p.loadURDF(str(file), [0, 0, 0.5], useFixedBase=True, flags=flags)


def _ball(x: float, y: float) -> int:
    return p.createMultiBody(0.2, p.createCollisionShape(p.GEOM_SPHERE, radius=0.06), -1, [x, y, 0.7])


@pytest.mark.parametrize(
    ("kind", "axis", "start", "target", "force", "opened", "place"),
    [
        ("prismatic", "1 0 0", (0.2, 0.2), 0.3, 50, 0.29880186468160785, (0.2742778250289733, 0.2)),
        ("revolute", "0 0 1", (0.25, 0.2), 1.5, 5, 1.0, (0.1927686780156575, 0.25655560297412494)),
    ],
)
def test_a_ball_is_taken_along_in_a_drawer(
    tray: Path,
    kind: str,
    axis: str,
    start: tuple[float, float],
    target: float,
    force: float,
    opened: float,
    place: tuple[float, float],
) -> None:
    drawer = _load(tray, kind, axis, p.URDF_USE_INERTIA_FROM_FILE if kind == "revolute" else 0)
    ball = _ball(*start)
    p.setJointMotorControl2(drawer, 0, p.VELOCITY_CONTROL, targetVelocity=target, force=force)
    for _ in range(240):
        p.stepSimulation()
    assert p.getJointState(drawer, 0)[0] == pytest.approx(opened, abs=2e-6)
    assert p.getBasePositionAndOrientation(ball)[0] == pytest.approx((*place, 0.55999), abs=2e-6)
    assert {point[3:5] for point in p.getContactPoints(drawer, ball)} == {(0, -1)}
    hit = p.rayTest([*place, 5], [*place, 0.52])[0]
    assert hit[0] == ball, "and not the hull"


def test_a_tray_falls_through_a_plane_and_rests_on_a_box(tray: Path) -> None:
    """Bullet has no points of triangles on planes, and none of triangles on triangles."""
    shape = p.createCollisionShape(p.GEOM_MESH, fileName=str(tray), flags=p.GEOM_FORCE_CONCAVE_TRIMESH)
    falling = p.createMultiBody(1, shape, -1, [3, 0, 1])
    resting = p.createMultiBody(1, shape, -1, [0, 0, 0.6])
    p.createMultiBody(0, p.createCollisionShape(p.GEOM_PLANE))
    p.createMultiBody(0, p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.6, 0.6, 0.25]), -1, [0, 0, 0.25])
    ball = _ball(0.1, 0.2)
    for _ in range(240):
        p.stepSimulation()
    assert p.getBasePositionAndOrientation(falling)[0] == pytest.approx((3, 0, -3.661940585608515), abs=1e-7)
    assert p.getBasePositionAndOrientation(resting)[0][2] == pytest.approx(0.49999, abs=5e-6)
    assert p.getBasePositionAndOrientation(ball)[0][2] == pytest.approx(0.55999, abs=1e-6)


def test_bullet_computes_no_moments_of_triangles(tray: Path) -> None:
    shape = p.createCollisionShape(p.GEOM_MESH, fileName=str(tray), flags=p.GEOM_FORCE_CONCAVE_TRIMESH)
    assert p.getDynamicsInfo(p.createMultiBody(2, shape), -1)[2] == (0.0, 0.0, 0.0)
    assert p.getDynamicsInfo(_load(tray, "revolute", "0 0 1", 0), 0)[2] == (0.0, 0.0, 0.0)


def test_hulls_collide_where_triangles_are_not_searched(tray: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(field_contacts, "are_known", lambda model, forms: False)
    drawer, ball = _load(tray, "prismatic", "1 0 0", 0), _ball(0.2, 0.2)
    p.setJointMotorControl2(drawer, 0, p.VELOCITY_CONTROL, force=50)
    p.resetBasePositionAndOrientation(ball, [0.2, 0.2, 1.0], [0, 0, 0, 1])
    for _ in range(240):
        p.stepSimulation()
    assert p.getBasePositionAndOrientation(ball)[0][2] == pytest.approx(0.86, abs=3e-3)
