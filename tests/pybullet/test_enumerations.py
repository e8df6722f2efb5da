"""Programs do not load MuJoCo's enumerations, which takes as long as a third of the start of a program."""

from __future__ import annotations

import subprocess
import sys
import textwrap

import pytest

pytest.importorskip("mujoco")

PROGRAM = """
import sys
import roboyard.pybullet as p
p.connect(p.DIRECT)
shape = p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.1, 0.1, 0.1])
p.createMultiBody(0, p.createCollisionShape(p.GEOM_PLANE))
fixed = p.createMultiBody(0, shape, basePosition=[0, 0, 1])
p.stepSimulation()
before = "mujoco._enums" in sys.modules
p.resetBaseVelocity(fixed, [0, 0, 0.5])
p.stepSimulation()
print(before, "mujoco._enums" in sys.modules, round(p.getBasePositionAndOrientation(fixed)[0][2], 6))
"""


def test_a_fixed_base_gets_a_velocity_without_them() -> None:
    """The base then moves: 0.5 m/s in one step of 1/240 s, without gravity."""
    command = [sys.executable, "-c", textwrap.dedent(PROGRAM)]
    subprocess.run(command, capture_output=True, check=True)  # it may have to store their numbers
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    before, after, height = done.stdout.split()
    assert before == after == "False"
    assert float(height) == pytest.approx(1 + 0.5 / 240, abs=1e-6)
