"""Joints beyond their limits; positions and speeds are real PyBullet 3.2.7's."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import roboyard.pybullet as p

ROD = """<robot name="rod"><link name="base"/><link name="rod"><inertial><origin xyz="0 0 -0.5"/>
<mass value="1"/><inertia ixx="0.08" ixy="0" ixz="0" iyy="0.08" iyz="0" izz="0.001"/></inertial>
<collision><origin xyz="0 0 -0.5"/><geometry><box size="0.1 0.1 1"/></geometry></collision></link>
<joint name="pivot" type="revolute"><parent link="base"/><child link="rod"/><axis xyz="0 1 0"/>
<limit lower="-0.5" upper="0.5" effort="10" velocity="10"/></joint></robot>"""


@pytest.mark.parametrize(
    ("start", "gravity", "after"),
    [
        (0.53, 0.0, [(0.524, -1.44), (0.5180019, -1.4395437), (0.5120057, -1.4390876)]),
        (0.8, 0.0, [(0.8, 0.0), (0.8, 0.0), (0.8, 0.0)]),
        (-0.8, 0.0, [(-0.8, 0.0), (-0.8, 0.0), (-0.8, 0.0)]),
        (0.8, 9.0, [(0.7998371, -0.039092), (0.7995114, -0.0781839), (0.7990227, -0.1172819)]),
    ],
)
def test_a_joint_far_beyond_its_limit_is_not_pulled_back(
    client: int, tmp_path: Path, start: float, gravity: float, after: list[tuple[float, float]]
) -> None:
    (tmp_path / "rod.urdf").write_text(ROD)
    p.setGravity(gravity, 0, 0)
    rod = p.loadURDF(str(tmp_path / "rod.urdf"), useFixedBase=True)
    p.setJointMotorControl2(rod, 0, p.VELOCITY_CONTROL, force=0)
    p.resetJointState(rod, 0, start)
    found = []
    for _ in after:
        p.stepSimulation()
        found.append(p.getJointState(rod, 0)[:2])
    np.testing.assert_allclose(found, after, atol=2e-4)


AXLE = """<robot name="axle"><link name="base"/><link name="axle"><inertial><mass value="1"/>
<inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>
<collision><geometry><box size="0.2 0.2 0.2"/></geometry></collision></link>
<joint name="axle" type="{kind}"><parent link="base"/><child link="axle"/><axis xyz="1 0 0"/>
<limit lower="{lower}" upper="{upper}" effort="204" velocity="2"/></joint></robot>"""


@pytest.mark.parametrize(
    ("kind", "lower", "upper", "start", "way", "after"),
    [
        ("prismatic", -1.0, 0.0, 0.0, 1, [0.0, 0.0, 0.0]),
        ("prismatic", 0.0, 1.0, 0.0, -1, [0.0, 0.0, 0.0]),
        ("prismatic", -1.0, 0.5, 0.5, 1, [0.5, 0.5, 0.5]),
        ("prismatic", 0.0, 0.0, 0.0, 1, [0.0, 0.0, 0.0]),
        ("prismatic", -1.0, 0.001, 0.0, 1, [0.05208, 0.05208, 0.05208]),
        ("prismatic", -1.0, 0.0, -1e-9, 1, [0.05208, 0.05208, 0.05208]),
        ("revolute", -1.0, 0.0, 0.0, 1, [0.0, 0.0, 0.0]),
        ("revolute", -1.0, 0.5, 0.5, 1, [0.5, 0.5, 0.5]),
        ("revolute", 0.3, 0.3, 0.3, -1, [0.3, 0.3, 0.3]),
    ],
)
def test_a_joint_that_starts_at_its_limit_does_not_pass_it(
    client: int,
    tmp_path: Path,
    kind: str,
    lower: float,
    upper: float,
    start: float,
    way: int,
    after: list[float],
) -> None:
    (tmp_path / "axle.urdf").write_text(AXLE.format(kind=kind, lower=lower, upper=upper))
    axle = p.loadURDF(str(tmp_path / "axle.urdf"), useFixedBase=True)
    p.setJointMotorControl2(axle, 0, p.VELOCITY_CONTROL, force=0)
    p.resetJointState(axle, 0, start)
    found = []
    for _ in after:
        p.applyExternalForce(axle, 0, [way * 3000, 0, 0], [0, 0, 0], p.WORLD_FRAME)
        if kind == "revolute":
            p.applyExternalTorque(axle, 0, [way * 3000, 0, 0], p.WORLD_FRAME)
        p.stepSimulation()
        found.append(p.getJointState(axle, 0)[0])
    np.testing.assert_allclose(found, after, atol=2e-5)
