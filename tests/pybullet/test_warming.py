"""Connecting loads what the first step needs, and leaves no trace of it."""

from __future__ import annotations

import subprocess
import sys

SCRIPT = """
import sys
import roboyard.pybullet as p
assert "numba" not in sys.modules
p.connect(p.DIRECT)
from roboyard.sim.stepping import kernels
for kernel in (kernels.hard_contacts, kernels.drive_motors, kernels.bound_velocity, kernels.add_damping):
    assert kernel.signatures, kernel
assert p.getNumBodies() == 0
assert p.createCollisionShape(p.GEOM_SPHERE, radius=1) == 0
assert p.createMultiBody(1, 0) == 0
"""


def test_the_first_connection_loads_the_compiled_loops() -> None:
    done = subprocess.run([sys.executable, "-c", SCRIPT], capture_output=True, text=True, timeout=240)
    assert done.returncode == 0, done.stderr
