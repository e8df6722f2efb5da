"""When contacts begin, how deep bodies rest and how hulls are rounded; the numbers are PyBullet 3.2.7's."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import roboyard.pybullet as p

CYLINDER = """<robot name="c"><link name="l"><inertial><mass value="1"/>
<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial><collision><geometry>
<cylinder radius="0.17775" length="0.1143"/></geometry></collision></link></robot>"""
BALL = """<robot name="b"><link name="l"><contact><lateral_friction value="1"/><friction_anchor/></contact>
<inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial><collision>
<geometry><sphere radius="0.04"/></geometry></collision></link></robot>"""
TORSO = """<inertial><mass value="2"/>
<inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial>"""
FOOT = """<link name="{name}"><contact><lateral_friction value="1"/>{contact}</contact><inertial>
<mass value="0.1"/><inertia ixx="1e-4" iyy="1e-4" izz="1e-4" ixy="0" ixz="0" iyz="0"/></inertial>
<collision><geometry><box size="0.02 0.02 0.06"/></geometry></collision></link>
<joint name="{name}" type="prismatic"><parent link="base"/><child link="{name}"/>
<origin xyz="{x} {y} -0.03"/><axis xyz="{ux} {uy} 0"/>
<limit lower="-0.05" upper="0.05" effort="50" velocity="1"/></joint>"""
TOUCHED = (-0.03846373, 0.01746565, -0.50824052)
"""Velocity (m/s) of PyBullet's robot on four feet after 14 steps."""
TURN = (1.5, 0.76, 0.0)


def _ground() -> int:
    p.setGravity(0, 0, -9.81)
    block = p.createCollisionShape(p.GEOM_BOX, halfExtents=[1, 1, 0.5])
    return p.createMultiBody(0, block, basePosition=[0, 0, -0.5])


def _box(half: float, height: float, turn: tuple[float, float, float] = (0, 0, 0)) -> int:
    shape = p.createCollisionShape(p.GEOM_BOX, halfExtents=[half] * 3)
    return p.createMultiBody(1, shape, -1, [0, 0, height], p.getQuaternionFromEuler(turn))


def test_a_box_at_rest_settles_ten_micrometres_deep(client: int) -> None:
    p.setTimeStep(1 / 500)
    _ground()
    box = _box(0.02, 0.02)
    forces = []
    for _ in range(4):
        p.stepSimulation()
        forces.append(sum(point[9] for point in p.getContactPoints(box)))
    np.testing.assert_allclose(forces, (7.312674, 12.293512, 9.808731, 9.814782), rtol=0.002)
    assert p.getBasePositionAndOrientation(box)[0][2] == pytest.approx(0.01999, abs=1e-6)


def test_a_ball_bounces_from_the_velocity_that_gravity_leads_to(client: int) -> None:
    ground = _ground()
    ball = p.createMultiBody(1, p.createCollisionShape(p.GEOM_SPHERE, radius=0.1), basePosition=[0, 0, 0.6])
    for body in (ground, ball):
        p.changeDynamics(body, -1, restitution=0.9)
    heights = []
    for step in range(240):
        p.stepSimulation()
        if step % 40 == 39:
            heights.append(p.getBasePositionAndOrientation(ball)[0][2])
    wanted = (0.460891, 0.126582, 0.410275, 0.4191, 0.157303, 0.312392)
    np.testing.assert_allclose(heights, wanted, atol=2e-5)


@pytest.mark.parametrize(
    ("offset", "wanted"),
    [
        (0.0, [(0.000742, 432.931, -0.180563), (-1e-05, 53.137, 0.0), (-1e-05, 9.81, 0.0)]),
        (0.02, [(-0.004562, 525.936, 0.087392), (-0.004198, 8.136, 0.0804), (-0.003863, 8.27, 0.073968)]),
    ],
)
def test_a_part_of_a_compound_is_stopped_once_it_touches(
    client: int, offset: float, wanted: list[tuple[float, float, float]]
) -> None:
    """A ball at the middle of its body is stopped before, one beside it is a compound."""
    _ground()
    shape = p.createCollisionShape(p.GEOM_SPHERE, radius=0.1, collisionFramePosition=[0, 0, offset])
    ball = p.createMultiBody(1, shape, basePosition=[0, 0, 0.3])
    seen = []
    for _ in range(70):
        p.stepSimulation()
        for point in p.getContactPoints(ball)[:1]:
            seen.append((point[8], point[9], p.getBaseVelocity(ball)[0][2]))
    np.testing.assert_allclose(seen[:3], wanted, rtol=1e-4, atol=2e-6)


def test_boxes_touch_where_they_overlap(client: int) -> None:
    _ground()
    box = _box(0.05, 0.25, (0.3, 0.2, 0))
    wanted = {
        60: (-0.00709, 0.00825, 0.04962, -0.00097, -0.00267, -0.05085, 0.9987),
        80: (-0.00816, 0.00969, 0.04992, -0.00021, -0.00049, -0.06326, 0.998),
        120: (-0.00811, 0.00967, 0.04999, -3e-05, 0.0, -0.06326, 0.998),
    }
    for step in range(1, 121):
        p.stepSimulation()
        if step in wanted:
            position, orientation = p.getBasePositionAndOrientation(box)
            np.testing.assert_allclose((*position, *orientation), wanted[step], atol=3e-5)


def test_the_corners_of_hulls_are_rounded_to_a_grid(client: int, tmp_path: Path) -> None:
    """The lowest corner of the exact prism is 44 micrometres deeper."""
    (tmp_path / "c.urdf").write_text(CYLINDER, encoding="utf-8")
    ground = _ground()
    body = p.loadURDF(str(tmp_path / "c.urdf"), [0, 0, 0.17775], p.getQuaternionFromEuler(TURN))
    p.performCollisionDetection()
    (contact,) = p.getContactPoints(body)
    assert contact[8] == pytest.approx(-0.00360041, abs=2e-7)
    assert p.getClosestPoints(body, ground, 0.1)[0][8] == pytest.approx(-0.00360041, abs=2e-7)


@pytest.mark.parametrize(
    ("kind", "height", "turn", "point", "distance"),
    [
        ("box", 0.0436, (0.7, 0.1, 0), (0.024776, -0.003498, -0.000954), -0.001954),
        ("box", 0.0420, (0.7, 0, 0), (0.0, -0.003498, 0.000137), -0.000863),
        ("cylinder", 0.0485, (0.5, 0.1, 0), (0.001115, -0.006216, -0.000688), -0.001688),
    ],
)
def test_edges_of_boxes_and_cylinders_are_round_on_hulls(
    client: int,
    kind: str,
    height: float,
    turn: tuple[float, float, float],
    point: tuple[float, float, float],
    distance: float,
) -> None:
    """Sharp ones would be 0.4 to 0.7 mm deeper."""
    corners = [[x, y, z] for x in (-0.1, 0.1) for y in (-0.06, 0.06) for z in (-0.04, 0.04)]
    block = p.createCollisionShape(p.GEOM_MESH, vertices=corners)
    hull = p.createMultiBody(0, block, basePosition=[0, 0, -0.04])
    if kind == "box":
        shape = p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.03] * 3)
    else:
        shape = p.createCollisionShape(p.GEOM_CYLINDER, radius=0.03, height=0.08)
    body = p.createMultiBody(1, shape, -1, [0, 0, height], p.getQuaternionFromEuler(turn))
    p.performCollisionDetection()
    (contact,) = p.getContactPoints(body, hull)
    np.testing.assert_allclose(contact[5], point, atol=3e-5)
    assert contact[8] == pytest.approx(distance, abs=2e-6)


@pytest.mark.parametrize(
    ("anchor", "wanted"),
    [(0, [(0.000520, 0.001301), (0.021937, 0.054842)]), (1, [(0.000576, 0.001440), (0.031132, 0.077830)])],
)
@pytest.mark.parametrize("is_file", [False, True])
def test_anchors_pull_creeping_contacts_back(
    client: int, tmp_path: Path, is_file: bool, anchor: int, wanted: list[tuple[float, float]]
) -> None:
    """A ball is pushed for a quarter of a second; its contact point creeps."""
    _ground()
    if is_file:
        (tmp_path / "b.urdf").write_text(BALL, encoding="utf-8")
        ball = p.loadURDF(str(tmp_path / "b.urdf"), [0, 0, 0.04])
        if not anchor:
            p.changeDynamics(ball, -1, frictionAnchor=0)
    else:
        shape = p.createCollisionShape(p.GEOM_SPHERE, radius=0.04)
        ball = p.createMultiBody(1, shape, basePosition=[0, 0, 0.04])
        p.changeDynamics(ball, -1, lateralFriction=1, frictionAnchor=anchor)
    places = []
    for step in range(240):
        if 60 <= step < 120:
            place = p.getBasePositionAndOrientation(ball)[0]
            p.applyExternalForce(ball, -1, [0.2, 0.5, 0], place, p.WORLD_FRAME)
        p.stepSimulation()
        if step in (79, 239):
            places.append(p.getBasePositionAndOrientation(ball)[0][:2])
    np.testing.assert_allclose(places, wanted, atol=3e-6)


@pytest.mark.parametrize(
    ("push", "early", "slide", "spread"),
    [
        ((4, 2, 0), None, (0, 0), 3e-6),
        ((6, 3, 0), (0.0005887, 0.0002946), (0.0683, 0.03405), 4.5e-4),
    ],
)
def test_boxes_on_boxes_hold_at_their_anchors(
    client: int,
    push: tuple[float, float, float],
    early: tuple[float, float] | None,
    slide: tuple[float, float],
    spread: float,
) -> None:
    """A flat box is pushed for a quarter of a second; without anchors it creeps by 1e-5 m.

    Where it slides, PyBullet holds or moves each point by the last bit of its friction: of 40 of its runs
    with pushes that differ by 1e-9, the ends are 0.0679 to 0.0687 m and 0.0339 to 0.0342 m away.
    """
    _ground()
    shape = p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.05, 0.05, 0.02])
    box = p.createMultiBody(1, shape, basePosition=[0, 0, 0.02])
    p.changeDynamics(box, -1, lateralFriction=1, frictionAnchor=1)
    for step in range(240):
        if 60 <= step < 120:
            place = p.getBasePositionAndOrientation(box)[0]
            p.applyExternalForce(box, -1, push, place, p.WORLD_FRAME)
        p.stepSimulation()
        if step == 65 and early:
            np.testing.assert_allclose(p.getBasePositionAndOrientation(box)[0][:2], early, atol=2e-7)
    moved = p.getBasePositionAndOrientation(box)[0][:2]
    np.testing.assert_allclose(moved, slide, atol=spread)
    assert len(p.getContactPoints(box)) == 4


@pytest.mark.parametrize(
    ("anchor", "creeps", "error"),
    [("", [(-1.31e-4, -0.13e-4), (-1.77e-4, -0.78e-4)], 1.5e-5), ("<friction_anchor/>", [(0, 0)], 3e-6)],
)
def test_feet_that_press_apart_creep_without_anchors_alone(
    client: int, tmp_path: Path, anchor: str, creeps: list[tuple[float, float]], error: float
) -> None:
    """As PyBullet's robot in 300 steps, by 1.3e-4 or 1.9e-4 m, and by less than 1e-6 m with anchors.

    Which of both it is depends on changes of 1e-9 in its first pose, there as well.
    """
    _ground()
    feet = "".join(
        FOOT.format(name=f"f{x}{y}", x=x, y=y, ux=x / 0.0164**0.5, uy=y / 0.0164**0.5, contact=anchor)
        for y in (0.08, -0.08)
        for x in (0.1, -0.1)
    )
    (tmp_path / "r.urdf").write_text(f'<robot name="r"><link name="base">{TORSO}</link>{feet}</robot>')
    robot = p.loadURDF(str(tmp_path / "r.urdf"), [0, 0, 0.08], p.getQuaternionFromEuler([0.02, 0.05, 0.3]))
    for joint in range(4):
        p.setJointMotorControl2(robot, joint, p.POSITION_CONTROL, 0.02, force=8)
    places = []
    for step in range(600):
        p.stepSimulation()
        if step in (299, 599):
            places.append(p.getBasePositionAndOrientation(robot)[0])
        if step == 13 and not anchor:  # one foot has touched down
            speed = p.getBaseVelocity(robot)[0]
            np.testing.assert_allclose(speed, TOUCHED, atol=1e-7)
    moved = np.subtract(*reversed(places))
    assert min(np.linalg.norm(moved - (*creep, 0)) for creep in creeps) <= error


HINGED = """<robot name="arm"><link name="base"/><link name="turn">{mass}{turn}</link>
<link name="rod">{mass}{rod}</link>
<joint name="turn" type="revolute"><parent link="base"/><child link="turn"/><axis xyz="0 1 0"/>
<limit lower="-3" upper="3" effort="9" velocity="9"/></joint>
<joint name="rod" type="{kind}"><parent link="turn"/><child link="rod"/><axis xyz="0 1 0"/>
<limit lower="-1" upper="1" effort="0" velocity="9"/></joint></robot>"""
MASS = """<inertial><origin xyz="0.5 0 0"/><mass value="1"/>
<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>"""
BEAM = '<collision><origin xyz="0.5 0 0"/><geometry><box size="1 0.2 0.2"/></geometry></collision>'


@pytest.mark.parametrize(
    ("kind", "shape_on", "target", "angle"),
    [
        ("fixed", "turn", "floor", 0.203),
        ("fixed", "rod", "floor", 1.814),  # through it
        ("fixed", "rod", "arm", 1.814),
        ("fixed", "rod", "box", 0.111),
        ("revolute", "rod", "floor", 1.181),
    ],
)
def test_what_is_fixed_to_the_first_link_of_a_fixed_body_passes_through_fixed_bodies(
    client: int, tmp_path: Path, kind: str, shape_on: str, target: str, angle: float
) -> None:
    """Bullet takes such a link for static: it looks at all joints up to the base but the first."""
    shapes = {"turn": "", "rod": "", shape_on: BEAM}
    (tmp_path / "arm.urdf").write_text(HINGED.format(kind=kind, mass=MASS, **shapes))
    p.setGravity(0, 0, -9.8)
    arm = p.loadURDF(str(tmp_path / "arm.urdf"), [0, 0, 0.3], useFixedBase=True)
    other = p.loadURDF(str(tmp_path / "arm.urdf"), [0, 0, -0.1], useFixedBase=True) if target == "arm" else -1
    for body in (arm, other):
        for joint in range(2 if body >= 0 else 0):
            p.setJointMotorControl2(body, joint, p.VELOCITY_CONTROL, force=0 if body == arm else 1e4)
    wide = p.createCollisionShape(p.GEOM_BOX, halfExtents=[2, 2, 0.5])
    if target == "floor":
        p.createMultiBody(0, wide, basePosition=[0, 0, -0.5])
    elif target == "box":
        slab = p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.3, 0.3, 0.05])
        p.createMultiBody(1e4, slab, basePosition=[0.6, 0, 0.05])
        p.createMultiBody(0, wide, basePosition=[0, 0, -0.501])
    for _ in range(120):
        p.stepSimulation()
    assert p.getJointState(arm, 0)[0] == pytest.approx(angle, abs=3e-3)


def test_links_taken_for_static_collide_with_a_body_of_a_former_id(client: int, tmp_path: Path) -> None:
    """Removing a fixed body forgets that it was passed through."""
    (tmp_path / "arm.urdf").write_text(HINGED.format(kind="fixed", mass=MASS, turn="", rod=BEAM))
    p.loadURDF(str(tmp_path / "arm.urdf"), [0, 0, 0.3], useFixedBase=True)
    floor = _ground()
    p.stepSimulation()
    p.removeBody(floor)
    ball = p.createMultiBody(
        1, p.createCollisionShape(p.GEOM_SPHERE, radius=0.1), basePosition=[0.5, 0, 0.49]
    )
    p.setGravity(0, 0, 0)
    p.stepSimulation()
    assert len(p.getContactPoints(ball)) == 1


def test_meshes_of_vertices_and_triangles_are_concave(client: int) -> None:
    """A ball in a groove, and a box that falls onto a wedge: numbers of PyBullet 3.2.7."""
    p.setGravity(0, 0, -9.8)
    corners = [[-1, -1, 1], [-1, 1, 1], [0, -1, 0], [0, 1, 0], [1, -1, 1], [1, 1, 1]]
    triangles = [0, 2, 1, 1, 2, 3, 2, 4, 3, 3, 4, 5, 0, 1, 2, 1, 3, 2, 2, 3, 4, 3, 5, 4]
    for indices, height in ((triangles, 0.141), (None, 1.101)):
        p.resetSimulation()
        p.setGravity(0, 0, -9.8)
        p.createMultiBody(0, p.createCollisionShape(p.GEOM_MESH, vertices=corners, indices=indices))
        ball = p.createCollisionShape(p.GEOM_SPHERE, radius=0.1)
        body = p.createMultiBody(1, ball, -1, [0.3, 0, 1.5])
        for _ in range(480):
            p.stepSimulation()
        assert p.getBasePositionAndOrientation(body)[0][2] == pytest.approx(height, abs=1e-3)
    p.resetSimulation()
    p.setGravity(0, 0, -9.8)
    wedge = [
        [0.5, 0.5, 0],
        [0.5, -0.5, 0],
        [-0.5, 0.5, 0],
        [-0.5, -0.5, 0],
        [-0.5, 0.5, 0.5],
        [-0.5, -0.5, 0.5],
    ]
    sides = [0, 1, 2, 1, 3, 2, 2, 3, 4, 3, 5, 4, 0, 4, 1, 1, 4, 5, 0, 2, 4, 1, 5, 3]
    p.createMultiBody(0, p.createCollisionShape(p.GEOM_MESH, vertices=wedge, indices=sides))
    turn = [0.000845212, 0.00375727, 0.001790345, 0.99999099]
    box = p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.05] * 3)
    body = p.createMultiBody(1, box, -1, [8.98e-05, -1.527e-04, 2.0], turn)
    for _ in range(400):
        p.stepSimulation()
    place = [2.4433, -0.3072, -3.6546]
    assert p.getBasePositionAndOrientation(body)[0] == pytest.approx(place, abs=1e-3)
