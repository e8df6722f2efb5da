"""Rows of contacts that are made as they are solved, compared with those that MuJoCo makes."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

import roboyard.pybullet as p
from roboyard.sim.stepping import contact_rows

ARM = """<robot name="a"><link name="base"/>
<link name="upper"><inertial><mass value="2"/><origin xyz="0 0 0.2"/>
<inertia ixx="0.02" iyy="0.02" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial>
<collision><origin xyz="0 0 0.2"/><geometry><box size="0.1 0.1 0.4"/></geometry></collision></link>
<link name="lower"><inertial><mass value="1"/><origin xyz="0.1 0 0.1"/>
<inertia ixx="0.02" iyy="0.03" izz="0.01" ixy="0.001" ixz="0" iyz="0"/></inertial>
<collision><origin xyz="0 0 0.15"/><geometry><cylinder radius="0.05" length="0.3"/></geometry></collision>
</link>
<link name="hand"><inertial><mass value="0.2"/>
<inertia ixx="0.001" iyy="0.001" izz="0.001" ixy="0" ixz="0" iyz="0"/></inertial>
<collision><geometry><sphere radius="0.07"/></geometry></collision></link>
<joint name="turn" type="revolute"><parent link="base"/><child link="upper"/><origin xyz="0 0 0.1"/>
<axis xyz="0 1 0"/><limit lower="-3" upper="3" effort="100" velocity="10"/></joint>
<joint name="bend" type="revolute"><parent link="upper"/><child link="lower"/><origin xyz="0 0 0.4"/>
<axis xyz="0 1 0"/><limit lower="-3" upper="3" effort="100" velocity="10"/></joint>
<joint name="fixed" type="fixed"><parent link="lower"/><child link="hand"/><origin xyz="0 0 0.35"/></joint>
</robot>"""
"""Two links and a hand that swing down onto what is beside them."""
TWO = """<mujoco><worldbody>
<body name="one" pos="0 0 1"><joint name="a" type="slide" axis="0 0 1"/><geom size="0.1" mass="1"/></body>
<body name="two" pos="1 0 1"><joint name="b" type="slide" axis="0 0 1"/><geom size="0.1" mass="3"/></body>
</worldbody><equality><joint joint1="a" joint2="b" polycoef="0 -1 0 0 0"/></equality></mujoco>"""
STEPS = 12


ALL, CONTACTS, NONE = "all", "contacts", "none"


def make_here(monkeypatch: pytest.MonkeyPatch, which: str) -> None:
    """Let these rows be made here instead of by MuJoCo."""
    monkeypatch.setattr(contact_rows, "FEWEST", 10**9 if which == NONE else 0)
    if which != ALL:
        monkeypatch.setattr(contact_rows.ContactRows, "makes_joints", lambda *_: False)


@pytest.fixture(params=[ALL, CONTACTS, NONE])
def made_here(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> Iterator[str]:
    """Which rows are made here as they are solved."""
    make_here(monkeypatch, request.param)
    yield request.param


def _mixture(folder: Path, round_shape: int) -> list[int]:
    """Bodies of all kinds and surfaces, most of them in touch; the last one is an arm."""
    p.setPhysicsEngineParameter(solverResidualThreshold=0)  # else rounding decides which round is the last
    p.setGravity(0, 0, -9.81)
    plane = p.createMultiBody(0, p.createCollisionShape(p.GEOM_PLANE))
    p.changeDynamics(plane, -1, rollingFriction=0.01)
    shapes = [
        p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.1, 0.08, 0.06]),
        p.createCollisionShape(round_shape, radius=0.1, height=0.2),
        p.createCollisionShape(p.GEOM_SPHERE, radius=0.1),
    ]
    rng = np.random.default_rng(5)  # of which the last bit decides on no way out between two round shapes
    bodies = []
    for k in range(9):
        place = [0.45 + 0.15 * (k % 3), 0.16 * (k // 3), 0.1 + 0.05 * k]
        turn = p.getQuaternionFromEuler((0.2 * rng.normal(size=3)).tolist())
        velocity = (0.5 * rng.normal(size=3)).tolist()
        body = p.createMultiBody(0.5 + 0.1 * k, shapes[k % 3], basePosition=place, baseOrientation=turn)
        p.resetBaseVelocity(body, velocity, velocity)
        bodies.append(body)
    for body in bodies[::2]:
        p.changeDynamics(body, -1, rollingFriction=0.01, spinningFriction=0.02)
    p.changeDynamics(bodies[3], -1, contactStiffness=1e4, contactDamping=100)
    p.changeDynamics(bodies[4], -1, restitution=0.5)
    p.changeDynamics(bodies[0], -1, frictionAnchor=1)
    file = folder / "arm.urdf"
    file.write_text(ARM, encoding="utf-8")
    arm = p.loadURDF(str(file), useFixedBase=True)
    p.resetJointState(arm, 0, 1.2)
    p.enableJointForceTorqueSensor(arm, 1)
    return [*bodies, arm]


def _results(folder: Path, round_shape: int) -> dict[str, np.ndarray]:
    client = p.connect(p.DIRECT)
    bodies = _mixture(folder, round_shape)
    found: dict[str, list[float]] = {"places": [], "forces": [], "reactions": [], "motors": []}
    for _ in range(STEPS):
        p.stepSimulation()
        for body in bodies:
            position, turn = p.getBasePositionAndOrientation(body)
            found["places"] += [*position, *turn]
        points = sorted(
            (point[1], point[2], *point[5], point[9], point[10], point[12]) for point in p.getContactPoints()
        )
        found["forces"] += [value for point in points for value in point[-3:]]
        for joint in range(2):
            state = p.getJointState(bodies[-1], joint)
            found["reactions"] += state[2]
            found["motors"] += [state[0], state[1], state[3]]
    p.disconnect(client)
    return {name: np.array(values) for name, values in found.items()}


@pytest.mark.parametrize("round_shape", [p.GEOM_CAPSULE, p.GEOM_CYLINDER])
def test_rows_made_here_do_what_mujocos_rows_do(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, round_shape: int
) -> None:
    results = []
    for which in (ALL, CONTACTS, NONE):
        make_here(monkeypatch, which)
        results.append(_results(tmp_path, round_shape))
    theirs = results.pop()
    for ours in results:
        assert np.count_nonzero(ours["forces"]) > 100
        assert np.abs(ours["reactions"]).max() > 10.0
        for name, tolerance in (("places", 1e-9), ("forces", 1e-6), ("reactions", 1e-6), ("motors", 1e-6)):
            np.testing.assert_allclose(ours[name], theirs[name], atol=tolerance, err_msg=name)


def test_the_forces_of_a_heap_at_rest_carry_its_weight(client: int, made_here: str) -> None:
    p.setGravity(0, 0, -9.81)
    plane = p.createMultiBody(0, p.createCollisionShape(p.GEOM_PLANE))
    shape = p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.1] * 3)
    for k in range(8):
        p.createMultiBody(0.5, shape, basePosition=[0.3 * (k // 2), 0, 0.1 + 0.2 * (k % 2)])
    for _ in range(240):
        p.stepSimulation()
    points = p.getContactPoints(bodyA=plane)
    assert len(points) == 16
    assert sum(point[9] for point in points) == pytest.approx(8 * 0.5 * 9.81, rel=1e-4)


def test_contacts_that_are_found_without_a_step_have_no_force(client: int, made_here: str) -> None:
    p.setGravity(0, 0, -9.81)
    p.createMultiBody(0, p.createCollisionShape(p.GEOM_PLANE))
    box = p.createMultiBody(
        1, p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.1] * 3), basePosition=[0, 0, 0.1]
    )
    for _ in range(20):
        p.stepSimulation()
    assert sum(point[9] for point in p.getContactPoints(box)) == pytest.approx(9.81, rel=0.01)
    p.performCollisionDetection()
    found = p.getContactPoints(box)
    assert found
    assert {point[9] for point in found} == {0.0}


def test_worlds_whose_rows_are_not_all_ours_have_mujocos(client: int, made_here: str, tmp_path: Path) -> None:
    """A tendon of a file is MuJoCo's to solve, and so are all contacts beside it."""
    file = tmp_path / "two.xml"
    file.write_text(TWO, encoding="utf-8")
    p.setGravity(0, 0, -10)
    p.createMultiBody(0, p.createCollisionShape(p.GEOM_PLANE))
    shape = p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.1] * 3)
    boxes = [p.createMultiBody(1, shape, basePosition=[3 + 0.3 * k, 0, 0.1]) for k in range(4)]
    p.loadMJCF(str(file))
    for _ in range(60):
        p.stepSimulation()
    assert sum(point[9] for point in p.getContactPoints()) == pytest.approx(40.0, rel=0.02)
    assert p.getBasePositionAndOrientation(boxes[0])[0][2] == pytest.approx(0.1, abs=2e-4)
