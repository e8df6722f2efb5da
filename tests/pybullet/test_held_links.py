"""Links without mass are held, also against what they overlap: numbers of PyBullet 3.2.7."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

import roboyard.pybullet as p
from roboyard.pybullet.connections import CLIENTS


def _arm() -> int:
    box = p.createCollisionShape(
        p.GEOM_BOX, halfExtents=[0.2, 0.05, 0.05], collisionFramePosition=[0.2, 0, 0]
    )
    return p.createMultiBody(
        0,
        box,
        -1,
        [0, 0, 1],
        linkMasses=[1, 1],
        linkCollisionShapeIndices=[box, box],
        linkVisualShapeIndices=[-1, -1],
        linkPositions=[[0.45, 0, 0]] * 2,
        linkOrientations=[[0, 0, 0, 1]] * 2,
        linkInertialFramePositions=[[0.2, 0, 0]] * 2,
        linkInertialFrameOrientations=[[0, 0, 0, 1]] * 2,
        linkParentIndices=[0, 1],
        linkJointTypes=[p.JOINT_REVOLUTE] * 2,
        linkJointAxis=[[0, 1, 0]] * 2,
    )


@pytest.mark.parametrize(
    ("held", "states"),
    [
        ([0, 1], [(0, 0), (0.1, 0)]),
        ([], [(-0.0442, -0.0054), (0.0447, -0.0062)]),
    ],
)
def test_links_that_overlap_what_is_static(
    client: int, held: list[int], states: list[tuple[float, float]]
) -> None:
    p.setGravity(0, 0, -9.8)
    arm = _arm()
    for joint in held:
        p.changeDynamics(arm, joint, mass=0)
    for joint in range(2):
        p.setJointMotorControl2(arm, joint, p.VELOCITY_CONTROL, force=0)
        p.resetJointState(arm, joint, 0.1 * joint)
    block = p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.1, 0.1, 0.1])
    p.createMultiBody(0, block, -1, [1.0, 0, 0.87])
    for _ in range(60):
        p.stepSimulation()
    assert len(p.getContactPoints(arm)) == 4
    for joint, state in enumerate(states):
        assert p.getJointState(arm, joint)[:2] == pytest.approx(state, abs=2e-4)


def test_copies_of_a_robot_without_shapes_come_and_go_without_compiles(client: int) -> None:
    """As planners create them for inverse kinematics: links without inertia, whose joints are held."""
    target = [0.4, 0.1, 1.2]

    def copied() -> int:
        return p.createMultiBody(
            0,
            -1,
            -1,
            [0, 0, 1],
            linkMasses=[1] * 3,
            linkCollisionShapeIndices=[-1] * 3,
            linkVisualShapeIndices=[-1] * 3,
            linkPositions=[[0, 0, 0.1], [0.3, 0, 0], [0.3, 0, 0]],
            linkOrientations=[[0, 0, 0, 1]] * 3,
            linkInertialFramePositions=[[0, 0, 0]] * 3,
            linkInertialFrameOrientations=[[0, 0, 0, 1]] * 3,
            linkParentIndices=[0, 1, 2],
            linkJointTypes=[p.JOINT_REVOLUTE] * 3,
            linkJointAxis=[[0, 1, 0], [0, 1, 0], [0, 0, 1]],
        )

    scene: Any = CLIENTS[client].scene
    _arm()
    answers, compiles = [], []
    for number in range(5):
        robot = copied()
        for joint in range(3):
            p.resetJointState(robot, joint, 0.1 * joint)
        answers.append(p.calculateInverseKinematics(robot, 2, target))
        p.stepSimulation()
        held = [p.getJointState(robot, joint)[:2] for joint in range(3)]
        compiles.append(id(scene.world.live_model))
        if number == 2:
            p.changeDynamics(robot, 2, localInertiaDiagonal=[0.1, 0.1, 0.1])
            p.setJointMotorControl2(robot, 2, p.VELOCITY_CONTROL, targetVelocity=1, force=5)
            for _ in range(10):
                p.stepSimulation()
            assert p.getJointState(robot, 2)[1] == pytest.approx(1, abs=0.05), "its motor moves it now"
        p.removeBody(robot)
        assert held[2] == pytest.approx((0.2, 0.0)), "nothing moves it"
    for answer in answers[1:]:
        assert answer == pytest.approx(answers[0], abs=1e-12)
    assert compiles[1] == compiles[2]


@pytest.mark.parametrize(("flags", "inertia"), [(p.URDF_USE_INERTIA_FROM_FILE, 0.5), (0, 6.667e-7)])
def test_a_link_without_mass_has_the_inertia_of_its_file(
    client: int, tmp_path: Path, flags: int, inertia: float
) -> None:
    """As the flange of a robot may, which is fixed to its last link; also in PyBullet 3.2.7."""

    def link(name: str, mass: float, moment: float) -> str:
        moments = " ".join(f'{key}="{moment}"' for key in ("ixx", "iyy", "izz"))
        inertial = f'<mass value="{mass}"/><inertia {moments} ixy="0" ixz="0" iyz="0"/>'
        return f'<link name="{name}"><inertial>{inertial}</inertial></link>'

    links = link("a", 0, 0) + link("b", 1, 0.2) + link("c", 0, 0.3)
    joints = (
        '<joint name="j" type="continuous"><parent link="a"/><child link="b"/><axis xyz="0 1 0"/></joint>'
    )
    joints += '<joint name="k" type="fixed"><parent link="b"/><child link="c"/><origin xyz="0 0 1"/></joint>'
    file = tmp_path / "robot.urdf"
    file.write_text(f'<robot name="r">{links}{joints}</robot>')
    robot = p.loadURDF(str(file), useFixedBase=True, flags=flags)
    assert p.calculateMassMatrix(robot, [0.0]) == ((pytest.approx(inertia, abs=1e-9),),)
    if flags:
        p.setJointMotorControl2(robot, 0, p.VELOCITY_CONTROL, force=0)
        p.setJointMotorControl2(robot, 0, p.TORQUE_CONTROL, force=1.0)
        p.stepSimulation()
        assert p.getJointState(robot, 0)[1] == pytest.approx(1.0 / inertia / 240, rel=2e-3)
