"""A robot of an MJCF file that lands on balls and capsules has PyBullet's contacts in each step.

Recorded with PyBullet 3.2.7. Its contacts begin across a gap, as far as both shapes are large, and as parts
of compounds end when their own boxes part.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from roboyard import pybullet as p

ROBOT = """<mujoco model="hopping">
  <compiler angle="degree" inertiafromgeom="true"/>
  <worldbody>
    <body name="torso" pos="0 0 0.75">
      <geom name="torso" type="sphere" size="0.12" density="900"/>
      <body name="leg" pos="0.05 0 0">
        <joint name="hip" type="hinge" axis="0 1 0" pos="0 0 0" range="-60 60"/>
        <geom name="leg" type="capsule" fromto="0 0 0 0.15 0.1 -0.3" size="0.07" density="900"/>
        <body name="foot" pos="0.15 0.1 -0.3">
          <joint name="ankle" type="hinge" axis="1 0 0" pos="0 0 0" range="-60 60"/>
          <geom name="foot" type="sphere" pos="0.03 0.02 -0.1" size="0.08" density="900"/>
        </body>
      </body>
      <body name="arm" pos="-0.05 0 0">
        <joint name="shoulder" type="hinge" axis="0 1 0" pos="0 0 0" range="-60 60"/>
        <geom name="arm" type="capsule" fromto="0 0 0 -0.25 0.05 -0.35" size="0.06" density="900"/>
      </body>
    </body>
  </worldbody>
</mujoco>"""
LINKS = [
    (22, []),
    (2, [3]),
    (3, []),
    (30, [5]),
    (13, [5, 1]),
    (4, [5, 1, -1]),
    (38, [-1]),
    (8, [-1, 3]),
]
"""For so many steps, the links that touch the ground, in order."""
STATES = {
    26: ([], [0.019289669, -0.009510301, 0.438113241, -0.374864056, -0.447797912, -2.102751164]),
    27: ([(5, 0.002350806)], [0.020458389, -0.01196498, 0.433342101, 0.280492974, -0.5891231, -1.145073726]),
    28: ([(5, 4.8029e-05)], [0.022204154, -0.014531822, 0.429238878, 0.418983649, -0.616041908, -0.98477339]),
    40: ([(5, 4.564e-05)], [0.042341687, -0.043070544, 0.364496055, 0.386305233, -0.529212199, -1.550456783]),
    60: (
        [(5, -0.000256113), (1, 3.273e-05)],
        [0.067502245, -0.081613211, 0.20233584, 0.06601411, -0.515106032, -2.016867403],
    ),
    73: (
        [(5, 0.005214495), (1, 0.0066219), (-1, -1.0304e-05)],
        [0.067375458, -0.102807388, 0.11998971, -0.087484612, -0.376816085, 3.298e-06],
    ),
    74: ([(-1, -1.029e-05)], [0.067019686, -0.104346327, 0.119989722, -0.085385309, -0.369345364, 2.92e-06]),
    90: ([(-1, -1.0199e-05)], [0.062384303, -0.125069203, 0.119989803, -0.057987068, -0.261242054, 3.97e-07]),
    110: ([(-1, -1.0182e-05)], [0.058272899, -0.14095736, 0.119989818, -0.044654503, -0.124490846, 1.77e-07]),
    111: ([(-1, -1.0182e-05)], [0.058087707, -0.141445759, 0.119989819, -0.04444606, -0.11721576, 1.88e-07]),
    119: (
        [(-1, -1.0231e-05), (3, -0.002340082)],
        [0.056377913, -0.144118239, 0.119989754, -0.058931205, -0.055050535, -3.673e-06],
    ),
}
"""After a step, links and gaps (m) of contacts, and the base's place (m) and velocity (m/s)."""


def test_contacts_and_motion_are_the_recorded_ones(client: int, tmp_path: Path) -> None:
    (tmp_path / "robot.xml").write_text(ROBOT, encoding="utf-8")
    p.setGravity(0, 0, -9.81)
    ground = p.createCollisionShape(p.GEOM_BOX, halfExtents=[5, 5, 0.5])
    p.createMultiBody(0, ground, basePosition=[0, 0, -0.5])
    body = p.loadMJCF(str(tmp_path / "robot.xml"))[0]
    p.resetBaseVelocity(body, [0.3, 0, -2.5])
    joints = [j for j in range(p.getNumJoints(body)) if p.getJointInfo(body, j)[2] == p.JOINT_REVOLUTE]
    assert len(joints) == 3
    for joint in joints:
        p.setJointMotorControl2(body, joint, p.VELOCITY_CONTROL, force=0)
    expected = [links for count, links in LINKS for _ in range(count)]
    for step, links in enumerate(expected):
        p.stepSimulation()
        contacts = p.getContactPoints()
        assert [max(contact[3:5]) for contact in contacts] == links, step
        if step in STATES:
            gaps, state = STATES[step]
            place, velocity = p.getBasePositionAndOrientation(body)[0], p.getBaseVelocity(body)[0]
            np.testing.assert_allclose([*place, *velocity], state, atol=2e-5, err_msg=str(step))
            np.testing.assert_allclose([c[8] for c in contacts], [gap for _, gap in gaps], atol=2e-6)
