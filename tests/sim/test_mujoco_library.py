"""The library of MuJoCo besides its Python module."""

from __future__ import annotations

import subprocess
import sys

import pytest

from roboyard.sim.mujoco_library import mujoco_library

TIMES = """
import mujoco
from roboyard.sim.mujoco_library import stop_timers

def spent():
    data.timer[int(mujoco.mjtTimer.mjTIMER_STEP)].duration = 0.0
    for _ in range(20):
        mujoco.mj_step(model, data)
    return data.timer[int(mujoco.mjtTimer.mjTIMER_STEP)].duration

body = "<body><freejoint/><geom size='1'/></body>"
model = mujoco.MjModel.from_xml_string(f"<mujoco><worldbody>{body}</worldbody></mujoco>")
data = mujoco.MjData(model)
before = spent()
if "--own" in __import__("sys").argv:
    mujoco.set_mjcb_time(lambda: 3.0)
stopped = stop_timers()
print(before > 0.0, stopped, mujoco.get_mjcb_time() is None, spent() == 0.0)
"""


@pytest.mark.skipif(mujoco_library() is None, reason="MuJoCo's library has another name")
@pytest.mark.parametrize("own", [False, True])
def test_timers_stand_still_unless_a_program_has_a_clock(own: bool) -> None:
    ran = subprocess.run(
        [sys.executable, "-c", TIMES, *(["--own"] if own else [])], capture_output=True, text=True, timeout=60
    )
    assert ran.stdout.split() == ["True", str(not own), str(not own), "True"], ran.stderr
