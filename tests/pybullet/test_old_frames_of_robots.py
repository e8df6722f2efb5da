"""Robots that are placed leave the links of other robots where they were, as recorded from PyBullet 3.2.7."""

from typing import Any

import numpy as np
import pytest

from roboyard import pybullet as p
from roboyard.native.objects import arrays_have_the_known_layout
from roboyard.pybullet.face import direct_calls
from roboyard.pybullet.fast import fast_commands

RECORDED = [
    (0.1274948768, -0.06477226958, 1.400238935, 0.0352600561, -0.08000979313, 1.236335546, 0.1274948768,
     0.9352277304, 1.400238935, 0.0352600561, 0.9199902069, 1.236335546),
    (0.1840671426, -0.06500536, 1.369050196, 0.06615306824, -0.08020312717, 1.215948089, 0.1274948768,
     0.9352277304, 1.400238935, 0.0352600561, 0.9199902069, 1.236335546),
    (0.1840671426, -0.06500536, 1.369050196, 0.06615306824, -0.08020312717, 1.215948089, 0.1277316656,
     0.93499464, 1.399922228, 0.03548716752, 0.9197968728, 1.236380608),
    (0.1840671426, -0.06500536, 1.369050196, 0.06615306824, -0.08020312717, 1.215948089, 0.1277316656,
     0.93499464, 1.399922228, 0.03548716752, 0.9197968728, 1.236380608),
    (0.1840671426, -0.06500536, 1.369050196, 0.06615306824, -0.08020312717, 1.215948089, 0.1277316656,
     0.93499464, 1.399922228, 0.03548716752, 0.9197968728, 1.236380608),
    (0.1840671426, -0.06500536, 1.369050196, 0.06615306824, -0.08020312717, 1.215948089, 0.0985318195,
     1.104623143, 1.499524739, -0.06433557333, 1.048382902, 1.336437547),
    (0.1840671426, -0.06500536, 1.369050196, 0.01833260182, -0.06846573795, -0.08350666078, 0.0985318195,
     1.104623143, 1.499524739, 0.08668115099, 0.04842566756, -0.09555114965),
    (0.3861564204, 1.214267374, 0.6353628453, 0.1460551299),
    (0.184143168, -0.06529017516, 1.368701725, 0.06637846554, -0.0804390273, 1.216010658, 0.0475910827,
     1.057626495, 1.538645981, -0.04602361575, 1.003031734, 1.339634639),
    (0.1855631161, -0.06711822543, 1.365755701, 0.06840333974, -0.08194407288, 1.216016545,
     0.04786432388, 1.057798571, 1.538529032, -0.04617591496, 1.003209494, 1.339613439),
    (0.1260162746, -0.0676967605, 1.398056518, 0.03578859473, -0.08241701678, 1.23832086, 0.04786432388,
     1.057798571, 1.538529032, -0.04617591496, 1.003209494, 1.339613439),
    (0.1260162746, -0.0676967605, 1.398056518, 0.03578859473, -0.08241701678, 1.23832086, 0.04804665245,
     1.05791328, 1.538450596, -0.04627746769, 1.003328223, 1.339599531),
    (0.1260162746, -0.0676967605, 1.398056518, 0.03578859473, -0.08241701678, 1.23832086, 0.04804665245,
     1.05791328, 1.538450596, -0.04627746769, 1.003328223, 1.339599531),
    (0.1260162746, -0.0676967605, 1.398056518, 0.03578859473, -0.08241701678, 1.23832086, 0.04804665245,
     1.05791328, 1.538450596, -0.04627746769, 1.003328223, 1.339599531),
    (0.1260162746, -0.0676967605, 1.398056518, 0.03578859473, -0.08241701678, 1.23832086, 0.04827475922,
     1.058056666, 2.538352016, -0.04640443264, 1.003476893, 2.339582398),
    (0.1260162746, -0.0676967605, 1.398056518, -0.005955968991, -0.1525080567, -0.1497772996,
     0.04827475922, 1.058056666, 2.538352016, 0.05472796243, 0.03439731513, -0.02371285733),
    (0.3308405354, 2.407619383, 0.3031362189, -0.5809376489),
    (0.1259903634, -0.06832967979, 1.397429857, 0.0360784569, -0.08293249439, 1.238682907, 0.1078964657,
     1.025802816, 2.471233311, -0.0923792912, 0.9924034598, 2.393952875),
]  # fmt: skip
"""What `shown` returns for both arms, joint velocities after pushes, and link states with velocities."""


def arm(y: float) -> int:
    box = p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.03, 0.02, 0.1])
    return p.createMultiBody(
        0, -1, basePosition=[0, y, 1], linkMasses=[1, 0.5], linkCollisionShapeIndices=[box] * 2,
        linkVisualShapeIndices=[-1] * 2, linkPositions=[[0, 0, 0.1], [0, 0, 0.25]],
        linkOrientations=[[0, 0, 0, 1]] * 2, linkInertialFramePositions=[[0, 0, 0.1]] * 2,
        linkInertialFrameOrientations=[[0, 0, 0, 1]] * 2, linkParentIndices=[0, 1],
        linkJointTypes=[p.JOINT_REVOLUTE] * 2, linkJointAxis=[[0, 1, 0], [1, 0, 0]],
    )  # fmt: skip


def shown(one: int, two: int) -> list[Any]:
    """Return place and box of the last link of both arms (m)."""
    return [value for body in (one, two) for value in (*p.getLinkState(body, 1)[0], *p.getAABB(body, 1)[0])]


@pytest.mark.parametrize("is_fast", [False, True])
def test_only_the_links_of_a_placed_robot_are_shown_where_they_are_now(
    client: int, is_fast: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Forces act in the frames that are shown; queries leave these as they are."""
    if is_fast:
        if not (direct_calls.CAN_START and arrays_have_the_known_layout()):
            pytest.skip("machine code is not used here")
        monkeypatch.setattr(fast_commands, "FEW", 0)
        direct_calls.START.enter(waits=False)
    p.setGravity(0, 0, -10)
    one, two = arm(0), arm(1)
    for body in (one, two):
        for joint in range(2):
            p.resetJointState(body, joint, 0.4 + 0.3 * joint)
            p.setJointMotorControl2(body, joint, p.VELOCITY_CONTROL, force=0)
    found = []
    for turn in range(2):
        for _ in range(4):
            p.stepSimulation()
        found.append(shown(one, two))
        p.resetJointState(one, 0, 0.6 - 0.2 * turn, 0.1)
        found.append(shown(one, two))
        p.getLinkState(two, 0, 0, 1)
        found.append(shown(one, two))
        p.stepSimulation()
        found.append(shown(one, two))
        p.getContactPoints()
        p.rayTest([0, 0, 3], [0, 0, 0])
        p.performCollisionDetection()
        found.append(shown(one, two))
        p.resetBasePositionAndOrientation(two, [0, 1, 1.1 + turn], [0, 0, 0.6, 0.8])
        found.append(shown(one, two))
        states = [(p.getLinkStates(body, [0, 1], 1)[1], p.getLinkState(body, 1, 1)) for body in (one, two)]
        found.append([value for many, single in states for value in (*many[0], *single[6])])
        for body in (one, two):
            p.applyExternalForce(body, 1, [3, 2, 1], [0, 0.1, 0.2], p.LINK_FRAME)
            p.applyExternalTorque(body, 1, [0.1, 0.2, 0.3], p.LINK_FRAME)
            p.applyExternalForce(body, 1, [1, 2, 3], [0, 0.1, 1.2], p.WORLD_FRAME)
        p.stepSimulation()
        found.append([p.getJointState(body, joint)[1] for body in (one, two) for joint in range(2)])
        p.resetJointStatesMultiDof(two, [0, 1], [[0.2], [0.3 + turn]])
        found.append(shown(one, two))
    for row, expected in zip(found, RECORDED, strict=True):
        np.testing.assert_allclose(row, expected, rtol=0, atol=1e-8)
