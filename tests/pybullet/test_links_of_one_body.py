"""Rows between two links of one body: contacts, constraints and the motors of spherical joints.

Bullet divides such a row by what an impulse changes in the velocity of each link alone. The numbers are those
of PyBullet 3.2.7.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import roboyard.pybullet as p

R, S = p.JOINT_REVOLUTE, p.JOINT_SPHERICAL


def add_body(
    base: float,
    shape: int,
    steps: Any,
    axes: Any,
    types: Any,
    parents: Any,
    base_shape: int = -2,
    **more: Any,
) -> int:
    """Add a body of links at `steps` (m) from their parents, all of one shape unless `shapes` has others."""
    count = len(steps)
    centre = more.pop("centre", (0, 0, 0))
    return p.createMultiBody(
        base,
        shape if base_shape == -2 else base_shape,
        -1,
        [0, 0, 1],
        linkMasses=more.pop("masses"),
        linkCollisionShapeIndices=more.pop("shapes", [shape] * count),
        linkVisualShapeIndices=[-1] * count,
        linkPositions=steps,
        linkOrientations=[[0, 0, 0, 1]] * count,
        linkInertialFramePositions=[centre] * count,
        linkInertialFrameOrientations=[[0, 0, 0, 1]] * count,
        linkParentIndices=parents,
        linkJointTypes=types,
        linkJointAxis=axes,
        **more,
    )


def siblings(base: float, steps: Any, flags: int = 0) -> int:
    """Two spheres on a base, of two bent joints."""
    return add_body(
        base,
        p.createCollisionShape(p.GEOM_SPHERE, radius=0.15),
        steps,
        [[0, 0.6, 0.8], [0.6, 0, 0.8]],
        [R, R],
        [0, 0],
        p.createCollisionShape(p.GEOM_SPHERE, radius=0.1),
        masses=[1, 1.3],
        centre=(0.02, 0, 0.01),
        flags=flags,
    )


def turn_against(body: int) -> None:
    for joint in (0, 1):
        p.setJointMotorControl2(body, joint, p.VELOCITY_CONTROL, targetVelocity=2 - 4 * joint, force=20)


def speeds(body: int, joints: Any) -> list[list[float]]:
    return [list(p.getJointStateMultiDof(body, joint)[1]) for joint in joints]


def base_speed(body: int) -> np.ndarray:
    return np.concatenate(p.getBaseVelocity(body))


def test_links_of_a_floating_body_that_touch(client: int) -> None:
    p.setGravity(0, 0, -10)
    body = siblings(2, [[0.18, 0.3, 0], [0.05, 0.3, 0.19]], p.URDF_USE_SELF_COLLISION)
    turn_against(body)
    for _ in range(4):
        p.stepSimulation()
    [point] = p.getContactPoints()
    assert point[3:5] == (0, 1)
    assert point[8] == pytest.approx(-0.069782711, abs=1e-8)
    assert point[9] == pytest.approx(22325.46766, rel=1e-7)
    assert np.array(speeds(body, (0, 1))) == pytest.approx(
        np.array([[1.986040086], [-1.007161519]]), abs=1e-7
    )
    assert base_speed(body) == pytest.approx(
        np.array([0.141290149, 0.016829401, -0.363613166, 0.209124996, -2.533880001, -0.116588791]), abs=1e-7
    )


@pytest.mark.parametrize(
    ("kind", "base", "expected"),
    [
        (p.JOINT_POINT2POINT, 2, [3.8003e-05, -8.6423e-05]),
        (p.JOINT_POINT2POINT, 0, [-2.922e-06, -2.703e-06]),
        (p.JOINT_FIXED, 2, [2.55e-06, 2.524e-06]),
        (p.JOINT_FIXED, 0, [0.0, 0.0]),
    ],
)
def test_links_that_a_constraint_holds_together(
    client: int, kind: int, base: float, expected: list[float]
) -> None:
    p.setGravity(0, 0, -10)
    body = siblings(base, [[0.5, 0.3, 0], [-0.4, 0.3, 0.1]])
    p.createConstraint(body, 0, body, 1, kind, [0, 0, 0], [-0.4, 0.1, 0], [0.5, 0.1, -0.1])
    turn_against(body)
    for _ in range(3):
        p.stepSimulation()
    assert np.ravel(speeds(body, (0, 1))) == pytest.approx(np.array(expected), abs=2e-9)


@pytest.mark.parametrize(
    ("base", "types", "expected", "of_base"),
    [
        (
            2,
            [S, R, S],
            [[-3.3489e-05, -0.000215724, -0.000572365], [0.999995942], [0.0, 4.26e-07, 5.435e-06]],
            [0.076597074, 0.000244116, -0.087673735, -0.020108858, -0.304783744, -0.033809583],
        ),
        (0, [S, R], [[-1.415e-06, -8.9686e-05, -0.00060143], [1.0]], [0.0] * 6),
    ],
)
def test_motors_of_spherical_joints(
    client: int, base: float, types: list[int], expected: list[list[float]], of_base: list[float]
) -> None:
    p.setGravity(0, 0, -10)
    count = len(types)
    body = add_body(
        base,
        p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.1, 0.15, 0.2]),
        [[0.3, 0.1, 0.5]] * count,
        [[0, 1, 0]] * count,
        types,
        list(range(count)),
        masses=[1 + 0.3 * k for k in range(count)],
    )
    p.setJointMotorControl2(body, 1, p.VELOCITY_CONTROL, targetVelocity=1, force=50)
    p.stepSimulation()
    found = speeds(body, range(count))
    assert np.concatenate(found) == pytest.approx(np.concatenate(expected), abs=2e-9)
    assert base_speed(body) == pytest.approx(np.array(of_base), abs=2e-9)


@pytest.mark.parametrize(
    ("rounds", "expected"),
    [(1, [2.454545455, 3.0]), (2, [2.761423761, 2.693121693]), (50, [2.733525734, 3.0])],
)
def test_rounds_end_after_a_row_that_nothing_moves(client: int, rounds: int, expected: list[float]) -> None:
    """A link touches the fixed base along the axes of its joints: motors have not converged by the end."""
    p.setGravity(0, 0, -10)
    p.setPhysicsEngineParameter(numSolverIterations=rounds)
    shape = p.createCollisionShape(p.GEOM_SPHERE, radius=0.15)
    body = add_body(
        0,
        shape,
        [[0, 0.15, 0.3], [0, 0.11, -0.3]],
        [[0, 1, 0]] * 2,
        [R, R],
        [0, 1],
        masses=[1, 0.7],
        shapes=[-1, shape],
        flags=p.URDF_USE_SELF_COLLISION,
    )
    for joint in (0, 1):
        p.setJointMotorControl2(body, joint, p.VELOCITY_CONTROL, targetVelocity=3, force=50)
    p.stepSimulation()
    assert [point[3:5] for point in p.getContactPoints()] == [(-1, 1)]
    assert np.ravel(speeds(body, (0, 1))) == pytest.approx(np.array(expected), abs=5e-9)


def test_a_body_that_tumbles_moves_by_its_centre_of_mass(client: int) -> None:
    """Without forces the centre moves on a straight line, while the frame turns about it."""
    p.setGravity(0, 0, 0)
    shape = p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.1, 0.15, 0.2])
    body = p.createMultiBody(2, shape, -1, [0, 0, 1], baseInertialFramePosition=[0.1, 0.05, 0])
    p.changeDynamics(body, -1, linearDamping=0, angularDamping=0)
    p.resetBaseVelocity(body, [0.5, 0, 0], [1, 2, 10])
    for _ in range(240):
        p.stepSimulation()
    assert p.getBasePositionAndOrientation(body)[0] == pytest.approx((0.6, 0.05, 1.0), abs=1e-9)
    assert base_speed(body) == pytest.approx(
        np.array([0.5, 0.0, 0.0, 0.989233097, 1.770338965, 10.084155169]), abs=1e-8
    )


def test_a_body_with_its_centre_elsewhere_lands_as_it_turns(client: int) -> None:
    p.setGravity(0, 0, -10)
    p.createMultiBody(0, p.createCollisionShape(p.GEOM_BOX, halfExtents=[5, 5, 0.5]), -1, [0, 0, -0.5])
    shape = p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.1, 0.15, 0.2])
    body = p.createMultiBody(2, shape, -1, [0, 0, 0.6], baseInertialFramePosition=[0.1, 0.05, 0])
    p.resetBaseVelocity(body, [0, 0, -1], [8, -3, 10])
    for _ in range(60):
        p.stepSimulation()
    expected = (0.104087052, 0.069557245, 0.197960854)
    assert p.getBasePositionAndOrientation(body)[0] == pytest.approx(expected, abs=1e-7)


def test_an_obj_file_within_a_compound_is_listed_first(client: int, tmp_path: Path) -> None:
    """Both links are compounds, of shapes beside their inertial frames; the OBJ file is one of its own."""
    corners = [(x, y, z) for x in (-0.1, 0.1) for y in (-0.1, 0.1) for z in (-0.1, 0.1)]
    lines = [f"v {x} {y} {z}" for x, y, z in corners]
    lines += [f"f {face}" for face in ("1 2 4 3", "5 7 8 6", "1 5 6 2", "3 4 8 7", "1 3 7 5", "2 6 8 4")]
    (tmp_path / "cube.obj").write_text("\n".join(lines) + "\n", encoding="utf-8")
    link = (
        '<robot name="r"><link name="l"><inertial><origin xyz="{centre}"/><mass value="{mass}"/>'
        '<inertia ixx="{i}" iyy="{i}" izz="{i}" ixy="0" ixz="0" iyz="0"/></inertial>'
        '<collision><origin xyz="{at}"/><geometry>{shape}</geometry></collision></link></robot>'
    )
    ground = link.format(centre="0 0 0", mass=0, i=0, at="0 0 -1", shape='<box size="4 4 2"/>')
    cube = link.format(centre="0.01 0 0", mass=1, i=0.01, at="0 0 0", shape='<mesh filename="cube.obj"/>')
    (tmp_path / "ground.urdf").write_text(ground, encoding="utf-8")
    (tmp_path / "cube.urdf").write_text(cube, encoding="utf-8")
    p.setGravity(0, 0, -10)
    p.loadURDF(str(tmp_path / "ground.urdf"))
    body = p.loadURDF(str(tmp_path / "cube.urdf"), [0, 0, 0.1])
    for _ in range(20):
        p.stepSimulation()
    assert {point[1:3] for point in p.getContactPoints()} == {(body, 0)}


@pytest.mark.parametrize(
    ("flags", "expected"),
    [
        (0, []),
        (p.URDF_USE_SELF_COLLISION, [(-1, 1)]),
        (p.URDF_USE_SELF_COLLISION | p.URDF_USE_SELF_COLLISION_EXCLUDE_PARENT, [(-1, 1)]),
        (p.URDF_USE_SELF_COLLISION | p.URDF_USE_SELF_COLLISION_EXCLUDE_ALL_PARENTS, []),
        (p.URDF_USE_SELF_COLLISION | p.URDF_USE_SELF_COLLISION_INCLUDE_PARENT, [(-1, 0), (-1, 1), (0, 1)]),
        (p.URDF_USE_SELF_COLLISION_INCLUDE_PARENT, []),
    ],
)
def test_flags_say_which_links_of_a_body_collide(
    client: int, flags: int, expected: list[tuple[int, int]]
) -> None:
    """Recorded from PyBullet: three boxes that overlap, one above the other; without the first flag none."""
    shape = p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.1, 0.1, 0.1])
    p.createMultiBody(
        0, shape, -1, [0, 0, 1], flags=flags,
        linkMasses=[0.5, 0.2], linkCollisionShapeIndices=[shape] * 2, linkVisualShapeIndices=[-1] * 2,
        linkPositions=[[0, 0, 0.08]] * 2, linkOrientations=[[0, 0, 0, 1]] * 2,
        linkInertialFramePositions=[[0, 0, 0]] * 2, linkInertialFrameOrientations=[[0, 0, 0, 1]] * 2,
        linkParentIndices=[0, 1], linkJointTypes=[p.JOINT_REVOLUTE] * 2, linkJointAxis=[[0, 0, 1]] * 2,
    )  # fmt: skip
    p.stepSimulation()
    assert sorted({point[3:5] for point in p.getContactPoints()}) == expected
