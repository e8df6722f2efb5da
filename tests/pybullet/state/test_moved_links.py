"""Links that are read one by one after joints were set are where MuJoCo's kinematics has them."""

import random
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import roboyard.pybullet as p
from roboyard.pybullet.connections import CLIENTS

LINK = """<link name="{name}"><inertial><mass value="1"/><origin xyz="0.1 0.2 0.3" rpy="0.3 0.2 0.1"/>
<inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial></link>"""
JOINT = """<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>
<origin xyz="{x} 0.2 -0.1" rpy="0.4 -0.3 {x}"/><axis xyz="0.6 0 -0.8"/>
<limit lower="-9" upper="9" effort="9" velocity="9"/></joint>"""
KINDS = "revolute", "prismatic", "continuous", "fixed", "spherical"


@pytest.fixture
def robots(tmp_path: Path) -> Any:
    links = [LINK.format(name=f"l{k}") for k in range(11)]
    joints = [
        JOINT.format(name=f"j{k}", kind=KINDS[k % 5], parent=f"l{k - k % 3}", child=f"l{k + 1}", x=0.1 * k)
        for k in range(10)
    ]
    file = tmp_path / "robot.urdf"
    file.write_text(f'<robot name="r">{"".join(links + joints)}</robot>')
    p.connect(p.DIRECT)
    yield [p.loadURDF(str(file), [k, 0, 1], [0.1, 0.5, 0.3, 0.8], useFixedBase=k) for k in (0, 1)]
    p.disconnect()


@pytest.mark.parametrize("steps", [0, 2])
def test_links_are_where_all_kinematics_has_them(robots: list[int], steps: int) -> None:
    source = random.Random(1)
    scene: Any = CLIENTS[0].scene  # type: ignore[union-attr]
    for _ in range(20):
        for _ in range(steps):
            p.stepSimulation()
        for body in robots:
            turn = [source.gauss(0, 1) for _ in range(4)]
            p.resetBasePositionAndOrientation(body, [source.random() for _ in range(3)], turn)
            for joint in range(10):
                if KINDS[joint % 5] == "spherical":
                    p.resetJointStateMultiDof(body, joint, [source.gauss(0, 1) for _ in range(4)])
                elif KINDS[joint % 5] != "fixed":
                    p.resetJointState(body, joint, source.uniform(-4, 4))
        links = [(body, source.randrange(10)) for body in 4 * robots]
        alone = [p.getLinkState(*link) for link in links]
        assert scene.single_reads == len(links)
        assert scene.world.is_moved
        moving = [p.getLinkState(*link, computeLinkVelocity=1) for link in links]
        assert scene.world.is_moved
        together = [p.getLinkStates(body, [link], computeLinkVelocity=1)[0] for body, link in links]
        assert scene.single_reads == 0
        for one, same, other in zip(alone, moving, together, strict=True):
            for a, b, c in zip(one, same, other, strict=False):
                np.testing.assert_allclose(a, c, rtol=0, atol=1e-13)
                np.testing.assert_allclose(b, c, rtol=0, atol=1e-13)
            np.testing.assert_allclose(same[6], other[6], rtol=0, atol=1e-12)
            np.testing.assert_allclose(same[7], other[7], rtol=0, atol=1e-12)


@pytest.mark.parametrize("is_fresh", [0, 1])
def test_velocities_after_a_step_are_those_of_all_kinematics(robots: list[int], is_fresh: int) -> None:
    source = random.Random(2)
    scene: Any = CLIENTS[0].scene  # type: ignore[union-attr]
    for body in robots:
        for joint in range(10):
            if KINDS[joint % 5] == "spherical":
                p.setJointMotorControlMultiDof(body, joint, p.POSITION_CONTROL, [0, 0, 0, 1], force=[0, 0, 0])
            elif KINDS[joint % 5] != "fixed":
                p.setJointMotorControl2(body, joint, p.VELOCITY_CONTROL, force=0)
    p.setGravity(0, 0, -9.8)
    for _ in range(30):
        p.applyExternalTorque(robots[0], -1, [source.gauss(0, 30) for _ in range(3)], p.LINK_FRAME)
        p.stepSimulation()
        links = [(body, source.randrange(10)) for body in 4 * robots]
        alone = [p.getLinkState(*link, 1, is_fresh) for link in links]
        assert scene.world.is_moved
        together = [p.getLinkStates(body, [link], 1, is_fresh)[0] for body, link in links]
        assert not scene.world.is_moved
        for one, other in zip(alone, together, strict=True):
            for a, b in zip(one, other, strict=True):
                np.testing.assert_allclose(a, b, rtol=1e-12, atol=1e-12)


@pytest.mark.usefixtures("robots")
def test_boxes_of_moved_links_are_those_of_all_kinematics() -> None:
    cube = p.createMultiBody(1, p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.1, 0.2, 0.3]))
    scene: Any = CLIENTS[0].scene  # type: ignore[union-attr]
    for k in range(5):
        p.resetBasePositionAndOrientation(cube, [k, 0, 1], [0.1, 0.2 * k, 0.3, 0.9])
        alone = p.getAABB(cube)
        assert scene.world.is_moved
        together = [p.getAABB(cube) for _ in range(20)][-1]
        assert not scene.world.is_moved
        np.testing.assert_allclose(alone, together, rtol=0, atol=1e-14)


def test_frames_of_all_are_computed_where_many_are_read(robots: list[int]) -> None:
    scene: Any = CLIENTS[0].scene  # type: ignore[union-attr]
    p.resetJointState(robots[0], 0, 0.5)
    found = [p.getLinkState(robots[0], 9) for _ in range(40)]
    assert not scene.world.is_moved
    for state in found:
        np.testing.assert_allclose(state[0], found[0][0], rtol=0, atol=1e-14)
    with pytest.raises(p.error):
        p.getLinkState(robots[0], -1)
    p.resetJointState(robots[0], 0, 0.2)
    assert p.getLinkState(robots[0], 10) is None
