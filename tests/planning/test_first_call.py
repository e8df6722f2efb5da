"""The first plan of a process: compiled loops are loaded without numba, and robots without their packages."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from roboyard.assets import assets_root
from roboyard.description import load_description
from roboyard.description.model import Box, Pose
from roboyard.planning import Obstacle, Planner, PoseGoal, fitted_model
from roboyard.planning.loops import compile_loops

HEAVY = ("numba", "mujoco", "scipy", "trimesh", "matplotlib", "roboyard.robots", "roboyard.sim")


def run(program: str) -> list[str]:
    """Return which heavy modules a program has loaded in a new process."""
    text = f"{program}\nimport json, sys\nprint(json.dumps([m for m in {HEAVY} if m in sys.modules]))"
    done = subprocess.run([sys.executable, "-c", text], capture_output=True, text=True, timeout=240)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout.splitlines()[-1])


def test_all_public_names_load_no_robots_and_no_numba() -> None:
    assert run("from roboyard.planning import *\nplanner_for, Planner, Follower") == []


def test_a_plan_is_made_without_numba_once_the_loops_are_stored() -> None:
    box = Obstacle(name="o", shape=Box(size=(0.1, 0.1, 0.4)), pose=Pose(position=(0.4, 0.3, 0.3)))
    planner = Planner(fitted_model(load_description(assets_root() / "arm7" / "arm7.urdf")), obstacles=[box])
    planner.warm_up()  # compiles and stores what is not stored yet
    start = np.zeros(7)
    goal = PoseGoal(link=planner.robot.links[-1], position=(0.3, 0.3, 0.7))
    expected = planner.plan(start, goal)
    assert expected.trajectory is not None

    loaded = run(
        "import numpy as np\n"
        "from roboyard.assets import assets_root\n"
        "from roboyard.description import load_description\n"
        "from roboyard.description.model import Box, Pose\n"
        "from roboyard.planning import Obstacle, Planner, PoseGoal, fitted_model\n"
        "box = Obstacle(name='o', shape=Box(size=(0.1, 0.1, 0.4)), pose=Pose(position=(0.4, 0.3, 0.3)))\n"
        "model = fitted_model(load_description(assets_root() / 'arm7' / 'arm7.urdf'))\n"
        "planner = Planner(model, obstacles=[box])\n"
        "goal = PoseGoal(link=planner.robot.links[-1], position=(0.3, 0.3, 0.7))\n"
        "plan = planner.plan(np.zeros(7), goal)\n"
        f"assert np.allclose(plan.path, np.array({expected.path.tolist()}), atol=1e-9), plan\n"
    )
    assert "numba" not in loaded and "roboyard.robots" not in loaded


@pytest.mark.slow
def test_compiling_takes_no_time_from_the_first_plan(tmp_path: Path) -> None:
    """All loops are stored but the two that this plan uses, which take about ten seconds to compile."""
    compile_loops()
    program = (
        "import os, shutil, sys\n"
        "import numpy as np\n"
        "from roboyard.assets import assets_root\n"
        "from roboyard.description import load_description\n"
        "from roboyard.native.objects import _stored_at\n"
        "from roboyard.planning import Planner, PoseGoal, fitted_model, keep_upright\n"
        "from roboyard.planning.loops import planner_loops\n"
        "loops, new = planner_loops(), {'is_free', 'motion_free'}\n"
        "files = [_stored_at(one.py_func, one.signature)[0] for one in loops if one.__name__ not in new]\n"
        "for file in files: shutil.copy(file, sys.argv[1])\n"
        "os.environ['NUMBA_CACHE_DIR'] = sys.argv[1]\n"
        "assert {one.__name__ for one in loops if not one.is_ready} == new\n"
        "model = fitted_model(load_description(assets_root() / 'arm7' / 'arm7.urdf'))\n"
        "planner = Planner(model)\n"
        "link = planner.robot.links[-1]\n"
        "start = np.array([0.0, 0.6, 0.0, 1.2, 0.0, 0.6, 0.0])\n"
        "goal = start + [0.8, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]\n"
        "plan = planner.plan(start, goal, time_limit=5.0, keep=keep_upright(link))\n"
        "assert plan.outcome == 'solved' and plan.planning_seconds < 2.0, plan\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", program, str(tmp_path)], capture_output=True, text=True, timeout=240
    )
    assert done.returncode == 0, done.stderr
    assert "compiling the planner" in done.stderr
