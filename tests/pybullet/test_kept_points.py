"""Contact points that pairs of hulls keep from step to step; the numbers are PyBullet 3.2.7's."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

import roboyard.pybullet as p
from roboyard.sim.stepping.manifolds import Manifolds

CORNERS = [[x, y, z] for x in (-0.1, 0.1) for y in (-0.06, 0.06) for z in (-0.04, 0.04)]
HEIGHTS = {0: 0.04737, 4: 0.04551, 7: 0.0427, 8: 0.04169, 9: 0.04055, 10: 0.04055, 239: 0.04099}
FORCES = {0: [2.326], 4: [2.058], 7: [1.994], 8: [0.0, 13.69], 9: [0.0, 1.876], 10: [0.0, 26.808, 48.784]}
"""Normal forces (N), in order of size, of a tilted hull that falls from one corner on the next."""


def _tilted_hull() -> tuple[int, int]:
    p.setGravity(0, 0, -9.81)
    block = p.createCollisionShape(p.GEOM_BOX, halfExtents=[1, 1, 0.5])
    ground = p.createMultiBody(0, block, basePosition=[0, 0, -0.5])
    hull = p.createMultiBody(
        1,
        p.createCollisionShape(p.GEOM_MESH, vertices=CORNERS),
        basePosition=[0, 0, 0.0475],
        baseOrientation=p.getQuaternionFromEuler([0.03, 0.05, 0]),
    )
    p.changeDynamics(hull, -1, linearDamping=0, angularDamping=0)
    return ground, hull


def test_a_tilted_hull_comes_to_rest_corner_by_corner(client: int) -> None:
    ground, hull = _tilted_hull()
    for step in range(240):
        p.stepSimulation()
        points = p.getContactPoints(hull, ground)
        if step in FORCES:
            forces = sorted(point[9] for point in points)
            np.testing.assert_allclose(forces, FORCES[step], rtol=0.04, atol=0.02)
            for point in points:
                np.testing.assert_allclose(point[7], (0, 0, 1), atol=1e-5)
        if step in HEIGHTS:
            height = p.getBasePositionAndOrientation(hull)[0][2]
            assert height == pytest.approx(HEIGHTS[step], abs=3e-5)
    points = p.getContactPoints(hull, ground)
    assert len(points) == 4
    assert sum(point[9] for point in points) == pytest.approx(9.81, rel=1e-3)


def test_a_restored_state_has_the_points_of_its_moment(client: int) -> None:
    _, hull = _tilted_hull()
    for _ in range(10):
        p.stepSimulation()
    state = p.saveState()
    runs = []
    for _ in range(2):
        p.restoreState(state)
        run = []
        for _ in range(30):
            p.stepSimulation()
            run.append(p.getBasePositionAndOrientation(hull))
        runs.append(run)
    assert runs[0] == runs[1]
    assert len(p.getContactPoints(hull)) == 4


def test_states_restored_into_the_same_arrays_go_on_as_in_new_ones(
    client: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """States with and without points, with detections between: motion to the last bit."""
    _, hull = _tilted_hull()
    block = p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.1, 0.1, 0.1])
    boxes = [p.createMultiBody(1, block, -1, [0.5, 0.05 * k, 0.1 + 0.22 * k]) for k in range(3)]
    first = p.saveState()
    states = [first]
    for count in (12, 40):
        for _ in range(count):
            p.stepSimulation()
        states.append(p.saveState())
    runs, found = [], list[list[list[np.ndarray]]]()
    for is_new in (False, True):
        found.append([])
        if is_new:
            monkeypatch.setattr(Manifolds, "_bind", lambda self, *given: self._bind_new(*given, keeps=True))
        run = []
        for number in (1, 0, 2, 1, 1, 0, 0, 2, 2, 1):
            p.restoreState(states[number])
            if number == 2:
                p.performCollisionDetection()
                points = sorted(p.getContactPoints(), key=lambda point: np.round(point[5], 6).tolist())
                found[-1].append([np.hstack(point[5:9]) for point in points])
            if number == 1:
                p.setCollisionFilterGroupMask(boxes[1], -1, 1, 1)
            for _ in range(25):
                p.stepSimulation()
            run.append([p.getBasePositionAndOrientation(body) for body in (hull, *boxes)])
            run.append(sorted(p.getContactPoints()))
        runs.append(run)
    assert runs[0] == runs[1]
    for one, two in zip(*found, strict=True):  # by loops that may round otherwise, which chooses corners
        np.testing.assert_allclose(one, two, rtol=0, atol=1e-15)


def test_points_outlive_bodies_that_come_and_go(client: int) -> None:
    ground, hull = _tilted_hull()
    first = p.createMultiBody(1, p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.1] * 3), -1, [3, 0, 0.1])
    for _ in range(60):
        p.stepSimulation()
    assert len(p.getContactPoints(hull, ground)) == 4
    p.removeBody(first)
    p.createMultiBody(1, p.createCollisionShape(p.GEOM_SPHERE, radius=0.3), -1, [-3, 0, 0.3])
    p.stepSimulation()
    assert len(p.getContactPoints(hull, ground)) == 4


def test_points_end_where_the_body_is_put_elsewhere(client: int) -> None:
    ground, hull = _tilted_hull()
    for _ in range(60):
        p.stepSimulation()
    p.resetBasePositionAndOrientation(hull, [0.3, 0.3, 0.0475], p.getQuaternionFromEuler([0.03, 0.05, 0]))
    p.stepSimulation()
    assert len(p.getContactPoints(hull, ground)) == 1


def test_contacts_are_detected_with_the_points_that_were_kept(client: int) -> None:
    ground, hull = _tilted_hull()
    for _ in range(60):
        p.stepSimulation()
    p.performCollisionDetection()
    assert len(p.getContactPoints(hull, ground)) == 4


def test_contacts_that_become_more_and_fewer_have_room(client: int) -> None:
    """Hulls in two heaps, of which one is taken away and dropped again."""
    _, first = _tilted_hull()
    shape = p.createCollisionShape(p.GEOM_MESH, vertices=CORNERS)
    hulls = [first] + [p.createMultiBody(1, shape, -1, [0.3 * k - 0.5, 0.3, 0.05]) for k in range(5)]
    for round_ in range(6):
        for k, hull in enumerate(hulls[1:]):
            away = round_ % 2 and k > 0
            p.resetBasePositionAndOrientation(
                hull, [0.3 * k - 0.5, 0.3, 3.0 if away else 0.041], [0, 0, 0, 1]
            )
            p.resetBaseVelocity(hull, [0, 0, 0], [0, 0, 0])
        for _ in range(30):
            p.stepSimulation()
        resting = hulls[1:2] if round_ % 2 else hulls[1:]
        for hull in resting:
            points = p.getContactPoints(hull)
            assert 3 <= len(points) <= 4
            assert sum(point[9] for point in points) == pytest.approx(9.81, rel=0.02)


WHEEL = """<robot name="wheel"><link name="w"><inertial><mass value="1"/>
<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>
<collision><geometry><cylinder radius="0.05" length="0.04"/></geometry></collision></link></robot>"""
FLOOR = """<robot name="floor"><link name="f"><inertial><mass value="0"/>
<inertia ixx="0" iyy="0" izz="0" ixy="0" ixz="0" iyz="0"/></inertial><collision><origin xyz="0 0 -0.5"/>
<geometry><box size="10 10 1"/></geometry></collision></link></robot>"""


def test_a_wheel_of_a_file_rolls_on_the_edges_of_a_prism(client: int, tmp_path: Path) -> None:
    """The first push, the places after 20 and 60 steps, and the contacts' distance, are real PyBullet's.

    The first steps agree wholly; from then on Bullet finds the middle of an edge, MuJoCo one of its ends.
    """
    for name, text in (("wheel", WHEEL), ("floor", FLOOR)):
        (tmp_path / f"{name}.urdf").write_text(text, encoding="utf-8")
    p.setGravity(0, 0, -9.81)
    p.loadURDF(str(tmp_path / "floor.urdf"), useFixedBase=True)
    wheel = p.loadURDF(str(tmp_path / "wheel.urdf"), [0, 0, 0.0515], [0.5**0.5, 0, 0, 0.5**0.5])
    p.resetBaseVelocity(wheel, [0.5, 0, 0], [0, 10, 0])
    places = []
    for step in range(1, 61):
        p.stepSimulation()
        places += [c[6][0] for c in p.getContactPoints(wheel) if c[9] > 0.0]
        if step == 3:
            (contact,) = p.getContactPoints(wheel)
            np.testing.assert_allclose((contact[8], contact[9]), (0.000162, 9.658), atol=6e-4)
            np.testing.assert_allclose(
                p.getBaseVelocity(wheel), [(0.50399, 0, -0.08235), (0, 9.91578, 0)], atol=2e-4
            )
        if step == 20:
            assert abs(p.getBasePositionAndOrientation(wheel)[0][0] - 0.04094) < 3e-4
    assert abs(p.getBasePositionAndOrientation(wheel)[0][0] - 0.11662) < 1.7e-3
    gaps = np.diff(np.sort(places))
    apart = gaps[gaps > 1e-3]
    assert len(apart) >= 9 and apart.min() > 0.8 * 2 * np.pi * 0.05 / 32


def test_a_state_without_contacts_leaves_the_points_that_are_kept(client: int) -> None:
    """Against PyBullet 3.2.7: a state that was saved before the first step, restored after others."""
    p.setGravity(0, 0, -9.81)
    p.createMultiBody(0, p.createCollisionShape(p.GEOM_PLANE))
    box = p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.05, 0.05, 0.2])
    lean = 0.02
    height = 0.2 * math.cos(lean) + 0.05 * math.sin(lean)
    made = p.createMultiBody(1, box, -1, [0, 0, height], p.getQuaternionFromEuler([0, lean, 0]))
    state, found = p.saveState(), list[float]()
    for steps in (12, 12, 1):
        p.restoreState(state)
        for _ in range(steps):
            p.stepSimulation()
        found += [len(p.getContactPoints()), *p.getBasePositionAndOrientation(made)[0]]
        found += p.getBaseVelocity(made)[1]
    assert found == pytest.approx(
        [
            *(2, -0.002178152381149194, -2.2861614033351993e-05, 0.2004374134930387),
            *(-0.0014523147363471323, -0.40304740499957836, 0.0023718693946568753),
            *(2, -0.0021791796765361026, -1.3514336183362088e-05, 0.20044033321676567),
            *(-0.0003400725931781891, -0.4029956756937702, 0.0024048562496691035),
            *(2, -2.634532136284095e-05, -3.5440363287150054e-06, 0.20094445995987636),
            *(0.0033645739804315862, -0.030946063005592862, 0.0024615581899740525),
        ],
        rel=1e-6,
        abs=1e-9,
    )


def test_faces_of_a_robot_that_touch_exactly_do_not_brake(client: int, tmp_path: Path) -> None:
    """A hinge turns one of two boxes along the other; numbers of PyBullet 3.2.7."""
    inertial = '<inertial><mass value="{}"/>'
    inertial += '<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'
    boxes = [
        f'<collision><origin xyz="{place} 0 0"/><geometry><box size="{size}"/></geometry></collision>'
        for place, size in (("0.145", "0.058 0.11 0.07"), ("0", "0.044 0.038 0.07"))
    ]
    links = ((1, "", "b"), (1, boxes[0], "f"), (0.1, boxes[1], "s"))
    text = "".join(f'<link name="{name}">{inertial.format(m)}{box}</link>' for m, box, name in links)
    text += '<joint name="j0" type="fixed"><parent link="b"/><child link="f"/></joint>'
    text += '<joint name="j1" type="revolute"><parent link="b"/><child link="s"/><axis xyz="1 0 0"/>'
    text += '<origin xyz="0.094 0.036 0"/><limit lower="-1" upper="1" effort="9" velocity="9"/></joint>'
    file = tmp_path / "robot.urdf"
    file.write_text(f'<robot name="r">{text}</robot>')
    robot = p.loadURDF(str(file), [0, 0, 1], flags=p.URDF_USE_SELF_COLLISION)
    p.setJointMotorControl2(robot, 1, p.VELOCITY_CONTROL, force=0)
    p.resetBaseVelocity(robot, [0.1, 0, 0], [0.2, 0.3, 0.1])
    p.resetJointState(robot, 1, 0, 0.05)
    for _ in range(57):
        p.stepSimulation()
        points = p.getContactPoints(robot, robot)
        assert len(points) == 4
        assert max(abs(point[8]) for point in points) < 1e-6
    assert p.getJointState(robot, 1)[:2] == pytest.approx((0.01269, 0.0567), abs=1e-5)
