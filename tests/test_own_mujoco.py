"""A script whose folder has a `mujoco.py` of its own runs, and imports its own."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

FALL = """
import roboyard.pybullet as p
p.connect(p.DIRECT)
ball = p.createMultiBody(1, p.createCollisionShape(p.GEOM_SPHERE, radius=0.1))
p.setGravity(0, 0, -10)
for _ in range(24):
    p.stepSimulation()
print(round(p.getBaseVelocity(ball)[0][2], 2))
"""
WHOLE = """
from roboyard._mujoco import mujoco as package
print(package.mjtGeom(6).name, package.mjVERSION_HEADER > 300, package.Renderer.__name__)
"""
OWN = """
import mujoco
print(mujoco.OWN)
"""


@pytest.mark.parametrize("module", ["mujoco.py", "mujoco/__init__.py"])
@pytest.mark.parametrize("code", [FALL + WHOLE + OWN, OWN + FALL + WHOLE + OWN, FALL + OWN + WHOLE + OWN])
def test_a_module_beside_the_script_hides_nothing(tmp_path: Path, code: str, module: str) -> None:
    """In a first process, which loads the whole package, and in a second one, which loads its parts."""
    own = tmp_path / "scripts" / module
    own.parent.mkdir(parents=True)
    own.write_text("OWN = 'own'\n")
    script = tmp_path / "scripts" / "script.py"
    script.write_text(code)
    expected = {FALL: ["-1.0"], WHOLE: ["mjGEOM_BOX", "True", "Renderer"], OWN: ["own"]}
    wanted = [word for part in (FALL, WHOLE, OWN) for word in expected[part] if part in code]
    for command in ([str(script)], [str(script)], ["-m", "roboyard.pybullet", str(script)]):
        done = subprocess.run(
            [sys.executable, *command],
            capture_output=True,
            text=True,
            timeout=120,
            env={**os.environ, "XDG_CACHE_HOME": str(tmp_path / "cache")},
        )
        assert not done.returncode, done.stderr
        assert sorted(set(done.stdout.split())) == sorted(set(wanted))
