"""Forty episodes from resetSimulation on, each with a robot of another size, written to a URDF file."""

import math
import random
import tempfile
from pathlib import Path

import pybullet_data

import pybullet as p

INERTIAL = '<inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'
ROBOT = """<robot name="made">
<link name="a">{inertial}<collision><geometry><box size="{x} {y} 0.1"/></geometry></collision></link>
<link name="b">{inertial}
<collision><geometry><cylinder radius="0.05" length="{z}"/></geometry></collision></link>
<joint name="j" type="revolute"><parent link="a"/><child link="b"/><origin xyz="0 0 0.2"/><axis xyz="0 1 0"/>
<limit lower="-1" upper="1" effort="10" velocity="5"/></joint></robot>"""

p.connect(p.DIRECT)
p.setAdditionalSearchPath(pybullet_data.getDataPath())
random.seed(1)
total = 0.0
with tempfile.TemporaryDirectory() as folder:
    for k in range(40):
        file = Path(folder) / f"robot{k}.urdf"
        x, y, z = (random.uniform(0.1, 0.4) for _ in range(3))
        file.write_text(ROBOT.format(inertial=INERTIAL, x=x, y=y, z=z))
        p.resetSimulation()
        p.setGravity(0, 0, -9.81)
        p.loadURDF("plane.urdf")
        robot = p.loadURDF(str(file), [0, 0, 0.3])
        for step in range(60):
            p.setJointMotorControl2(robot, 0, p.POSITION_CONTROL, math.sin(step / 10), force=5)
            p.stepSimulation()
        total += p.getBasePositionAndOrientation(robot)[0][2]
print(total)
