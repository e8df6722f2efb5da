"""Importing the package loads neither numba nor MuJoCo."""

import subprocess
import sys


def test_import_loads_neither_numba_nor_mujoco():
    code = "import sys, roboyard.kinematics; print('numba' in sys.modules, 'mujoco' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["False", "False"]
