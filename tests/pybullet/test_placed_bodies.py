"""Poses that are asked for while bodies are still being added: the same numbers, and nothing is compiled."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

import roboyard.pybullet as p

ARM = """<robot name="arm"><link name="base"><inertial><origin xyz="0.1 0.2 0.3" rpy="0.3 0 0.5"/>
<mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>
<collision><geometry><box size="0.1 0.2 0.3"/></geometry></collision></link>
<link name="tip"><inertial><mass value="1"/>
<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="hinge" type="continuous"><parent link="base"/><child link="tip"/></joint></robot>"""


def _add(kind: str, file: Path, place: int) -> int:
    turn = p.getQuaternionFromEuler([0.1 * place, 2.0 - 0.3 * place, 0.4 * place])
    at = [place, 0.1 * place, 0.5]
    if kind == "box":
        return p.createMultiBody(1, p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.1] * 3), -1, at, turn)
    if kind == "rigid":
        shape = p.createCollisionShape(p.GEOM_SPHERE, radius=0.1)
        return p.createMultiBody(1, shape, -1, at, turn, useMaximalCoordinates=1)
    return p.loadURDF(str(file), at, turn, useFixedBase=kind == "fixed")


@pytest.mark.parametrize("kind", ["arm", "fixed", "box", "rigid"])
def test_the_pose_is_that_of_the_compiled_world(client: int, tmp_path: Path, kind: str) -> None:
    (tmp_path / "arm.urdf").write_text(ARM)
    early: list[Any] = []
    for place in range(6):
        body = _add(kind, tmp_path / "arm.urdf", place)
        early.append(p.getBasePositionAndOrientation(body))
        if place == 2:
            p.stepSimulation()  # compiles; those that are added later are not there yet
            early = [p.getBasePositionAndOrientation(i) for i in range(3)]
        if place == 4:
            p.resetBasePositionAndOrientation(body, [9, 8, 7], [0.6, 0, 0.8, 0])
            assert p.getBasePositionAndOrientation(body)[0] == pytest.approx((9, 8, 7))
            early[-1] = p.getBasePositionAndOrientation(body)
    p.getLinkState(0, 0) if kind in ("arm", "fixed") else p.getAABB(0)
    p.performCollisionDetection()
    late = [p.getBasePositionAndOrientation(body) for body in range(6)]
    for (at, turn), (place, rotation) in zip(early, late, strict=True):
        assert at == pytest.approx(place, abs=1e-12)
        assert turn == pytest.approx(rotation, abs=1e-12)


def test_asking_for_poses_compiles_nothing(client: int, tmp_path: Path) -> None:
    from roboyard.pybullet.connections import CLIENTS

    (tmp_path / "arm.urdf").write_text(ARM)
    opened: Any = CLIENTS[client]
    world = opened.scene.world
    for place in range(3):
        p.getBasePositionAndOrientation(_add("arm", tmp_path / "arm.urdf", place))
        assert world.is_stale
