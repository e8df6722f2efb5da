"""Importing the package loads no compiler."""

import subprocess
import sys


def test_import_leaves_numba_alone():
    code = "import sys, roboyard.kinematics; print('numba' in sys.modules, 'mujoco' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["False", "False"]
