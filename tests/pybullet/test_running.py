"""`roboyard run`: exit codes, tracebacks, arguments, stand-ins."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

import roboyard

SOURCE = str(Path(roboyard.__file__).parents[1])


def run(
    script: Path, text: str, *arguments: str, module: str = "roboyard.pybullet"
) -> subprocess.CompletedProcess:
    script.write_text(text)
    words = [
        sys.executable,
        "-m",
        module,
        *(["run"] if module == "roboyard" else []),
        str(script),
        *arguments,
    ]
    environment = {**os.environ, "PYTHONPATH": SOURCE}
    return subprocess.run(
        words, capture_output=True, text=True, timeout=120, env=environment, cwd=script.parent
    )


@pytest.mark.parametrize("module", ["roboyard", "roboyard.pybullet"])
def test_a_script_sees_pybullet_and_its_own_arguments(tmp_path: Path, module: str) -> None:
    (tmp_path / "neighbour.py").write_text("VALUE = 5\n")
    done = run(
        tmp_path / "script.py",
        "import sys, pybullet as p, pybullet_data, neighbour\n"
        "from pybullet_utils import bullet_client\n"
        "import pybullet_utils.bullet_client as again\n"
        "c = bullet_client.BulletClient(p.DIRECT)\n"
        "c.setGravity(0, 0, -3)\n"
        "print(__name__, sys.argv[1:], neighbour.VALUE, again is bullet_client, p.__name__)\n"
        "print(c.getPhysicsEngineParameters()['gravityAccelerationZ'], pybullet_data.getDataPath())\n",
        *("--flag", "-x", "--help"),
        module=module,
    )
    assert done.returncode == 0, done.stderr
    first, second = done.stdout.splitlines()
    assert first == "__main__ ['--flag', '-x', '--help'] 5 True roboyard.pybullet"
    assert second.startswith("-3.0 ")
    assert (Path(second.split(maxsplit=1)[1]) / "plane.urdf").is_file()


def test_a_module_of_the_script_has_the_name_of_pybullets_utilities(tmp_path: Path) -> None:
    """It is executed when the script imports it, not before, and once."""
    (tmp_path / "pybullet_utils.py").write_text("print('utilities')\nVALUE = 5\n")
    text = "print('script')\nimport pybullet, pybullet_utils\nprint(pybullet_utils.VALUE)\n"
    done = run(tmp_path / "script.py", text, module="roboyard")
    assert done.stdout.split() == ["script", "utilities", "5"], done.stderr


def test_the_client_is_an_attribute_of_the_package(tmp_path: Path) -> None:
    text = (
        "import pybullet_utils.bullet_client\n"
        "from roboyard.pybullet import bullet_client\n"
        "print(pybullet_utils.bullet_client is bullet_client)\n"
    )
    done = run(tmp_path / "script.py", text, module="roboyard")
    assert done.stdout.split() == ["True"], done.stderr


@pytest.mark.parametrize(("leave", "code"), [("sys.exit(7)", 7), ("sys.exit()", 0), ("sys.exit('why')", 1)])
def test_exit_codes_are_the_scripts(tmp_path: Path, leave: str, code: int) -> None:
    done = run(tmp_path / "script.py", f"import sys, pybullet\n{leave}\n")
    assert done.returncode == code
    assert ("why" in done.stderr) == (code == 1)


def test_tracebacks_begin_in_the_script(tmp_path: Path) -> None:
    done = run(
        tmp_path / "script.py", "import pybullet as p\np.connect(p.DIRECT)\np.setGravity(0, 0, 0, 9)\n"
    )
    assert done.returncode == 1
    lines = done.stderr.splitlines()
    assert lines[0] == "Traceback (most recent call last):"
    assert "script.py" in lines[1]
    assert lines[-2].endswith("error: Not connected to physics server.")
    assert "runpy" not in done.stderr


def test_a_missing_script_is_wrong_usage(tmp_path: Path) -> None:
    words = [sys.executable, "-m", "roboyard", "run", str(tmp_path / "none.py")]
    done = subprocess.run(
        words, capture_output=True, text=True, timeout=60, env={**os.environ, "PYTHONPATH": SOURCE}
    )
    assert done.returncode == 2
    assert "none.py" in done.stderr


@pytest.mark.parametrize(
    ("arguments", "code", "text"),
    [
        ([], 2, "usage: python -m roboyard.pybullet SCRIPT"),
        (["--help"], 0, "usage"),
        (["no.py"], 2, "'no.py'"),
    ],
)
def test_the_module_needs_a_script(
    arguments: list[str], code: int, text: str, capsys: pytest.CaptureFixture[str]
) -> None:
    from roboyard.pybullet.running import main

    assert main(arguments) == code
    assert text in capsys.readouterr().err


def test_whole_programs_run_without_numba_and_collect_their_own_garbage(tmp_path: Path) -> None:
    text = (
        "import gc, sys, weakref\n"
        "import pybullet as p, pybullet_data\n"
        "class Ring:\n"
        "    def __init__(self):\n"
        "        self.ring = self\n"
        "ring = Ring(); seen = weakref.ref(ring); del ring; gc.collect()\n"
        "p.connect(p.DIRECT)\n"
        "p.setAdditionalSearchPath(pybullet_data.getDataPath())\n"
        "p.loadURDF('plane.urdf'); arm = p.loadURDF('kuka_iiwa/model.urdf', useFixedBase=True)\n"
        "angles = p.calculateInverseKinematics(arm, 6, [0.4, 0.1, 0.6])\n"
        "p.setJointMotorControlArray(arm, range(7), p.POSITION_CONTROL, angles)\n"
        "for _ in range(10): p.stepSimulation()\n"
        "print(seen() is None, gc.isenabled(), 'numba' in sys.modules)\n"
    )
    for _ in range(2):  # the first may compile loops
        done = run(tmp_path / "whole.py", text)
        assert done.returncode == 0, done.stderr
    assert done.stdout.split() == ["True", "True", "False"]
