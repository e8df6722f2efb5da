"""Modules that `import roboyard.pybullet` loads: none that a script may never use."""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
from pathlib import Path

import pytest

import roboyard.pybullet as p
from roboyard._mujoco import plugins_are_installed
from roboyard.pybullet.face.command_names import HOMES
from roboyard.pybullet.face.commands import COMMANDS

HEAVY = ("numba", "scipy", "matplotlib", "pydantic", "typer", "rich", "viser", "trimesh", "roboyard.cli")


def output_of(code: str, *arguments: str) -> str:
    done = subprocess.run(
        [sys.executable, "-c", code, *arguments], capture_output=True, text=True, check=True, timeout=120
    )
    return done.stdout


@pytest.mark.parametrize(
    "statement", ["import roboyard.pybullet", "from roboyard.pybullet import bullet_client"]
)
def test_importing_the_module_loads_nothing_heavy(statement: str) -> None:
    names = (*HEAVY, "mujoco", "roboyard.pybullet.api.camera")
    code = f"import sys; {statement}; print(*(name for name in {names!r} if name in sys.modules))"
    assert output_of(code).split() == []


def test_the_table_names_every_command_of_its_modules() -> None:
    for name in COMMANDS:
        assert COMMANDS[name].function.__module__ == HOMES[name], name
    assert set(COMMANDS.entered) == set(HOMES)


def test_functions_unpickle_in_a_process_that_has_not_used_them() -> None:
    code = (
        "import pickle, sys; made = pickle.loads(bytes.fromhex(sys.argv[1]));"
        "import roboyard.pybullet as p; print(all(f is getattr(p, f.__name__) for f in made))"
    )
    functions = [p.setGravity, p.connect, p.loadURDF, p.getQuaternionFromEuler]
    assert output_of(code, pickle.dumps(functions).hex()).strip() == "True"


def test_a_star_import_has_every_function() -> None:
    code = "from roboyard.pybullet import *; print(callable(connect), callable(getCameraImage), DIRECT)"
    assert output_of(code).split() == ["True", "True", "2"]


def test_mujoco_is_loaded_without_its_windows_and_finds_them_when_they_are_used() -> None:
    code = (
        "import sys, roboyard.sim, mujoco; print('glfw' in sys.modules);"
        "print(mujoco.Renderer.__module__.startswith('mujoco'), hasattr(mujoco, 'nonsense'))"
    )
    assert output_of(code).split() == ["False", "True", "False"]


def test_a_small_program_loads_neither_numba_nor_scipy() -> None:
    code = """
import sys
import roboyard.pybullet as p
import roboyard.pybullet_data as data
p.connect(p.DIRECT)
p.setAdditionalSearchPath(data.getDataPath())
p.setGravity(0, 0, -10)
p.loadURDF("plane.urdf")
box = p.createMultiBody(1, p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.1] * 3), -1, [0, 0, 0.2])
robot = p.loadURDF("r2d2.urdf", [2, 0, 0.5])
roof = [[0, 0, 3], [1, 0, 3], [0, 1, 4], [1, 1, 3]]
roof = p.createCollisionShape(
    p.GEOM_MESH, vertices=roof, indices=[0, 1, 2, 1, 3, 2], flags=p.GEOM_FORCE_CONCAVE_TRIMESH
)
p.createMultiBody(0, roof)
for _ in range(10):
    p.applyExternalForce(box, -1, [1, 0, 0], [0, 0, 0], p.LINK_FRAME)
    p.setJointMotorControl2(robot, 0, p.VELOCITY_CONTROL, targetVelocity=1)
    p.stepSimulation()
p.getJointStates(robot, [0, 1]), p.getLinkState(robot, 0, 1), p.getLinkStates(robot, [0, 1])
p.calculateInverseKinematics(robot, 1, [2, 0, 1])
p.calculateJacobian(robot, 1, [0] * 3, *[[0.0] * len(p.calculateInverseKinematics(robot, 1, [2, 0, 1]))] * 3)
p.getContactPoints(box), p.rayTest([0, 0, 5], [0, 0, -5])
print(*(name for name in HEAVY if name in sys.modules))
""".replace("HEAVY", repr(HEAVY))
    output_of(code)  # compiles what is not compiled yet
    assert output_of(code).split() == []


def test_a_program_that_spawns_and_holds_bodies_loads_no_enumerations_and_no_logging() -> None:
    code = """
import sys
import roboyard.pybullet as p
import roboyard.pybullet_data as data
p.connect(p.DIRECT)
p.setAdditionalSearchPath(data.getDataPath())
for k in range(5):
    p.loadURDF("cube_small.urdf", [k, 0, 1])
box = p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.1] * 3)
for _ in range(20):
    made = p.createMultiBody(1, box, -1, [0, 0, 3])
    p.stepSimulation()
    p.removeBody(made)
held = p.createConstraint(0, -1, -1, -1, p.JOINT_FIXED, [0] * 3, [0] * 3, [0, 0, 1])
for k in range(1500):  # until machine code reads it
    if k % 100 == 0:
        p.stepSimulation()
    p.getConstraintState(held)
heavy = "mujoco", "mujoco._enums", "logging", "numpy.ctypeslib", "PIL"
print(*(name for name in heavy if name in sys.modules))
"""
    output_of(code)  # compiles what is not compiled yet
    assert output_of(code).split() == []


def test_packages_with_plugins_of_mujocos_are_found_by_their_entry_points(tmp_path: Path) -> None:
    assert not plugins_are_installed([str(tmp_path / "missing"), str(tmp_path)])
    package = tmp_path / "other-1.0.dist-info"
    package.mkdir()
    (package / "entry_points.txt").write_text("[console_scripts]\nother = other:main\n")
    assert not plugins_are_installed([str(tmp_path)])
    (package / "entry_points.txt").write_text("[mujoco.plugins]\nother = other:register\n")
    assert plugins_are_installed([str(tmp_path)])
    archive = tmp_path / "packages.zip"
    archive.write_bytes(b"")
    assert plugins_are_installed([str(archive)])


def test_plugins_of_mujocos_are_loaded_and_the_packages_metadata_stays_whole(tmp_path: Path) -> None:
    package = tmp_path / "other-1.0.dist-info"
    package.mkdir()
    (package / "METADATA").write_text("Metadata-Version: 2.1\nName: other\nVersion: 1.0\n")
    (tmp_path / "other.py").write_text("def register():\n    print('registered')\n")
    code = (
        "import roboyard._mujoco, mujoco, importlib.metadata; "
        "print(importlib.metadata.version('other'), type(importlib.metadata).__name__)"
    )

    def output() -> list[str]:
        done = subprocess.run(
            [sys.executable, "-c", code],
            capture_output=True,
            text=True,
            check=True,
            env={**os.environ, "PYTHONPATH": os.pathsep.join([str(tmp_path), *sys.path])},
        )
        return done.stdout.split()

    assert output() == ["1.0", "module"]
    (package / "entry_points.txt").write_text("[mujoco.plugins]\nother = other:register\n")
    assert output() == ["registered", "1.0", "module"]
